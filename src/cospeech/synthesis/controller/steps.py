"""The time steps of the controller: prosody as it is known at each of them, and the kinematics shown in each.

The controller decides once per time step of a whole number of motion frames, 1/15 to 1/10 s. Step k begins at
``k * step_s``, and its decision uses what a live listener knows at that time:

- The prosody of a step is that of the latest syllable that is known then (``known_s``), which is usually known some
  140 ms after its peak. Training uses the same function as the live controller, so that the conditional random field
  learns from prosody with the delay with which it will hear it.
- Silence is a gap between syllables, and the papers do not say how their features represent it. Here, when no
  syllable has become known for ``PAUSE_S`` after the end of the latest one, the features are those of a pause: it is
  unvoiced, its length is the time since that end, up to ``LONGEST_S``, and its intensity is that of the quietest
  syllables of the training records.

The features are the mean intensity in dB, the logarithm of the length in s, and the mean F0 in Hz (Levine et al.
2010, 5.2), in the order of ``inference.PROSODY``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats, Integers

STEP_S = 0.08
"""Time step that is aimed at; it is rounded to a whole number of motion frames."""

PAUSE_S = 0.35
"""Time after the end of a syllable at which a pause is recognised; by then, a further one would mostly be known."""

LONGEST_S = 2.0
"""Pauses count as this long at most."""

QUIETEST_PERCENT = 1.0
"""Percentile of the intensities of the training syllables that a pause has."""

SLACK_S = 1e-9
"""Times are sums of rounded numbers; what is known this much later than a step is known at the step."""


class Syllable(NamedTuple):
    """The columns of a syllable that matter here; ``f0_hz`` is NaN if it is unvoiced."""

    known_s: float
    start_s: float
    end_s: float
    intensity_db: float
    f0_hz: float


class Listener:
    """The prosody of each time step, as far as it is known at its beginning.

    Parameters
    ----------
    pause_db : intensity of a pause.
    """

    def __init__(self, pause_db: float) -> None:
        self._pause_db = pause_db
        self._coming: list[Syllable] = []
        self._end_s = 0.0
        self._spoken = np.array([pause_db, math.log(LONGEST_S), math.nan])

    def hear(self, syllable: Syllable) -> None:
        """Note a syllable; syllables come in the order in which they become known."""
        self._coming.append(syllable)

    def at(self, time_s: float) -> Floats:
        """Return the prosody (3,) at a time; times must not decrease."""
        while self._coming and self._coming[0].known_s <= time_s + SLACK_S:
            latest = self._coming.pop(0)
            length_s = max(latest.end_s - latest.start_s, SLACK_S)
            self._spoken = np.array([latest.intensity_db, math.log(length_s), latest.f0_hz])
            self._end_s = latest.end_s
        silent_s = time_s - self._end_s
        if silent_s > PAUSE_S + SLACK_S:
            return np.array([self._pause_db, math.log(min(silent_s, LONGEST_S)), math.nan])
        return self._spoken


def syllables_of(table: pd.DataFrame) -> list[Syllable]:
    """Return the syllables of a table (schema ``syllables``) in the order in which they become known."""
    ordered = table.sort_values("known_s", kind="stable")
    return [Syllable(*row) for row in ordered[list(Syllable._fields)].itertuples(index=False)]


def pause_intensity(tables: Iterable[pd.DataFrame]) -> float:
    """Return the intensity in dB that a pause has, given the syllables of the training records."""
    known = np.concatenate([table["intensity_db"].to_numpy(dtype=float) for table in tables])
    return float(np.percentile(known, QUIETEST_PERCENT))


def prosody(syllables: Sequence[Syllable], n_steps: int, step_s: float, pause_db: float) -> Floats:
    """Return the prosody of the time steps of a record, (T, 3), by a ``Listener``."""
    listener = Listener(pause_db)
    for syllable in syllables:
        listener.hear(syllable)
    return np.array([listener.at(step * step_s) for step in range(n_steps)]).reshape(n_steps, 3)


def frames_per_step(fps: float) -> int:
    """Return the number of motion frames of a time step."""
    return max(1, round(STEP_S * fps))


class Grid(NamedTuple):
    """Segments whose boundaries have been moved to time steps.

    Attributes
    ----------
    start, end : (n,) first step of each segment, and first step after it.
    kept : (N,) whether each of the original segments is among them.
    """

    start: Integers
    end: Integers
    kept: Flags


def on_grid(starts: Integers, ends: Integers, n_frames: int, per_step: int) -> Grid:
    """Return the segments of a record with their boundaries moved to the nearest time steps.

    Segments that are shorter than a step and fall between two boundaries are left out. Segments that fill the record
    still do so, except for the frames after its last whole step.

    Parameters
    ----------
    starts, ends : (N,) first motion frames, and first frames after the segments.
    n_frames : length of the record in motion frames.
    per_step : motion frames per time step.
    """
    n_steps = n_frames // per_step
    first, after = (np.minimum((2 * edges + per_step) // (2 * per_step), n_steps) for edges in (starts, ends))
    after = np.where(ends == n_frames, n_steps, after)
    kept = after > first
    return Grid(first[kept], after[kept], kept)
