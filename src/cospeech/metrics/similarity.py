"""S, the similarity of the segment durations of two sequences (Özkul 2012, eq. 7.1)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats

Counts = npt.NDArray[np.int64]


def duration_histograms(
    durations_s: npt.ArrayLike, labels: npt.ArrayLike, n_labels: int, bin_s: float, max_duration_s: float
) -> Counts:
    """Count the durations of each label in bins of equal width.

    Bin k, counted from 1, covers durations in ((k - 1) * bin_s, k * bin_s].

    Parameters
    ----------
    durations_s : (n,) durations in seconds, all positive.
    labels : (n,) label of each duration, 0 to n_labels - 1.
    bin_s : width of a bin.
    max_duration_s : D_max, where the last bin ends. Longer durations are counted in it as well.

    Returns
    -------
    (n_labels, K) counts, with K = D_max / bin_s rounded up.
    """
    n_bins = max(1, math.ceil(max_duration_s / bin_s - 1e-6))
    # Durations are whole numbers of frames and may be on an edge: the slack keeps them on its lower side.
    bins = np.ceil(np.asarray(durations_s, dtype=float) / bin_s - 1e-6).astype(np.int64) - 1
    cells = np.asarray(labels, dtype=np.int64) * n_bins + np.minimum(bins, n_bins - 1)
    return np.bincount(cells, minlength=n_labels * n_bins).reshape(n_labels, n_bins)


def similarities(actual: npt.ArrayLike, synthesised: npt.ArrayLike) -> Floats:
    """Return the cosine similarity of pairs of histograms, (...) in [0, 1] (eq. 7.1).

    Counts can take the place of the probabilities of the equation, as the cosine does not depend on their scale. The
    similarity is undefined, NaN, if both histograms are empty, and 0 if one is.

    Parameters
    ----------
    actual, synthesised : (..., K) histograms.
    """
    p, q = np.asarray(actual, dtype=float), np.asarray(synthesised, dtype=float)
    product = np.sqrt((p * p).sum(axis=-1) * (q * q).sum(axis=-1))
    cosine = (p * q).sum(axis=-1) / np.where(product > 0, product, 1.0)
    both_empty = ~p.any(axis=-1) & ~q.any(axis=-1)
    return np.where(both_empty, np.nan, np.minimum(cosine, 1.0))
