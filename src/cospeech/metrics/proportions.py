"""Intervals of proportions, and how detections match events."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from cospeech.data.arrays import Flags, Floats


def wilson(found: int, number: int, level: float) -> tuple[float, float]:
    """Return the interval of Wilson (1927) of a proportion, ``found`` of ``number``; NaN if ``number`` is 0.

    Parameters
    ----------
    level : confidence level, 0 to 1.
    """
    if number == 0:
        return np.nan, np.nan
    z = float(ndtri(0.5 + level / 2.0))
    share = found / number
    centre = (share + z**2 / (2 * number)) / (1.0 + z**2 / number)
    half = z * np.sqrt(share * (1.0 - share) / number + z**2 / (4 * number**2)) / (1.0 + z**2 / number)
    return max(0.0, centre - half), min(1.0, centre + half)


def overlaps(one: Floats, others: Floats) -> Floats:
    """Return the time in seconds that each interval of one set shares with each of another, (n, m).

    Parameters
    ----------
    one, others : (n, 2) and (m, 2) starts and ends in seconds.
    """
    start = np.maximum(one[:, None, 0], others[None, :, 0])
    end = np.minimum(one[:, None, 1], others[None, :, 1])
    return np.maximum(end - start, 0.0)


def partners(one: Floats, others: Floats) -> tuple[Flags, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Return which intervals overlap one of another set, (n,), and the one with which they share most time, (n,).

    The partner of an interval without overlap means nothing. Parameters as in ``overlaps``.
    """
    if not len(others):
        return np.zeros(len(one), dtype=bool), np.zeros(len(one), dtype=np.int64)
    shared = overlaps(one, others)
    return shared.max(axis=1) > 0.0, shared.argmax(axis=1).astype(np.int64)
