"""D: how far the boundaries of one sequence lie from those of another, and how many of them are found.

Boundaries are the start times of phrases in seconds, in rising order. What the phrases are called plays no part.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats

SLACK_S = 1e-9
"""Boundaries lie on a frame grid, so that a distance may equal the tolerance but for rounding."""


def nearest_distances_s(synthesised_s: npt.ArrayLike, actual_s: npt.ArrayLike) -> Floats:
    """Return the distance of every synthesised boundary to the nearest actual one, shape (n_synthesised,).

    Parameters
    ----------
    synthesised_s : (n_synthesised,) boundaries.
    actual_s : (n_actual,) boundaries, at least one.
    """
    found, true = np.asarray(synthesised_s, dtype=float), np.asarray(actual_s, dtype=float)
    after = np.searchsorted(true, found)
    before = np.clip(after - 1, 0, len(true) - 1)
    after = np.clip(after, 0, len(true) - 1)
    return np.minimum(np.abs(found - true[before]), np.abs(found - true[after]))


def distance_s(synthesised_s: npt.ArrayLike, actual_s: npt.ArrayLike) -> float:
    """Return D, the mean distance of the synthesised boundaries to the nearest actual one (Özkul 2012, eq. 7.2).

    NaN where one of the sequences has no boundary.
    """
    if np.size(synthesised_s) == 0 or np.size(actual_s) == 0:
        return math.nan
    return float(nearest_distances_s(synthesised_s, actual_s).mean())


def matches(synthesised_s: npt.ArrayLike, actual_s: npt.ArrayLike, tolerance_s: float) -> int:
    """Return how many boundaries can be paired, each with one at most, no pair further apart than the tolerance.

    Walking both sequences in time and pairing the first two that can be paired is maximal: the boundary that is
    passed over is too early for every later one.
    """
    found, true = np.asarray(synthesised_s, dtype=float), np.asarray(actual_s, dtype=float)
    i = j = pairs = 0
    while i < len(found) and j < len(true):
        if abs(found[i] - true[j]) <= tolerance_s + SLACK_S:
            pairs, i, j = pairs + 1, i + 1, j + 1
        elif found[i] < true[j]:
            i += 1
        else:
            j += 1
    return pairs


def boundary_f1(synthesised_s: npt.ArrayLike, actual_s: npt.ArrayLike, tolerance_s: float) -> float:
    """Return the harmonic mean of the shares of synthesised and of actual boundaries that are paired.

    NaN where neither sequence has a boundary.
    """
    n_boundaries = np.size(synthesised_s) + np.size(actual_s)
    if n_boundaries == 0:
        return math.nan
    return 2 * matches(synthesised_s, actual_s, tolerance_s) / n_boundaries
