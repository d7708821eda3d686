"""Clusters of prosody: a mixture of Gaussians whose F0 may be unknown (Levine et al. 2010, 5.2 and 6.2).

The paper represents the F0 of an unvoiced syllable as a uniformly distributed random variable, which is integrated
out here: with U the uniform density over a stated range, the density of an unvoiced syllable in cluster k is

    integral over f of U(f) N((x, f); mu_k, Sigma_k),

and EM treats f as a hidden variable, so that the likelihood still rises. Over a range that is wide compared with the
clusters, this is the density of the other features alone, divided by the width of the range.

Clusters are of the prosody at single time steps. The input window of the CRF consists of lagged copies of
P(x in C_k), because clusters of the whole window do not reproduce the slight rise of figure 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov.gaussian_hmm import floored_covariance
from cospeech.synthesis.controller import clusters_kernels

LEAST_WEIGHT = 1e-3
"""Clusters with fewer expected frames keep their parameters in the M-step."""


class Range(NamedTuple):
    """The range of the F0 of unvoiced syllables, in the unit of the F0 feature."""

    low: float
    high: float


class Clusters(NamedTuple):
    """``weight`` (K,), ``mean`` (K, D) and ``covariance`` (K, D, D); F0 is the last feature, NaN where unvoiced."""

    weight: Floats
    mean: Floats
    covariance: Floats


class Fit(NamedTuple):
    """Trained clusters, and the log-likelihoods (iterations + 1,) during training."""

    clusters: Clusters
    log_likelihoods: Floats


def log_densities(frames: Floats, mean: Floats, covariance: Floats, f0: Range) -> Floats:
    """Return the log density of frames (T, D) in each cluster, (T, K), with an unknown F0 integrated out."""
    return _log_densities(frames, mean, _factors(covariance), f0)


def _factors(covariance: Floats) -> Floats:
    """Return the lower Cholesky factors of covariances (K, D, D)."""
    return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)


def _log_densities(frames: Floats, mean: Floats, factors: Floats, f0: Range) -> Floats:
    scores = np.empty((len(frames), len(mean)))
    clusters_kernels.log_densities(np.ascontiguousarray(frames), mean, factors, f0.low, f0.high, scores)
    return scores


class Memberships:
    """Computes P(x_t in C_k), for clusters whose covariances need to be factored only once.

    Attributes
    ----------
    factors : (K, D, D) lower Cholesky factors of the covariances.
    weights : (K,) logarithms of the weights of the clusters.
    """

    def __init__(self, clusters: Clusters, f0: Range) -> None:
        self._clusters, self._f0 = clusters, f0
        self.factors = _factors(clusters.covariance)
        self.weights = np.log(clusters.weight)

    def of(self, frames: Floats) -> Floats:
        """Return P(x_t in C_k), (T, K), of frames (T, D)."""
        return self.and_likelihood(frames)[0]

    def and_likelihood(self, frames: Floats) -> tuple[Floats, float]:
        """Return P(x_t in C_k) and the log-likelihood of the frames."""
        scores = _log_densities(frames, self._clusters.mean, self.factors, self._f0)
        probabilities = np.empty_like(scores)
        return probabilities, clusters_kernels.shares(scores, self.weights, probabilities)


def memberships(clusters: Clusters, frames: Floats, f0: Range) -> Floats:
    """Return P(x_t in C_k), (T, K), of frames (T, D)."""
    return Memberships(clusters, f0).of(frames)


def weighted_gaussians(
    frames: Floats, weights: Floats, mean: Floats, covariance: Floats, f0: Range, floor: Floats
) -> tuple[Floats, Floats]:
    """Return the means and covariances that maximise the expected log density of frames with ``weights`` (T, K).

    An unknown F0 is distributed as the previous ``mean`` and ``covariance`` say. Gaussians without frames stay.
    """
    pivot = mean.mean(axis=0)
    first, second = np.zeros_like(mean), np.zeros_like(covariance)
    factors = np.linalg.cholesky(covariance)
    clusters_kernels.add_moments(
        np.ascontiguousarray(frames), weights, pivot, mean, factors, f0.low, f0.high, first, second
    )
    occupied = weights.sum(axis=0)
    seen = occupied > LEAST_WEIGHT
    count = np.where(seen, occupied, 1.0)
    shift = first / count[:, None]
    moment = second / count[:, None, None] - shift[:, :, None] * shift[:, None, :]
    return (
        np.where(seen[:, None], pivot + shift, mean),
        np.where(seen[:, None, None], floored_covariance(moment, floor), covariance),
    )


def fit(frames: Floats, n_clusters: int, f0: Range, floor: Floats, iterations: int, rng: np.random.Generator) -> Fit:
    """Find the clusters by EM.

    Parameters
    ----------
    frames : (T, D) prosody at single time steps; F0 is the last feature.
    f0 : range of the F0 of unvoiced syllables.
    floor : (D,) minimum variances.

    Raises
    ------
    UserError : if there are fewer frames than clusters, or none of them is voiced.
    """
    voiced = ~np.isnan(frames[:, -1])
    if len(frames) < n_clusters:
        raise UserError(f"{len(frames)} time steps of speech are too few for {n_clusters} clusters of prosody")
    if not voiced.any():
        raise UserError("no syllable of the speech is voiced; check the sound and its pitch range")

    typical = frames[voiced, -1].mean()
    filled = frames.copy()
    filled[~voiced, -1] = typical
    scale = np.maximum(filled.var(axis=0), floor)
    mean = filled[rng.choice(len(filled), n_clusters, replace=False)]
    clusters = Clusters(np.full(n_clusters, 1.0 / n_clusters), mean, np.tile(np.diag(scale), (n_clusters, 1, 1)))
    history = []
    for _ in range(iterations):
        shares, total = Memberships(clusters, f0).and_likelihood(frames)
        history.append(total)
        weight = np.maximum(shares.mean(axis=0), np.finfo(float).tiny)
        clusters = Clusters(
            weight, *weighted_gaussians(frames, shares, clusters.mean, clusters.covariance, f0, floor)
        )
    history.append(Memberships(clusters, f0).and_likelihood(frames)[1])
    return Fit(clusters, np.array(history))


def windows(sequences: Sequence[Floats], length: int) -> list[Floats]:
    """Return the features of the last ``length`` time steps next to one another, (T, length * K), the latest first.

    Before the start of a sequence (T, K), its first step is repeated.
    """
    return [
        np.concatenate([values[np.maximum(np.arange(len(values)) - lag, 0)] for lag in range(length)], axis=1)
        for values in sequences
    ]
