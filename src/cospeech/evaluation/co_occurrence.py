"""Which events of speech coincide with gestures, against gestures at other times (Sargin 2006, 3.4).

The document reports the share of accents that overlap a gesture, and the correlation r = 0.994 of the times of those
that do. The correlation is automatic: times over many minutes are compared that differ by less than a gesture's
duration, as overlapping is how the pairs were chosen. Therefore everything is repeated with all gestures shifted
circularly over the corpus: they keep their durations and intervals, and lose their relation to speech. What does tell
is an overlap beyond that of the shifted gestures, and a small spread of the differences of onsets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.metrics import proportions

MEASURES = ("overlap", "gesture_overlap", "start_r", "end_r", "onset_mean_s", "onset_sd_s")

LEAST_SHIFT_S = 5.0
"""Smallest distance of a shift from no shift."""


class Settings(NamedTuple):
    """Number of circular shifts, and confidence level of intervals and quantiles."""

    shifts: int
    level: float


def measures(events: Floats, gestures: Floats) -> Floats:
    """Return the ``MEASURES`` (6,); those of pairs are NaN where fewer than two events overlap a gesture.

    Parameters
    ----------
    events, gestures : (n, 2) and (m, 2) starts and ends in seconds.
    """
    shared = proportions.overlaps(events, gestures)
    overlapping = np.asarray((shared > 0.0).any(axis=1))
    partnered = np.asarray((shared > 0.0).any(axis=0))
    shares = [float(chosen.mean()) if chosen.size else np.nan for chosen in (overlapping, partnered)]
    if np.count_nonzero(overlapping) < 2:
        return np.array([*shares, *[np.nan] * 4])
    one, other = events[overlapping], gestures[shared[overlapping].argmax(axis=1)]
    correlations = [_correlation(one[:, end], other[:, end]) for end in (0, 1)]
    onsets = other[:, 0] - one[:, 0]
    return np.array([*shares, *correlations, onsets.mean(), onsets.std(ddof=1)])


def _correlation(one: Floats, other: Floats) -> float:
    """Return Pearson's correlation; NaN where either does not vary, as when all events overlap the same gesture."""
    if one.min() == one.max() or other.min() == other.max():
        return np.nan
    return float(np.corrcoef(one, other)[0, 1])


def shifted(gestures: Floats, by_s: float, duration_s: float) -> Floats:
    """Return gestures (m, 2) moved by a time; those that would cross the end of the corpus move on from its start."""
    start = (gestures[:, 0] + by_s) % duration_s
    return np.column_stack([start, start + gestures[:, 1] - gestures[:, 0]])


def table(
    speech: str, kind: str, events: Floats, gestures: Floats, duration_s: float, settings: Settings, seed: int
) -> pd.DataFrame:
    """Return the measures of events and gestures, and those of shifted gestures (schema ``co_occurrence``).

    Parameters
    ----------
    speech, kind : names of the events and of the gestures.
    events, gestures : (n, 2) and (m, 2) starts and ends in seconds, all records one after the other.
    duration_s : duration of all records together.
    """
    rng = random_source(seed, "co-occurrence", speech, kind)
    shifts = rng.uniform(LEAST_SHIFT_S, duration_s - LEAST_SHIFT_S, settings.shifts)
    actual = measures(events, gestures)
    null = np.array([measures(events, shifted(gestures, by_s, duration_s)) for by_s in shifts])
    hits = [int(np.count_nonzero(proportions.partners(*two)[0])) for two in ((events, gestures), (gestures, events))]
    numbers = [len(events), len(gestures)]
    ends = [proportions.wilson(found, number, settings.level) for found, number in zip(hits, numbers, strict=True)]
    tail = (1.0 - settings.level) / 2.0
    found = pd.DataFrame(
        {
            "speech": speech,
            "gestures": kind,
            "measure": MEASURES,
            "number": [*numbers, *[hits[0]] * 4],
            "value": actual,
            "low": [*(low for low, _ in ends), *[np.nan] * 4],
            "high": [*(high for _, high in ends), *[np.nan] * 4],
            "p_value": [(1 + np.count_nonzero(null[:, 0] >= actual[0])) / (1 + settings.shifts), *[np.nan] * 5],
        }
    )
    defined = [values[~np.isnan(values)] for values in null.T]
    found["chance"] = [values.mean() if values.size else np.nan for values in defined]
    for name, part in (("chance_low", tail), ("chance_high", 1.0 - tail)):
        found[name] = [np.quantile(values, part) if values.size else np.nan for values in defined]
    return found


def pairs(speech: str, kind: str, events: Floats, gestures: Floats, duration_s: float) -> pd.DataFrame:
    """Return the events that overlap a gesture, and one shifted by half of the corpus (schema
    ``co_occurrence_pairs``).

    Parameters as in ``table``.
    """
    found = []
    for is_shifted, own in ((False, gestures), (True, shifted(gestures, duration_s / 2.0, duration_s))):
        overlapping, partner = proportions.partners(events, own)
        found.append(
            pd.DataFrame(
                {
                    "speech": speech,
                    "gestures": kind,
                    "by_chance": is_shifted,
                    "event_start_s": events[overlapping, 0],
                    "gesture_start_s": own[partner[overlapping], 0] if len(own) else np.empty(0),
                }
            )
        )
    return pd.concat(found, ignore_index=True)


def on_one_clock(events: pd.DataFrame, records: pd.DataFrame) -> Floats:
    """Return starts and ends (n, 2) of events in seconds, all records one after the other.

    Parameters
    ----------
    events : record, start_s and end_s.
    records : record and its start_s.
    """
    offset = records.set_index("record")["start_s"].reindex(events["record"]).to_numpy()
    return np.asarray(events[["start_s", "end_s"]].to_numpy() + offset[:, None])
