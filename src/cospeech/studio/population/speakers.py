"""The speakers of a population: how each one articulates, and what voice and mouth have of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.studio.population import names, phones
from cospeech.studio.population.phones import ARTICULATORS, PHONES, RANGES, Spoken
from cospeech.studio.population.settings import Settings, speaker_names

ROWS = {phone: row for row, phone in enumerate(PHONES)}

STYLE = 0.16
"""Standard deviation of a speaker's deviation from the targets of a phone."""
VARIATION = 0.06
"""Standard deviation of the deviation of a phone in a single utterance."""
TEMPO = 0.12
"""Standard deviation of the logarithm of the tempo between speakers; between utterances it is a third of that."""
SLACK_S = 0.5
"""By how much the phones that are only seen outlast the clip at both ends, in seconds: more than the delay."""
CENTRE = np.array([0.35, 0.05, 0.15, 0.35])
"""Mean positions of the articulators in speech."""


@dataclass(frozen=True, eq=False)
class Speaker:
    """One speaker.

    Attributes
    ----------
    name : name of the speaker in tables.
    phrase : the speaker's own name, the secret phrase.
    style : (P, 4) deviation from the targets of each phone, heard and seen.
    tempo : factor of the speed of speech.
    """

    name: str
    phrase: str
    style: Floats
    tempo: float


@dataclass(frozen=True, eq=False)
class Utterance:
    """What a speaker says once.

    Attributes
    ----------
    clip : name of the clip.
    speaker : who says it.
    phrase : the phrase.
    repetition : number of this utterance of the phrase, from 0.
    session : number of the recording session, from 0.
    """

    clip: str
    speaker: Speaker
    phrase: str
    repetition: int
    session: int

    @property
    def own_name(self) -> bool:
        """Whether speakers say their own name."""
        return self.phrase == self.speaker.phrase


def population(settings: Settings, seed: int) -> list[Speaker]:
    """Return the speakers of a population."""
    speakers = []
    phrases = names.draw(settings.speakers, seed)
    for name, phrase in zip(speaker_names(settings.speakers), phrases, strict=True):
        rng = random_source(seed, "population", "speaker", name)
        style = STYLE * rng.standard_normal((len(PHONES), len(ARTICULATORS)))
        style[ROWS[phones.SILENCE]] *= 0.3
        tempo = float(np.exp(settings.own_voice * TEMPO * rng.standard_normal()))
        speakers.append(Speaker(name, phrase, style, tempo))
    return speakers


def utterances(speakers: list[Speaker], speaker: Speaker, settings: Settings, seed: int) -> list[Utterance]:
    """Return what a speaker says: repetitions of the own name, in the order of the sessions, and other names."""
    rng = random_source(seed, "population", "others", speaker.name)
    others = [other.phrase for other in speakers if other is not speaker]
    said = rng.permutation(len(others))[: settings.others].tolist()
    own = [
        Utterance(
            f"{speaker.name}_own_{n + 1}", speaker, speaker.phrase, n, n * settings.sessions // settings.repetitions
        )
        for n in range(settings.repetitions)
    ]
    foreign = [
        Utterance(f"{speaker.name}_other_{n + 1}", speaker, others[other], 0, n % settings.sessions)
        for n, other in enumerate(said)
    ]
    return own + foreign


def utterance_rng(utterance: Utterance, purpose: str, seed: int) -> np.random.Generator:
    """Return the random numbers for one purpose in an utterance."""
    return random_source(seed, "population", purpose, utterance.clip)


def tempo(utterance: Utterance, seed: int) -> float:
    """Return the tempo of an utterance, about that of its speaker."""
    variation = utterance_rng(utterance, "tempo", seed).standard_normal()
    return utterance.speaker.tempo * float(np.exp(TEMPO / 3 * variation))


@dataclass(frozen=True, eq=False)
class Articulation:
    """How an utterance is articulated.

    Attributes
    ----------
    heard : the phones of the voice.
    deviations : (n, 4) deviation of these phones from their usual targets.
    elsewhere : other phones during the same time, which the lips follow as far as they share nothing with the voice.
    shared : share of the variance of the lip movements that follows the voice.
    delay_s : by how much the voice lags behind the lips.
    """

    heard: Spoken
    deviations: Floats
    elsewhere: Spoken
    shared: float
    delay_s: float

    def voice(self, times_s: Floats) -> Floats:
        """Return the positions (T, 4) of the articulators that are heard at ``times_s``."""
        return np.clip(phones.movement(self.heard, times_s, self.deviations), RANGES[:, 0], RANGES[:, 1])

    def lips(self, times_s: Floats) -> Floats:
        """Return the positions (T, 4) of the articulators that are seen at ``times_s``."""
        heard = phones.movement(self.heard, times_s + self.delay_s, self.deviations) - CENTRE
        other = phones.movement(self.elsewhere, times_s + self.delay_s) - CENTRE
        mixed = CENTRE + np.sqrt(self.shared) * heard + np.sqrt(1.0 - self.shared) * other
        return np.clip(mixed, RANGES[:, 0], RANGES[:, 1])


def articulate(
    utterance: Utterance, heard: Spoken, speakers: list[Speaker], settings: Settings, seed: int
) -> Articulation:
    """Return how an utterance is articulated whose phones have known times."""
    rng = utterance_rng(utterance, "articulation", seed)
    rows = [ROWS[phone] for phone in heard.phones]
    deviations = utterance.speaker.style[rows] + VARIATION * rng.standard_normal((len(rows), len(ARTICULATORS)))
    return Articulation(heard, deviations, _elsewhere(heard, speakers, rng), settings.shared, settings.delay_s)


def _elsewhere(heard: Spoken, speakers: list[Speaker], rng: np.random.Generator) -> Spoken:
    """Return phones of other phrases that last longer than ``heard`` and start somewhere in a phrase."""
    said: list[Spoken] = []
    while sum(one.duration_s for one in said[1:]) < heard.duration_s + 2 * SLACK_S:
        said.append(phones.spoken(speakers[rng.integers(len(speakers))].phrase, 1.0, rng))
    begins_s = np.cumsum([0.0, *(one.duration_s for one in said)])
    edges_s = np.concatenate([begin + one.edges_s[:-1] for begin, one in zip(begins_s, said, strict=False)])
    shift_s = SLACK_S + rng.uniform(0.0, said[0].duration_s)
    return Spoken([phone for one in said for phone in one.phones], np.append(edges_s, begins_s[-1]) - shift_s)


def clips_table(said: Mapping[Utterance, Articulation], folder: str | None, settings: Settings) -> pd.DataFrame:
    """Return the table of clips (schema ``clips``) of utterances.

    Parameters
    ----------
    folder : folder of the sound and the films, None if there is no sound.
    """
    return pd.DataFrame(
        {
            "clip": [one.clip for one in said],
            "speaker": [one.speaker.name for one in said],
            "phrase": [one.phrase for one in said],
            "repetition": [one.repetition for one in said],
            "session": [f"session{one.session + 1}" for one in said],
            "own_name": [one.own_name for one in said],
            "film": [f"{folder}/{one.clip}.mkv" if settings.film else None for one in said],
            "sound": [f"{folder}/{one.clip}.wav" if settings.sound else None for one in said],
            "fps": settings.fps,
            "duration_s": [how.heard.duration_s for how in said.values()],
            "delay_planted_s": settings.delay_s,
        }
    )
