"""Names that the speakers of a population say: a first name and a family name, in Turkish."""

from __future__ import annotations

from cospeech.data.rng import random_source

FIRST = (
    "Ayşe", "Fatma", "Emine", "Hatice", "Zeynep", "Elif", "Meryem", "Şerife", "Sultan", "Hanife", "Merve", "Havva",
    "Özlem", "Esra", "Yasemin", "Hülya", "Songül", "Gülsüm", "Büşra", "Kübra", "Mehmet", "Mustafa", "Ahmet", "Ali",
    "Hüseyin", "Hasan", "İbrahim", "İsmail", "Osman", "Yusuf", "Murat", "Ömer", "Ramazan", "Halil", "Süleyman",
    "Mahmut", "Recep", "Salih", "Fatih", "Kadir",
)  # fmt: skip
FAMILY = (
    "Yılmaz", "Kaya", "Demir", "Şahin", "Çelik", "Yıldız", "Yıldırım", "Öztürk", "Aydın", "Özdemir", "Arslan",
    "Doğan", "Kılıç", "Aslan", "Çetin", "Kara", "Koç", "Kurt", "Özkan", "Şimşek", "Polat", "Korkmaz", "Çakır",
    "Erdoğan", "Yavuz", "Can", "Acar", "Şen", "Aktaş", "Güler", "Yalçın", "Güneş", "Bozkurt", "Bulut", "Keskin",
    "Ünal", "Turan", "Gül", "Özer", "Işık",
)  # fmt: skip

MOST = len(FIRST) * len(FAMILY)
"""Number of different names."""


def draw(n: int, seed: int) -> list[str]:
    """Return ``n`` different names in random order; ``n`` is at most ``MOST``."""
    chosen = random_source(seed, "population", "names").permutation(MOST)[:n]
    return [f"{FIRST[number // len(FAMILY)]} {FAMILY[number % len(FAMILY)]}" for number in chosen.tolist()]
