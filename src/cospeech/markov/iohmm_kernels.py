"""Compiled recursions of the input-output HMM, with probabilities that are scaled in every frame."""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit


@njit
def _move(belief: Floats, transitions: Floats, after: Floats) -> None:
    """Fill ``after`` (S,) with the belief (S,) moved by transitions (S, S)."""
    after[:] = 0.0
    for i in range(len(belief)):
        for j in range(len(after)):
            after[j] += belief[i] * transitions[i, j]


@njit
def expect(
    inputs: Integers, outputs: Integers, initial: Floats, transitions: Floats, emissions: Floats,
    begun: Floats, moved: Floats, emitted: Floats,
) -> float:  # fmt: skip
    """Return the log-likelihood of a sequence, and add its expected counts to the arrays.

    ``moved`` (U, S, S) has to be multiplied by the transitions afterwards.
    """
    n_frames, n_states = len(inputs), initial.shape[1]
    alphas, scales = np.empty((n_frames, n_states)), np.empty(n_frames)
    found, predicted = 0.0, initial[inputs[0]].copy()
    for t in range(n_frames):
        u, y, alpha = inputs[t], outputs[t], alphas[t]
        if t > 0:
            _move(alphas[t - 1], transitions[u], predicted)
        total = 0.0
        for s in range(n_states):
            alpha[s] = predicted[s] * emissions[u, s, y]
            total += alpha[s]
        scales[t] = 1.0 / total
        for s in range(n_states):
            alpha[s] *= scales[t]
        found += math.log(total)

    beta, follow = np.ones(n_states), np.empty(n_states)
    for t in range(n_frames - 1, -1, -1):
        u, y, alpha = inputs[t], outputs[t], alphas[t]
        for s in range(n_states):
            gamma = alpha[s] * beta[s]
            emitted[u, s, y] += gamma
            if t == 0:
                begun[u, s] += gamma
            follow[s] = emissions[u, s, y] * beta[s] * scales[t]
        if t > 0:
            for i in range(n_states):
                weight, total = alphas[t - 1, i], 0.0
                for j in range(n_states):
                    moved[u, i, j] += weight * follow[j]
                for j in range(n_states):
                    total += transitions[u, i, j] * follow[j]
                beta[i] = total
    return found


@njit
def predict(inputs: Integers, transitions: Floats, emissions: Floats, belief: Floats, found: Floats) -> None:
    """Fill ``found`` (T, K) with the probabilities of the outputs, and move ``belief`` (S,) through the frames."""
    after = np.empty_like(belief)
    for t in range(len(inputs)):
        _move(belief, transitions[inputs[t]], after)
        found[t] = 0.0
        for s in range(len(belief)):
            belief[s] = after[s]
            for k in range(found.shape[1]):
                found[t, k] += after[s] * emissions[inputs[t], s, k]
