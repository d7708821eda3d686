"""Agreement of two sequences in the boundaries of their segments: distance (D), matches and F1.

Boundaries are the start times of segments in ascending order. The labels of the segments are not considered.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats

SLACK_S = 1e-9
"""Added to the tolerance: on a frame grid a distance may equal the tolerance except for rounding."""


def nearest_distances(synthesised: npt.ArrayLike, actual: npt.ArrayLike) -> Floats:
    """Return the distance of every synthesised boundary to the nearest actual one, (n_synthesised,).

    Parameters
    ----------
    synthesised, actual : (n_synthesised,) and (n_actual,) boundaries in the same unit, which is that of the result.
        There must be at least one actual boundary.
    """
    found, true = np.asarray(synthesised, dtype=float), np.asarray(actual, dtype=float)
    after = np.searchsorted(true, found)
    before = np.clip(after - 1, 0, len(true) - 1)
    after = np.clip(after, 0, len(true) - 1)
    return np.minimum(np.abs(found - true[before]), np.abs(found - true[after]))


def distance(synthesised: npt.ArrayLike, actual: npt.ArrayLike) -> float:
    """Return D, the mean distance of the synthesised boundaries to the nearest actual one (Özkul 2012, eq. 7.2).

    The result is in the unit of the boundaries. It is NaN if one of the sequences has no boundary.
    """
    if np.size(synthesised) == 0 or np.size(actual) == 0:
        return math.nan
    return float(nearest_distances(synthesised, actual).mean())


def matches(synthesised_s: npt.ArrayLike, actual_s: npt.ArrayLike, tolerance_s: float) -> int:
    """Return the size of the largest one-to-one matching of boundaries that are at most ``tolerance_s`` apart.

    A greedy pass in time order finds it: a boundary that is skipped is too early for all later ones.

    Parameters
    ----------
    synthesised_s, actual_s : (n_synthesised,) and (n_actual,) boundaries in seconds.
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
    """Return the harmonic mean of precision and recall of the boundaries matched within ``tolerance_s``.

    It is NaN if neither sequence has a boundary. Parameters are those of ``matches``.
    """
    n_boundaries = np.size(synthesised_s) + np.size(actual_s)
    if n_boundaries == 0:
        return math.nan
    return 2 * matches(synthesised_s, actual_s, tolerance_s) / n_boundaries
