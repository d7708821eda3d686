"""The discrete observations of syllables, relative to statistics of the speech (Levine 2009, 3.4 and table 3.1).

An observation combines four features of a syllable:

- inflection up, inflection down: whether the largest rise and the largest fall of the pitch within the syllable are
  at least a standard deviation above their means. The thesis defines both by one pitch change, which could not be up
  and down at once; they are measured separately here.
- intensity: silence, standard, or high, which is at least half a standard deviation above the mean. (So says the text
  of 3.4; table 3.1 prints one whole deviation.)
- length: short (at least half a standard deviation below the mean), medium, or long (at least one above it).

Of the 36 combinations, 26 can occur: silence has no inflection and is never long. A long silence is divided into
pieces of medium length, as in the thesis: here, of the mean length of a syllable. A gap between two syllables that is
as short as the closure of a stop is not a silence. If it were one, observations would come in pairs, and what a
syllable says would often be one observation too early for the subunit that follows.

Means and deviations are those of the record in training, and running ones in synthesis, which start from the
statistics of the training records.

A listener learns of a syllable at ``known_s``, and of a silence when the syllable after it is known. So that a long
silence is observed while it lasts, each piece is reported once the time that most syllables take to become known has
passed since its end. A syllable that has begun within it nevertheless counts from the end of the piece. In the
studio's world ``syllables``, waiting for 99 % of the syllables instead would make the hands stop 0.1 s later, and
lower the correlation of their speed with the recorded one from .15 to .13.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit
from cospeech.synthesis.live import frame_known

FEATURES = ("rise", "fall", "intensity", "length")
"""What is compared with its mean: rise and fall of the pitch in Hz, intensity in dB, length in s."""

SIZES = (2, 2, 3, 3)
"""Number of values of inflection up, inflection down, intensity and length."""

N_OBSERVATIONS = math.prod(SIZES)

SILENCE, STANDARD, HIGH = range(3)
SHORT, MEDIUM, LONG = range(3)

HIGH_INTENSITY, SHORT_LENGTH, LONG_LENGTH, INFLECTION = 0.5, -0.5, 1.0, 1.0
"""Thresholds in standard deviations from the mean."""

PRIOR_SYLLABLES = 10.0
"""Number of syllables that the statistics of the training records count for at the beginning of synthesis."""

KNOWN_SHARE = 0.6
"""Share of the syllables that are known when the waiting time for silences has passed since their start."""

LEAST_DEVIATION = 1e-6
"""Minimum of all standard deviations, for speech whose syllables are all the same."""

SHORTEST_SILENCE_S = 0.1
"""A shorter gap between two syllables is not a silence: it is the closure of a stop, not a pause between words."""


def index(up: int, down: int, intensity: int, length: int) -> int:
    """Return the number of an observation, 0 ... 35."""
    return ((up * SIZES[1] + down) * SIZES[2] + intensity) * SIZES[3] + length


_index = njit(index)


def features(observation: int) -> tuple[int, int, int, int]:
    """Return the values of inflection up, inflection down, intensity and length of an observation."""
    up, down, intensity, length = (int(value) for value in np.unravel_index(observation, SIZES))
    return up, down, intensity, length


def can_occur(observation: int) -> bool:
    """Return whether an observation is possible."""
    up, down, intensity, length = features(observation)
    return intensity != SILENCE or (up == down == 0 and length != LONG)


OCCURRING = tuple(observation for observation in range(N_OBSERVATIONS) if can_occur(observation))
"""The 26 observations that can occur."""


class Observed(NamedTuple):
    """An observation: its number, its start and end, and the time at which it is known, in seconds."""

    observation: int
    start_s: float
    end_s: float
    known_s: float


Measured = tuple[float, float, float, float]
"""The ``FEATURES`` of a syllable, with NaN for the pitch of an unvoiced one."""


@njit
def _add(moments: Floats, rise: float, fall: float, intensity: float, length: float) -> None:
    """Add a syllable to the moments (4, 4): mean, deviation, weight and sum of squared deviations of each feature."""
    mean, deviation, weight, squares = moments[0], moments[1], moments[2], moments[3]
    for feature, value in enumerate((rise, fall, intensity, length)):
        if not np.isnan(value):
            off = value - mean[feature]
            weight[feature] += 1.0
            mean[feature] += off / weight[feature]
            squares[feature] += off * (value - mean[feature])
            deviation[feature] = max(np.sqrt(squares[feature] / weight[feature]), LEAST_DEVIATION)


@njit
def _observation(moments: Floats, rise: float, fall: float, intensity: float, length: float) -> int:
    """Return the observation of a syllable, relative to the moments (see ``_add``)."""
    mean, deviation = moments[0], moments[1]
    off = (length - mean[3]) / deviation[3]
    return _index(
        int(rise - mean[0] >= INFLECTION * deviation[0]),  # false for NaN
        int(fall - mean[1] >= INFLECTION * deviation[1]),
        HIGH if intensity - mean[2] >= HIGH_INTENSITY * deviation[2] else STANDARD,
        LONG if off >= LONG_LENGTH else SHORT if off <= SHORT_LENGTH else MEDIUM,
    )


class Statistics:
    """Means and standard deviations of ``FEATURES``, updated syllable by syllable (Welford's method).

    Unvoiced syllables have no pitch and do not change the statistics of rise and fall.

    Parameters
    ----------
    mean, deviation : statistics to begin with.
    weight : number of syllables that they count for.
    """

    def __init__(self, mean: Iterable[float], deviation: Iterable[float], weight: float) -> None:
        self._moments = np.empty((4, len(FEATURES)))
        self.mean, self.deviation, weights, squares = self._moments
        self.mean[:] = list(mean)
        self.deviation[:] = np.maximum(list(deviation), LEAST_DEVIATION)
        weights[:] = weight
        squares[:] = weight * self.deviation**2

    def add(self, values: Measured) -> None:
        """Add a syllable; NaN values are left out."""
        _add(self._moments, *values)

    def observation(self, values: Measured) -> int:
        """Return the observation of a syllable."""
        return int(_observation(self._moments, *values))

    @property
    def piece_s(self) -> float:
        """The length of the pieces of a long silence."""
        return max(float(self.mean[3]), SHORTEST_SILENCE_S)

    def silence(self, length_s: float) -> int:
        """Return the observation of a silence that is not long."""
        short = length_s <= self.mean[3] + SHORT_LENGTH * self.deviation[3]
        return index(0, 0, SILENCE, SHORT if short else MEDIUM)


def measured(syllable: Mapping[str, float]) -> Measured:
    """Return the ``FEATURES`` of a syllable."""
    length_s = syllable["end_s"] - syllable["start_s"]
    return syllable["f0_rise_hz"], syllable["f0_fall_hz"], syllable["intensity_db"], length_s


def statistics_of(syllables: Iterable[pd.DataFrame]) -> tuple[Floats, Floats]:
    """Return the means and the standard deviations of syllables, (4,) each.

    They are 0 and 1 for a feature without values.

    Parameters
    ----------
    syllables : tables of schema ``syllables``.
    """
    columns = [
        np.column_stack([table[["f0_rise_hz", "f0_fall_hz", "intensity_db"]], table["end_s"] - table["start_s"]])
        for table in syllables
    ]
    values = np.concatenate([np.empty((0, len(FEATURES))), *columns]).astype(np.float64)
    mean, deviation = np.zeros(len(FEATURES)), np.ones(len(FEATURES))
    for feature, column in enumerate(values.T):
        known = column[~np.isnan(column)]
        if len(known):
            mean[feature], deviation[feature] = known.mean(), max(float(known.std()), LEAST_DEVIATION)
    return mean, deviation


def waiting_time_s(syllables: Iterable[pd.DataFrame]) -> float:
    """Return the time from the start of a syllable until it is known, for ``KNOWN_SHARE``; 1 s without any."""
    delays = np.concatenate([np.empty(0), *((table["known_s"] - table["start_s"]) for table in syllables)])
    return float(np.quantile(delays, KNOWN_SHARE)) if len(delays) else 1.0


class Listener:
    """Turns syllables, as they become known, into observations of syllables and silences.

    Parameters
    ----------
    statistics : statistics of the speech.
    wait_s : how long a silence is in doubt (see ``waiting_time_s``).
    running : whether the statistics follow the syllables.
    """

    def __init__(self, statistics: Statistics, wait_s: float, running: bool = True) -> None:
        self.statistics = statistics
        self._wait_s = wait_s
        self._running = running
        self._end_s = 0.0

    def hear(self, time_s: float, syllables: Sequence[Mapping[str, float]]) -> list[Observed]:
        """Return the observations that become known by ``time_s``.

        Parameters
        ----------
        time_s : the time until which the speech has been heard.
        syllables : those that have become known since the last call, rows of a table of schema ``syllables``.
        """
        found: list[Observed] = []
        for syllable in syllables:
            values = measured(syllable)
            if self._running:
                self.statistics.add(values)
            self._silence(syllable["start_s"], time_s, found)
            start_s, end_s = max(syllable["start_s"], self._end_s), max(syllable["end_s"], self._end_s)
            found.append(Observed(self.statistics.observation(values), start_s, end_s, time_s))
            self._end_s = end_s
        if time_s - self._wait_s > self._end_s:
            piece_s = self.statistics.piece_s
            while self._end_s + piece_s + self._wait_s <= time_s:
                self._silence(self._end_s + piece_s, time_s, found)
        return found

    def _silence(self, until_s: float, time_s: float, found: list[Observed]) -> None:
        """Append the pieces of the silence that ends at ``until_s``."""
        while until_s - self._end_s > SHORTEST_SILENCE_S - 1e-6:  # a piece may be as short
            end_s = min(until_s, self._end_s + self.statistics.piece_s)
            found.append(Observed(self.statistics.silence(end_s - self._end_s), self._end_s, end_s, time_s))
            self._end_s = end_s


def observe(syllables: pd.DataFrame, duration_s: float, frame_s: float, wait_s: float) -> list[Observed]:
    """Return the observations of a training record, relative to the statistics of the record itself.

    Parameters
    ----------
    syllables : table of schema ``syllables``.
    duration_s : length of the record.
    frame_s : length of a prosody frame; new observations are made at the end of each.
    wait_s : see ``waiting_time_s``.
    """
    listener = Listener(Statistics(*statistics_of([syllables]), 1.0), wait_s, running=False)
    rows: list[dict[str, float]] = syllables.drop(columns=["record"]).to_dict("records")  # type: ignore[assignment]
    known = frame_known(syllables["known_s"].to_numpy(dtype=float), frame_s)
    n_frames = max(round(duration_s / frame_s), int(known.max(initial=-1)) + 1)
    found: list[Observed] = []
    first = 0
    for frame, last in enumerate(np.searchsorted(known, np.arange(n_frames), side="right").tolist()):
        found += listener.hear((frame + 1) * frame_s, rows[first:last])
        first = last
    return found
