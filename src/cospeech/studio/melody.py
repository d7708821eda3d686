"""The melody: pitch and intensity that the prosody patterns ask of a speaker, moment by moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.segments import at_times, frame_times
from cospeech.studio.patterns import PATTERNS, contour

LEVEL_DB = -31.0
"""Intensity of a pattern at 0 dB, in decibels below full scale."""
ROOM_DB = -60.0
"""Noise of the room."""
STEP_S = 0.001
"""Grid of a plan."""
GLIDE_S = 0.04
"""How long pitch and intensity take from one phrase to the next."""


@dataclass(frozen=True)
class Plan:
    """What is planted in one record on the grid of ``STEP_S``: pitch in Hz and intensity in dB, NaN in pauses."""

    times_s: Floats
    pitch_hz: Floats
    intensity_db: Floats

    def pitch_at(self, times_s: Floats) -> Floats:
        """Return the planted pitch in Hz at ``times_s``."""
        return np.interp(times_s, self.times_s, self.pitch_hz)

    def intensity_at(self, times_s: Floats) -> Floats:
        """Return the planted intensity in decibels re full scale at ``times_s``."""
        return np.interp(times_s, self.times_s, self.intensity_db)

    def part(self, start_s: float, end_s: float) -> Plan:
        """Return the plan of one stretch of speech."""
        here = (self.times_s >= start_s) & (self.times_s < end_s)
        return Plan(self.times_s[here], self.pitch_hz[here], self.intensity_db[here])


def plan(prosody: pd.DataFrame, base_hz: float) -> Plan:
    """Return what is to be planted in a record whose speaker has this base pitch.

    From one phrase to the next pitch and intensity glide within a few hundredths of a second, as a voice does.
    """
    times_s = frame_times(round(float(prosody["end_s"].iloc[-1]) / STEP_S), 1.0 / STEP_S)
    pitch_st, intensity_db = phrase_contours(prosody, times_s)
    return Plan(times_s, base_hz * 2.0 ** (_glide(pitch_st) / 12.0), _glide(intensity_db))


def phrase_contours(prosody: pd.DataFrame, times_s: Floats) -> tuple[Floats, Floats]:
    """Return pitch in semitones from the speaker's base and intensity in decibels re full scale at ``times_s``.

    Both have shape (T,), step from phrase to phrase, and are NaN in pauses.
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


def _glide(values: Floats) -> Floats:
    """Return a Hann-weighted running mean over ``GLIDE_S`` that does not reach across gaps (NaN)."""
    window = np.hanning(round(GLIDE_S / STEP_S) + 3)[1:-1]
    known = ~np.isnan(values)
    weight = np.convolve(known, window, mode="same")
    total = np.convolve(np.where(known, values, 0.0), window, mode="same")
    return np.where(known, total / np.where(known, weight, 1.0), np.nan)
