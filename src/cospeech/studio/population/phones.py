"""Phones: how each one moves the mouth, and how a sequence of them moves it, with coarticulation.

Four articulators describe the visible part of the mouth. Each phone has a target for each of them, and a dominance:
how strongly it insists on that target (Löfqvist 1990; Cohen and Massaro 1993). The position of an articulator is the
mean of the targets of all phones, weighted with their dominance, which fades with the distance in time:

    u_k(t) = sum_i w_ik(t) T_ik / sum_i w_ik(t),    w_ik(t) = A_ik exp(-(a_i(t) / b)^2),

where a_i(t) is the time from phone i, 0 during it, and b is ``REACH_S``. A bilabial stop closes the lips whatever
surrounds it; the opening during a consonant is that of its neighbours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats

ARTICULATORS = ("open", "wide", "press", "tongue")
"""How far the jaw is lowered, 0 to 1; how far the lips are spread, from -1, rounded, to 1; how firmly they are
pressed together, 0 to 1; how high the tip of the tongue is, 0 to 1."""

RANGES = np.array([[0.0, 1.0], [-1.0, 1.0], [0.0, 1.0], [0.0, 1.0]])
"""Lowest and highest position of each articulator."""

SILENCE = ""
REACH_S = 0.05
"""How far the influence of a phone extends beyond it, in seconds."""

VOWEL = (1.0, 1.0, 0.6, 0.4)
LIPS = (0.6, 0.2, 5.0, 0.1)
TIP = (0.5, 0.3, 0.6, 2.0)
BACK = (0.4, 0.1, 0.6, 0.4)
ROUNDED_TIP = (0.8, 1.5, 0.6, 1.5)
STILL = (1.2, 0.8, 1.2, 0.8)
"""Dominance of kinds of phones over each articulator."""

PHONES = {
    SILENCE: ((0.0, 0.0, 0.3, 0.0), STILL),
    "a": ((0.90, 0.15, 0.0, 0.1), VOWEL),
    "ɑ": ((0.95, 0.05, 0.0, 0.1), VOWEL),
    "æ": ((0.80, 0.50, 0.0, 0.2), VOWEL),
    "ɛ": ((0.65, 0.50, 0.0, 0.2), VOWEL),
    "e": ((0.50, 0.60, 0.0, 0.3), VOWEL),
    "ə": ((0.45, 0.10, 0.0, 0.2), VOWEL),
    "i": ((0.25, 0.90, 0.0, 0.4), VOWEL),
    "ɪ": ((0.35, 0.65, 0.0, 0.3), VOWEL),
    "ɯ": ((0.35, 0.35, 0.0, 0.3), VOWEL),
    "ɨ": ((0.35, 0.35, 0.0, 0.3), VOWEL),
    "ɔ": ((0.60, -0.70, 0.0, 0.1), VOWEL),
    "o": ((0.50, -0.80, 0.0, 0.1), VOWEL),
    "œ": ((0.55, -0.65, 0.0, 0.2), VOWEL),
    "ø": ((0.45, -0.75, 0.0, 0.2), VOWEL),
    "ʊ": ((0.30, -0.80, 0.0, 0.1), VOWEL),
    "u": ((0.22, -1.00, 0.0, 0.1), VOWEL),
    "y": ((0.22, -0.90, 0.0, 0.3), VOWEL),
    "m": ((0.12, 0.05, 1.0, 0.1), LIPS),
    "b": ((0.15, 0.00, 1.0, 0.1), LIPS),
    "p": ((0.15, 0.00, 1.0, 0.1), LIPS),
    "f": ((0.15, 0.20, 0.7, 0.1), LIPS),
    "v": ((0.18, 0.15, 0.6, 0.1), LIPS),
    "t": ((0.25, 0.25, 0.0, 0.9), TIP),
    "d": ((0.28, 0.20, 0.0, 0.9), TIP),
    "n": ((0.30, 0.20, 0.0, 0.9), TIP),
    "l": ((0.40, 0.20, 0.0, 1.0), TIP),
    "ɫ": ((0.42, 0.10, 0.0, 0.9), TIP),
    "r": ((0.32, 0.10, 0.0, 0.8), TIP),
    "ɾ": ((0.34, 0.10, 0.0, 0.8), TIP),
    "s": ((0.12, 0.45, 0.0, 0.6), TIP),
    "z": ((0.14, 0.40, 0.0, 0.6), TIP),
    "ʃ": ((0.20, -0.50, 0.0, 0.6), ROUNDED_TIP),
    "ʒ": ((0.22, -0.45, 0.0, 0.6), ROUNDED_TIP),
    "tʃ": ((0.20, -0.45, 0.0, 0.7), ROUNDED_TIP),
    "dʒ": ((0.22, -0.40, 0.0, 0.7), ROUNDED_TIP),
    "j": ((0.25, 0.60, 0.0, 0.4), BACK),
    "k": ((0.35, 0.10, 0.0, 0.2), BACK),
    "c": ((0.30, 0.30, 0.0, 0.3), BACK),
    "ɡ": ((0.38, 0.10, 0.0, 0.2), BACK),
    "ɟ": ((0.32, 0.30, 0.0, 0.3), BACK),
    "ɰ": ((0.45, 0.10, 0.0, 0.2), BACK),
    "h": ((0.50, 0.10, 0.0, 0.1), BACK),
}
"""Targets and dominance of each phone, in the order of ``ARTICULATORS``."""

LETTERS = {
    "ı": "ɯ", "ö": "ø", "ü": "y", "ç": "tʃ", "c": "dʒ", "ş": "ʃ", "j": "ʒ", "y": "j", "g": "ɡ", "ğ": "ɰ", "o": "ɔ",
    "e": "ɛ",
}  # fmt: skip
"""Phones of Turkish letters that differ from the letter: the spelling is phonemic."""

VOWEL_LETTERS = "aeıioöuü"
VOWEL_S, CONSONANT_S, PAUSE_S = 0.115, 0.075, 0.05
"""Mean durations of vowels, of consonants, and of the pause between two words, in seconds."""
SPREAD = 0.15
"""Standard deviation of the logarithm of these durations."""
MARGIN_S = (0.12, 0.2)
"""Range of the silence before and after a phrase, in seconds."""


class Spoken(NamedTuple):
    """The phones of an utterance, silence included, without gaps: labels and (n + 1,) their limits in seconds."""

    phones: list[str]
    edges_s: Floats

    @property
    def duration_s(self) -> float:
        """Length of the utterance in seconds."""
        return float(self.edges_s[-1])

    def delayed(self, delay_s: float) -> Spoken:
        """Return the same phones ``delay_s`` later."""
        return Spoken(self.phones, self.edges_s + delay_s)


def known(symbol: str) -> str:
    """Return the phone of ``PHONES`` that a symbol of the synthesiser stands for; its diacritics are left out."""
    plain = symbol.replace("ː", "").replace("\u0361", "")
    if plain in PHONES:
        return plain
    return plain[0] if plain[0] in PHONES else "ə"


def pronounced(phrase: str) -> list[str]:
    """Return the phones of a Turkish phrase, with silence between its words."""
    letters = phrase.replace("İ", "i").replace("I", "ı").lower()
    return [SILENCE if letter == " " else LETTERS.get(letter, letter) for letter in letters]


def spoken(phrase: str, tempo: float, rng: np.random.Generator) -> Spoken:
    """Return a phrase with random durations of its phones, and silence around it.

    Parameters
    ----------
    tempo : factor of the speed, 1 on average.
    """
    inner = pronounced(phrase)
    vowels = {LETTERS.get(letter, letter) for letter in VOWEL_LETTERS}
    usual_s = [PAUSE_S if phone == SILENCE else VOWEL_S if phone in vowels else CONSONANT_S for phone in inner]
    durations_s = np.array(usual_s) / tempo * np.exp(SPREAD * rng.standard_normal(len(inner)))
    margins_s = rng.uniform(*MARGIN_S, 2)
    all_s = np.concatenate([margins_s[:1], durations_s, margins_s[1:]])
    return Spoken([SILENCE, *inner, SILENCE], np.concatenate([[0.0], np.cumsum(all_s)]))


def targets(phones: list[str]) -> Floats:
    """Return the targets (n, 4) of phones."""
    return np.array([PHONES[phone][0] for phone in phones])


def weights(utterance: Spoken, times_s: Floats) -> Floats:
    """Return the share (T, n, 4) that each phone has in the position of each articulator at ``times_s``."""
    # The first and the last phone, which are silence, last beyond the ends.
    limits_s = np.concatenate([[-np.inf], utterance.edges_s[1:-1], [np.inf]])
    away_s = np.maximum(np.maximum(limits_s[:-1] - times_s[:, None], times_s[:, None] - limits_s[1:]), 0.0)
    fading = np.exp(-((away_s / REACH_S) ** 2))
    dominance = np.array([PHONES[phone][1] for phone in utterance.phones])
    strength = fading[:, :, None] * dominance
    return np.asarray(strength / strength.sum(axis=1, keepdims=True))


def movement(utterance: Spoken, times_s: Floats, deviations: Floats | float = 0.0) -> Floats:
    """Return the positions (T, 4) of the articulators at ``times_s``, in seconds.

    Parameters
    ----------
    deviations : (n, 4) by how much the targets of these phones differ from ``PHONES``.
    """
    return np.einsum("tnk,nk->tk", weights(utterance, times_s), targets(utterance.phones) + deviations)
