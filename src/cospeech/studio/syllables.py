"""The syllables of the planted speech, and how arousal and accents change its melody.

Speech between two pauses consists of syllables without gaps. Each has an inflection, a loudness and a length, which
are independent of each other and of the syllables before. Arousal sets the tempo. In the worlds of this module, the
prosody patterns of intonation phrases are flatter than in the world ``phrases``, as other things modulate the voice
as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.segments import frame_times
from cospeech.studio import arousal
from cospeech.studio.melody import LEVEL_DB, phrase_contours
from cospeech.studio.patterns import PATTERNS

FEATURES = {
    "inflection": ("level", "rise", "fall"),
    "loudness": ("soft", "medium", "loud"),
    "length": ("short", "medium", "long"),
}
"""The features of a syllable (Levine 2009, table 3.1) and their levels."""

LEVELS = {"inflection": (0.5, 0.25, 0.25), "loudness": (0.3, 0.4, 0.3), "length": (0.3, 0.4, 0.3)}
"""Probability of each level."""

_UP_TO = {feature: np.cumsum(probabilities) for feature, probabilities in LEVELS.items()}

INFLECTION_ST = (0.0, 3.0, -3.0)
LOUDNESS_DB = (-4.0, 0.0, 4.0)
LENGTH = (0.72, 1.0, 1.4)
"""Change of the pitch over a syllable in semitones, level, and factor of its length, by level of each feature."""

MEDIUM_S = 0.19
LENGTH_SPREAD = 0.08
"""Length of a medium syllable, and standard deviation of the logarithm of lengths."""

SHORTEST_S = 0.08
"""Smallest distance of two peaks that the body follows; where it begins to listen, they could be closer."""

PEAK = 0.45
"""Position of the peak in a syllable, as a share of its length."""

TROUGH_DB = 6.0
"""Depth of the trough of the intensity between two syllables."""

HEADROOM_DB = 1.0
"""Level by which speech is softer than in the world ``phrases``, so that loud syllables in excitement do not clip."""

FLATNESS = 0.35
"""Factor of the contours of prosody patterns."""

LOWEST_ST = min(value for pattern in PATTERNS for value in pattern.pitch_st)
"""Lowest pitch of a speaker; arousal changes the intervals above it."""

GRID_S = 0.01
"""Time step at which the tempo is looked up."""


def sample(prosody: pd.DataFrame, spoken: pd.DataFrame | None, rng: np.random.Generator) -> pd.DataFrame:
    """Return random syllables that fill the speech of a record between its pauses.

    Parameters
    ----------
    prosody : the intonation phrases of the record.
    spoken : the arousal of the speech as a segment table, or None.

    Returns
    -------
    A table with the columns start_s, peak_s and end_s, and the level of each of ``FEATURES``.
    """
    grid_s = frame_times(round(float(prosody["end_s"].iloc[-1]) / GRID_S), 1.0 / GRID_S)
    medium_s = MEDIUM_S * arousal.effect(spoken, arousal.SYLLABLE, grid_s)
    edges: list[tuple[Floats, Floats]] = []
    long: list[int] = []
    for start, end in stretches(prosody):
        lengths: list[float] = []
        at = start
        while at < end or not lengths:
            level = _level("length", rng)
            own_s = LENGTH[level] * medium_s[min(int(at / GRID_S), len(medium_s) - 1)]
            lengths.append(own_s * rng.lognormal(0.0, LENGTH_SPREAD))
            long.append(level)
            at += lengths[-1]
        if len(lengths) > 1 and at - end > lengths[-1] / 2:
            del lengths[-1], long[-1]
        until = np.cumsum(lengths)
        bounds = start + (end - start) * np.append(0.0, until / until[-1])
        edges.append((bounds[:-1], bounds[1:]))
    if not edges:
        return pd.DataFrame({name: [] for name in ("start_s", "peak_s", "end_s", *FEATURES)})
    start_s, end_s = (np.concatenate(side) for side in zip(*edges, strict=True))
    drawn = {"length": np.array(long)}
    for name in ("inflection", "loudness"):
        drawn[name] = np.searchsorted(_UP_TO[name], rng.random(len(long)), side="right")
    columns = {name: np.array(levels, dtype=object)[drawn[name]] for name, levels in FEATURES.items()}
    return pd.DataFrame({"start_s": start_s, "peak_s": start_s + PEAK * (end_s - start_s), "end_s": end_s} | columns)


def _level(feature: str, rng: np.random.Generator) -> int:
    return int(np.searchsorted(_UP_TO[feature], rng.random(), side="right"))


def stretches(prosody: pd.DataFrame) -> Floats:
    """Return the start and end in seconds of each stretch of speech between two pauses, (K, 2)."""
    silent = [pattern.name for pattern in PATTERNS if not pattern.speaks]
    speaks = ~prosody["label"].isin(silent).to_numpy()
    edges = np.flatnonzero(np.diff(np.concatenate([[0], speaks.astype(int), [0]]))).reshape(-1, 2)
    start_s, end_s = prosody["start_s"].to_numpy(), prosody["end_s"].to_numpy()
    return np.column_stack([start_s[edges[:, 0]], end_s[edges[:, 1] - 1]])


def heard(table: pd.DataFrame) -> pd.DataFrame:
    """Return the syllables that the body follows, in order of time, without those that are too close to others."""
    followed = table[table["followed"]].sort_values("peak_s", kind="stable", ignore_index=True)
    keep, last = [], -np.inf
    for peak_s in followed["peak_s"]:
        keep.append(peak_s - last >= SHORTEST_S)
        last = peak_s if keep[-1] else last
    return followed[np.array(keep, dtype=bool)].reset_index(drop=True)


@dataclass(frozen=True)
class Delivery:
    """How a record is spoken: the contours of its intonation phrases as changed by arousal and by accents.

    Attributes
    ----------
    syllables : the syllables of the record.
    spoken : the arousal of its speech as a segment table, or None.
    flatness : factor of the contours of prosody patterns.
    accents : factor of the inflections and the loudness of syllables.
    """

    syllables: pd.DataFrame
    spoken: pd.DataFrame | None
    flatness: float = FLATNESS
    accents: float = 1.0

    def contours(self, prosody: pd.DataFrame, times_s: Floats) -> tuple[Floats, Floats]:
        """Return pitch in semitones re the speaker's base, and intensity in decibels re full scale, at ``times_s``.

        Both have shape (T,), change abruptly from syllable to syllable, and are NaN in pauses.
        """
        pitch_st, intensity_db = phrase_contours(prosody, times_s)
        widened = arousal.effect(self.spoken, arousal.PITCH_RANGE, times_s)
        pitch_st = LOWEST_ST + widened * (self.flatness * pitch_st - LOWEST_ST)
        intensity_db = LEVEL_DB - HEADROOM_DB + self.flatness * (intensity_db - LEVEL_DB)
        intensity_db += arousal.effect(self.spoken, arousal.LOUDNESS_DB, times_s)
        if len(self.syllables):
            start_s, end_s = (self.syllables[name].to_numpy() for name in ("start_s", "end_s"))
            row = np.clip(np.searchsorted(start_s, times_s, side="right") - 1, 0, len(start_s) - 1)
            share = np.clip((times_s - start_s[row]) / (end_s[row] - start_s[row]), 0.0, 1.0)
            pitch_st += self.accents * self._of_level("inflection", INFLECTION_ST)[row] * (share - 0.5)
            intensity_db += self.accents * self._of_level("loudness", LOUDNESS_DB)[row]
            from_peak = np.where(share < PEAK, 1.0 - share / PEAK, (share - PEAK) / (1.0 - PEAK))
            intensity_db -= TROUGH_DB * np.sin(0.5 * np.pi * from_peak) ** 2
        return pitch_st, intensity_db

    def _of_level(self, feature: str, values: tuple[float, ...]) -> Floats:
        levels = self.syllables[feature].map(dict(zip(FEATURES[feature], values, strict=True)))
        return np.asarray(levels, dtype=np.float64)
