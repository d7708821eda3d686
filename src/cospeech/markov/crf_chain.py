"""Compiled sums over all paths through a linear chain; the Gaussian HMM and the CRF share them.

The weight of a path q_1 ... q_T is initial[q_1] * exp(scores[1, q_1]) * product over t > 1 of pairs[q_(t-1), q_t] *
exp(scores[t, q_t]). For an HMM, ``pairs`` are the transition probabilities and ``scores`` the log densities.

The forward pass stores normalised weights, ``filtered``, and what they predict, ``ahead``. The backward pass needs
only these two: with r(j) = smoothed[t + 1, j] / ahead[t + 1, j],

    smoothed[t, i] = filtered[t, i] * sum over j of pairs[i, j] r(j),
    P(q_t = i, q_(t+1) = j) = filtered[t, i] pairs[i, j] r(j),

so that it cannot overflow where densities are tiny.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

SMALLEST = 1e-200
"""Sums of weights below this are computed again in logarithms, as some of their terms may have been lost."""


@njit
def weigh(ahead: Floats, scores: Floats, after: Floats) -> float:
    """Write the weights ``ahead * exp(scores)``, (S,), divided by their sum, and return the logarithm of the sum."""
    top = -math.inf
    for score in scores:
        top = max(top, score)
    total = 0.0
    for j in range(len(ahead)):
        after[j] = ahead[j] * math.exp(scores[j] - top)
        total += after[j]
    if total < SMALLEST:
        top = -math.inf
        for j in range(len(ahead)):
            after[j] = math.log(ahead[j]) + scores[j] if ahead[j] > 0.0 else -math.inf
            top = max(top, after[j])
        total = 0.0
        for j in range(len(ahead)):
            after[j] = math.exp(after[j] - top)
            total += after[j]
    for j in range(len(ahead)):
        after[j] /= total
    return top + math.log(total)


@njit
def predict(before: Floats, pairs: Floats, ahead: Floats) -> None:
    """Write the sum over i of ``before[i] * pairs[i, j]``, (S,)."""
    ahead[:] = 0.0
    for i in range(len(before)):
        weight, row = before[i], pairs[i]
        for j in range(len(ahead)):
            ahead[j] += weight * row[j]


@njit
def forward(initial: Floats, pairs: Floats, scores: Floats, filtered: Floats, ahead: Floats) -> float:
    """Fill ``filtered`` and ``ahead``, (T, S), and return the log of the sum over all paths.

    Parameters
    ----------
    initial : (S,), pairs : (S, S), scores : (T, S).
    """
    total = 0.0
    for t in range(len(scores)):
        if t == 0:
            ahead[0] = initial
        else:
            predict(filtered[t - 1], pairs, ahead[t])
        total += weigh(ahead[t], scores[t], filtered[t])
    return total


@njit
def backward(turned: Floats, filtered: Floats, ahead: Floats, smoothed: Floats, ratios: Floats) -> None:
    """Fill ``smoothed`` (T, S), and add to ``ratios`` (S, S) what, times ``pairs``, are the expected transitions.

    Parameters
    ----------
    turned : (S, S) ``pairs`` transposed.
    filtered, ahead : (T, S), see ``forward``.
    """
    n_frames, n_states = filtered.shape
    ratio = np.empty(n_states)
    smoothed[n_frames - 1] = filtered[n_frames - 1]
    for t in range(n_frames - 2, -1, -1):
        row = smoothed[t]
        for j in range(n_states):
            ratio[j] = smoothed[t + 1, j] / ahead[t + 1, j] if ahead[t + 1, j] > 0.0 else 0.0
        row[:] = 0.0
        for j in range(n_states):
            weight, column = ratio[j], turned[j]
            for i in range(n_states):
                row[i] += weight * column[i]
        for i in range(n_states):
            weight = filtered[t, i]
            row[i] *= weight
            sums = ratios[i]
            for j in range(n_states):
                sums[j] += weight * ratio[j]


@njit
def products(features: Floats, weights: Floats, scores: Floats) -> None:
    """Write ``features @ weights``, (T, S), of arrays (T, F) and (F, S), in one thread."""
    for t in range(len(features)):
        row = scores[t]
        row[:] = 0.0
        for f in range(features.shape[1]):
            value, column = features[t, f], weights[f]
            for i in range(len(row)):
                row[i] += value * column[i]


@njit
def add_moments(features: Floats, beliefs: Floats, sums: Floats) -> None:
    """Add ``features.T @ beliefs``, (F, S), of arrays (T, F) and (T, S) to ``sums``, in one thread."""
    for t in range(len(features)):
        belief = beliefs[t]
        for f in range(features.shape[1]):
            value, row = features[t, f], sums[f]
            for i in range(len(row)):
                row[i] += value * belief[i]
