"""Compiled recursions of the parallel HMM over symbols, with probabilities that are scaled in every frame.

Symbols have finitely many densities, which ``parallel_symbols`` keeps away from zero: nothing can underflow.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.parallel_exact import IMPOSSIBLE, log_add, log_sum


@njit
def _forward(
    symbols: Integers, densities: Floats, entry: Floats, stay: Floats, leave: Floats,
    alphas: Floats, scales: Floats, nodes: Floats,
) -> float:  # fmt: skip
    """Fill ``alphas`` (T, S), which sum to 1, ``scales`` and ``nodes`` (T,); return the log of the sum of all paths.

    A node is the probability of entering a branch in the frame.
    """
    n_branches, n_states = len(entry), len(stay)
    score, node = 0.0, 1.0
    before = np.zeros(n_states)
    for t in range(len(symbols)):
        density, alpha = densities[symbols[t]], alphas[t]
        nodes[t] = node
        for s in range(n_branches):
            alpha[s] = (before[s] * stay[s] + node * entry[s]) * density[s]
        for s in range(n_branches, n_states):
            alpha[s] = (before[s] * stay[s] + before[s - n_branches] * leave[s - n_branches]) * density[s]
        total = 0.0
        for s in range(n_states):
            total += alpha[s]
        scale = 1.0 / total
        node = 0.0
        for s in range(n_states):
            alpha[s] *= scale
        for s in range(n_states - n_branches, n_states):
            node += alpha[s] * leave[s]
        score += math.log(total)
        scales[t] = scale
        before = alpha
    return score


@njit
def expect(
    symbols: Integers, densities: Floats, entry: Floats, stay: Floats, leave: Floats,
    entered: Floats, occupied: Floats, final: Floats,
) -> float:  # fmt: skip
    """Return the log score of a sequence, and add its expected counts to the arrays.

    Parameters
    ----------
    symbols : (T,). densities : (Y, S) of every symbol in every state.
    entry, stay, leave : (M,), (S,), (S,) probabilities.
    entered, occupied, final : (M,), (Y, S), (S,); see ``parallel_symbols.Counts``.
    """
    n_frames, n_branches, n_states = len(symbols), len(entry), len(stay)
    alphas, scales, nodes = np.empty((n_frames, n_states)), np.empty(n_frames), np.empty(n_frames)
    score = _forward(symbols, densities, entry, stay, leave, alphas, scales, nodes)
    beta, follow = np.ones(n_states), np.empty(n_states)
    for s in range(n_states):
        final[s] += alphas[n_frames - 1, s]
    for t in range(n_frames - 1, -1, -1):
        density, alpha, occupancy = densities[symbols[t]], alphas[t], occupied[symbols[t]]
        for s in range(n_states):
            occupancy[s] += alpha[s] * beta[s]
            follow[s] = density[s] * beta[s] * scales[t]
        node = 0.0
        for s in range(n_branches):
            begun = entry[s] * follow[s]
            entered[s] += nodes[t] * begun
            node += begun
        for s in range(n_states - n_branches):
            beta[s] = stay[s] * follow[s] + leave[s] * follow[s + n_branches]
        for s in range(n_states - n_branches, n_states):
            beta[s] = stay[s] * follow[s] + leave[s] * node
    return score


@njit
def branch_scores(densities: Floats, edges: Integers, stay: Floats, leave: Floats, found: Floats) -> None:
    """Fill ``found`` (L, M) with log P(segment | branch), from the first state of the branch to any of its states.

    ``densities`` (T, S), ``stay`` and ``leave`` (S,) are logarithms; ``edges`` (L + 1,) the first frames of the
    segments, and the end of the last one.
    """
    n_states, n_branches = len(stay), found.shape[1]
    ending, alpha = np.zeros(n_states // n_branches), np.empty(n_states)
    for i in range(len(found)):
        alpha[:] = IMPOSSIBLE
        for t in range(edges[i], edges[i + 1]):
            for s in range(n_states - 1, -1, -1):
                value = alpha[s] + stay[s]
                if s >= n_branches:
                    value = log_add(value, alpha[s - n_branches] + leave[s - n_branches])
                elif t == edges[i]:
                    value = 0.0
                alpha[s] = value + densities[t, s]
        for m in range(n_branches):
            found[i, m] = log_sum(alpha[m::n_branches], ending)
