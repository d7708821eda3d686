"""Compiled densities and moments of prosody with an unknown F0; ``clusters`` is their interface.

F0 is the last feature. With the Cholesky factor L of a covariance, whose last row is (l, s), F0 given the other
features r has the mean m = mu + l . z, z = L_r^-1 (r - mu_r), and the standard deviation s.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

ROOT_TWO = math.sqrt(2.0)
LOG_ROOT_TWO_PI = 0.5 * math.log(2.0 * math.pi)


@njit
def _whiten(frame: Floats, mean: Floats, factor: Floats, n_features: int, z: Floats) -> float:
    """Write L^-1 (x - mu) of the first features to ``z``, and return their log density."""
    density = 0.0
    for d in range(n_features):
        x = frame[d] - mean[d]
        for e in range(d):
            x -= factor[d, e] * z[e]
        z[d] = x / factor[d, d]
        density -= 0.5 * z[d] * z[d] + math.log(factor[d, d]) + LOG_ROOT_TWO_PI
    return density


@njit
def _log_mass(low: float, high: float) -> float:
    """Return the logarithm of the standard normal probability of [low, high]."""
    if low + high < 0.0:
        low, high = -high, -low
    mass = 0.5 * (math.erfc(low / ROOT_TWO) - math.erfc(high / ROOT_TWO))
    if mass > 1e-300:
        return math.log(mass)
    return -0.5 * low * low - LOG_ROOT_TWO_PI - math.log(low)  # far in the tail


@njit
def log_densities(frames: Floats, means: Floats, factors: Floats, low: float, high: float, scores: Floats) -> None:
    """Write the log density of each frame for each cluster to ``scores``, (T, K).

    Parameters
    ----------
    frames : (T, D); the last feature is NaN where it is unknown and uniform in [low, high].
    means, factors : (K, D) and (K, D, D) lower Cholesky factors.
    """
    last = frames.shape[1] - 1
    z = np.empty(last + 1)
    for t in range(len(frames)):
        for k in range(len(means)):
            if not math.isnan(frames[t, last]):
                scores[t, k] = _whiten(frames[t], means[k], factors[k], last + 1, z)
                continue
            density = _whiten(frames[t], means[k], factors[k], last, z)
            mean, sd = means[k, last], factors[k, last, last]
            for e in range(last):
                mean += factors[k, last, e] * z[e]
            mass = _log_mass((low - mean) / sd, (high - mean) / sd)
            scores[t, k] = density + mass - math.log(high - low)


@njit
def _truncated(mean: float, sd: float, low: float, high: float) -> tuple[float, float]:
    """Return mean and variance of a normal distribution that is truncated to [low, high]."""
    a, b = (low - mean) / sd, (high - mean) / sd
    mass = _log_mass(a, b)
    at_a = math.exp(-0.5 * a * a - LOG_ROOT_TWO_PI - mass)
    at_b = math.exp(-0.5 * b * b - LOG_ROOT_TWO_PI - mass)
    shift = at_a - at_b
    variance = 1.0 + a * at_a - b * at_b - shift * shift
    return min(max(mean + sd * shift, low), high), max(variance, 0.0) * sd * sd


@njit
def add_moments(
    frames: Floats,
    weights: Floats,
    pivot: Floats,
    means: Floats,
    factors: Floats,
    low: float,
    high: float,
    first: Floats,
    second: Floats,
) -> None:
    """Add the expected moments of the frames, less ``pivot`` (D,), weighted by ``weights`` (T, K).

    An unknown F0 has the distribution of the cluster given the other features, truncated to [low, high].

    Parameters
    ----------
    first, second : (K, D) and (K, D, D), updated.
    """
    n_features = frames.shape[1]
    last = n_features - 1
    z, offset = np.empty(n_features), np.empty(n_features)
    for t in range(len(frames)):
        unknown = math.isnan(frames[t, last])
        for k in range(len(means)):
            weight, variance = weights[t, k], 0.0
            for d in range(n_features):
                offset[d] = frames[t, d] - pivot[d]
            if unknown:
                _whiten(frames[t], means[k], factors[k], last, z)
                mean = means[k, last]
                for e in range(last):
                    mean += factors[k, last, e] * z[e]
                expected, variance = _truncated(mean, factors[k, last, last], low, high)
                offset[last] = expected - pivot[last]
            for d in range(n_features):
                first[k, d] += weight * offset[d]
                for e in range(n_features):
                    second[k, d, e] += weight * offset[d] * offset[e]
            second[k, last, last] += weight * variance


@njit
def shares(scores: Floats, weights: Floats, probabilities: Floats) -> float:
    """Write the probabilities of the clusters, (T, K), and return the log-likelihood of the frames.

    Parameters
    ----------
    scores : (T, K) log density of each frame in each cluster.
    weights : (K,) logarithms of the weights of the clusters.
    """
    likelihood = 0.0
    for t in range(len(scores)):
        row = probabilities[t]
        top = -math.inf
        for k in range(len(weights)):
            row[k] = scores[t, k] + weights[k]
            top = max(top, row[k])
        total = 0.0
        for k in range(len(weights)):
            row[k] = math.exp(row[k] - top)
            total += row[k]
        for k in range(len(weights)):
            row[k] /= total
        likelihood += top + math.log(total)
    return likelihood
