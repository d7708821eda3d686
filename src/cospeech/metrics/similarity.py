"""S: how alike the phrase durations of two sequences are (Özkul 2012, eq. 7.1)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats

Counts = npt.NDArray[np.int64]


def duration_histograms(
    durations_s: npt.ArrayLike, labels: npt.ArrayLike, n_labels: int, bin_s: float, max_duration_s: float
) -> Counts:
    """Count the durations of each label in bins of equal width: bin k, from 1, holds ((k - 1) * bin_s, k * bin_s].

    Parameters
    ----------
    durations_s : (n,) durations in seconds, all positive.
    labels : (n,) label of each, 0 to n_labels - 1.
    bin_s : width of a bin.
    max_duration_s : D_max; the last bin ends there, and holds whatever is longer too.

    Returns
    -------
    (n_labels, K) counts, K = D_max / bin_s rounded up.
    """
    n_bins = max(1, math.ceil(max_duration_s / bin_s - 1e-6))
    # A duration is a whole number of frames, so it may lie on an edge: the slack keeps it on the right side.
    bins = np.ceil(np.asarray(durations_s, dtype=float) / bin_s - 1e-6).astype(np.int64) - 1
    cells = np.asarray(labels, dtype=np.int64) * n_bins + np.minimum(bins, n_bins - 1)
    return np.bincount(cells, minlength=n_labels * n_bins).reshape(n_labels, n_bins)


def similarities(actual: npt.ArrayLike, synthesised: npt.ArrayLike) -> Floats:
    """Return the cosine of each two histograms, in [0, 1] (eq. 7.1).

    Counts serve as well as the probabilities of the equation, since the cosine does not see their scale. Where both
    histograms are empty the value is undefined, NaN; where one is, it is 0.

    Parameters
    ----------
    actual, synthesised : (..., K) histograms.
    """
    p, q = np.asarray(actual, dtype=float), np.asarray(synthesised, dtype=float)
    product = np.sqrt((p * p).sum(axis=-1) * (q * q).sum(axis=-1))
    cosine = (p * q).sum(axis=-1) / np.where(product > 0, product, 1.0)
    both_empty = ~p.any(axis=-1) & ~q.any(axis=-1)
    return np.where(both_empty, np.nan, np.minimum(cosine, 1.0))
