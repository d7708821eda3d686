"""Compiled densities and moments of Gaussians with full covariances; ``gaussian_hmm`` is their interface."""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit


@njit
def log_densities(frames: Floats, means: Floats, whitening: Floats, constants: Floats, scores: Floats) -> None:
    """Write the log density of each frame for each state to ``scores``, (T, S).

    Parameters
    ----------
    frames : (T, D), means : (S, D).
    whitening : (S, D, D) inverses of the lower Cholesky factors of the covariances.
    constants : (S,) log densities at the means.
    """
    n_features = frames.shape[1]
    offset = np.empty(n_features)
    for t in range(len(frames)):
        for i in range(len(means)):
            for d in range(n_features):
                offset[d] = frames[t, d] - means[i, d]
            total = 0.0
            for d in range(n_features):
                z = 0.0
                for e in range(d + 1):
                    z += whitening[i, d, e] * offset[e]
                total += z * z
            scores[t, i] = constants[i] - 0.5 * total


@njit
def add_moments(frames: Floats, pivot: Floats, beliefs: Floats, first: Floats, second: Floats) -> None:
    """Add the moments of the frames, less ``pivot`` (D,), weighted by beliefs (T, S).

    Parameters
    ----------
    first, second : (D, S), and (D, D, S), of which [d, e] with e > d remains as it is; updated.
    """
    n_features = frames.shape[1]
    offset = np.empty(n_features)
    for t in range(len(frames)):
        belief = beliefs[t]
        for d in range(n_features):
            offset[d] = frames[t, d] - pivot[d]
        for d in range(n_features):
            value, row = offset[d], first[d]
            for i in range(len(belief)):
                row[i] += value * belief[i]
            for e in range(d + 1):
                value, row = offset[d] * offset[e], second[d, e]
                for i in range(len(belief)):
                    row[i] += value * belief[i]


@njit
def nearest(frames: Floats, centres: Floats, assigned: Floats, distances: Floats) -> None:
    """Write the nearest of the centres (S, D) to each frame (T, D), and its squared distance; (T,) each."""
    for t in range(len(frames)):
        best, smallest = 0, math.inf
        for i in range(len(centres)):
            total = 0.0
            for d in range(frames.shape[1]):
                total += (frames[t, d] - centres[i, d]) ** 2
            if total < smallest:
                best, smallest = i, total
        assigned[t] = best
        distances[t] = smallest
