"""Intervals of means over records, by drawing the records again with replacement."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, stdtrit

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source

Counts = npt.NDArray[np.float64]


def draws(strata: npt.ArrayLike, samples: int, seed: int, name: str) -> Counts:
    """Return how often each record is drawn in each bootstrap sample, shape (samples, R).

    Parameters
    ----------
    strata : (R,) the actor of each record; every sample holds as many records of each actor as there are, since
        the actors are those whom the corpus has and only further records of theirs are imagined.
    seed, name : the stream of random numbers; the same name draws the same samples.
    """
    stratum = np.asarray(strata)
    rng = random_source(seed, name)
    counts = np.zeros((samples, len(stratum)))
    for actor in sorted(set(stratum.tolist())):
        members = np.flatnonzero(stratum == actor)
        counts[:, members] = rng.multinomial(len(members), np.full(len(members), 1 / len(members)), size=samples)
    return counts


def ratios(numerators: Floats, denominators: Floats, counts: Counts) -> Floats:
    """Return the weighted mean of every group in every bootstrap sample, shape (G, samples).

    Parameters
    ----------
    numerators, denominators : (G, R) sums over the record's values of weight * value, and of weight.
    counts : (samples, R) from ``draws``.

    NaN where a sample holds no record with a defined value. The sums run in a fixed order, whatever the cores.
    """
    with np.errstate(invalid="ignore"):
        return np.einsum("gr,sr->gs", numerators, counts) / np.einsum("gr,sr->gs", denominators, counts)


def interval(
    samples: Floats, level: float, n_records: npt.ArrayLike, n_strata: npt.ArrayLike
) -> tuple[Floats, Floats]:
    """Return the ends of the percentile interval of every group, shapes (G,).

    With few records plain percentiles are too narrow: a sample's spread is that of n, not n - 1, and the normal
    tail is used for Student's. The percentiles are therefore moved outward so that they would give the t interval
    where the mean is normal (the expanded percentile interval of Hesterberg 2015, The American Statistician 69,
    section 5.1). They cannot move beyond the extremes of the records: with four, the interval is their range. Of
    normal values, intervals at 0.95 held the true mean in 0.87 of cases with 4 records, 0.93 with 2 actors of 4, and
    0.94 with 12 (plain percentiles: 0.78, 0.85, 0.91).

    Parameters
    ----------
    samples : (G, samples) means of the bootstrap samples; NaN ones are left out.
    level : share of such intervals that ought to hold the true mean.
    n_records, n_strata : (G,) records with a defined value, and actors among them.

    Returns
    -------
    Low and high; NaN where the records are too few to say anything (no more than the actors).
    """
    records = np.asarray(n_records, dtype=float)
    freedom = records - np.asarray(n_strata, dtype=float)
    low, high = np.full(len(samples), math.nan), np.full(len(samples), math.nan)
    for pair in sorted(set(zip(records.tolist(), freedom.tolist(), strict=True))):
        tail = expanded_tail(level, *pair)
        if math.isnan(tail):
            continue
        group = np.flatnonzero((records == pair[0]) & (freedom == pair[1]))
        low[group], high[group] = _quantiles(samples[group], [tail, 1 - tail])
    return low, high


def expanded_tail(level: float, n_records: float, freedom: float) -> float:
    """Return the share of bootstrap means to leave out on each side; NaN without a degree of freedom."""
    if freedom <= 0:
        return math.nan
    t = stdtrit(freedom, 0.5 + level / 2)
    return float(ndtr(-math.sqrt(n_records / freedom) * t))


def _quantiles(values: Floats, shares: list[float]) -> Floats:
    if np.isnan(values).any():
        return np.nanquantile(values, shares, axis=1)
    return np.quantile(values, shares, axis=1)
