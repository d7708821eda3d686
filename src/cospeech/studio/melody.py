"""The melody: target contours of pitch and intensity, given by the prosody patterns of the script."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.segments import at_times, frame_times
from cospeech.studio.patterns import PATTERNS, contour

LEVEL_DB = -31.0
"""Level of a pattern with 0 dB, in decibels re full scale."""
ROOM_DB = -60.0
"""Level of the room noise, in decibels re full scale."""
STEP_S = 0.001
"""Time step of a plan."""
GLIDE_S = 0.04
"""Duration of the transition of pitch and intensity from one phrase to the next."""


Contours = Callable[[pd.DataFrame, Floats], tuple[Floats, Floats]]
"""Function of the intonation phrases of a record and of times (T,) that returns pitch and intensity (T,) as
``phrase_contours`` does."""


@dataclass(frozen=True)
class Plan:
    """The target contours of one record with time step ``STEP_S``: pitch in Hz and intensity in dB, NaN in pauses."""

    times_s: Floats
    pitch_hz: Floats
    intensity_db: Floats

    def pitch_at(self, times_s: Floats) -> Floats:
        """Return the target pitch in Hz at ``times_s``."""
        return np.interp(times_s, self.times_s, self.pitch_hz)

    def intensity_at(self, times_s: Floats) -> Floats:
        """Return the target intensity in decibels re full scale at ``times_s``."""
        return np.interp(times_s, self.times_s, self.intensity_db)

    def within(self, lowest_hz: float, highest_hz: float) -> Plan:
        """Return the plan with its pitch limited to a range."""
        return Plan(self.times_s, np.clip(self.pitch_hz, lowest_hz, highest_hz), self.intensity_db)

    def part(self, start_s: float, end_s: float) -> Plan:
        """Return the plan between two times."""
        here = (self.times_s >= start_s) & (self.times_s < end_s)
        return Plan(self.times_s[here], self.pitch_hz[here], self.intensity_db[here])


def phrase_contours(prosody: pd.DataFrame, times_s: Floats) -> tuple[Floats, Floats]:
    """Return pitch in semitones re the speaker's base, and intensity in decibels re full scale, at ``times_s``.

    Both have shape (T,), change abruptly from phrase to phrase, and are NaN in pauses.
    """
    row = at_times(prosody, times_s)
    start_s, end_s = (prosody[name].to_numpy()[row] for name in ("start_s", "end_s"))
    u = (times_s - start_s) / (end_s - start_s)
    labels = prosody["label"].to_numpy(dtype=object)[row]
    pitch_st, intensity_db = np.full(len(row), np.nan), np.full(len(row), np.nan)
    for pattern in PATTERNS:
        if pattern.speaks:
            here = labels == pattern.name
            pitch_st[here] = contour(pattern.pitch_st, u[here])
            intensity_db[here] = LEVEL_DB + contour(pattern.intensity_db, u[here])
    return pitch_st, intensity_db


def plan(prosody: pd.DataFrame, base_hz: float, contours: Contours = phrase_contours) -> Plan:
    """Return the target contours of a record for a speaker with the base pitch ``base_hz``.

    Pitch and intensity change smoothly from one phrase or syllable to the next within a few hundredths of a second.
    """
    times_s = frame_times(round(float(prosody["end_s"].iloc[-1]) / STEP_S), 1.0 / STEP_S)
    pitch_st, intensity_db = contours(prosody, times_s)
    return Plan(times_s, base_hz * 2.0 ** (_glide(pitch_st) / 12.0), _glide(intensity_db))


def _glide(values: Floats) -> Floats:
    """Return a Hann-weighted running mean over ``GLIDE_S`` that ignores gaps (NaN)."""
    window = np.hanning(round(GLIDE_S / STEP_S) + 3)[1:-1]
    known = ~np.isnan(values)
    weight = np.convolve(known, window, mode="same")
    total = np.convolve(np.where(known, values, 0.0), window, mode="same")
    return np.where(known, total / np.where(known, weight, 1.0), np.nan)
