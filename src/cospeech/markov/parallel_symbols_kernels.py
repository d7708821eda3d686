"""Compiled recursions of the parallel HMM over symbols, with scaled probabilities.

Symbols have finitely many densities, which ``parallel_symbols`` keeps away from zero: nothing can underflow.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.lanes import LANES, each, put, take, total
from cospeech.markov.parallel_density import scale
from cospeech.markov.parallel_exact import IMPOSSIBLE, log_add, log_sum

FAINT = 2.0**-200
"""If the sum of the probabilities of a frame is below this, they are scaled up."""


@njit
def _forward(
    symbols: Integers, densities: Floats, entry: Floats, stay: Floats, leave: Floats,
    alphas: Floats, scales: Floats, nodes: Floats,
) -> float:  # fmt: skip
    """Fill rows 1 to T of ``alphas`` (T + 1, V, LANES), ``scales`` and ``nodes`` (T,); return the last row's sum.

    A node is the probability of entering a branch in the frame.
    """
    n_vectors, n_groups = len(stay), len(entry)
    left, node = 1.0, 1.0
    for t in range(len(symbols)):
        y, nodes[t], scales[t] = symbols[t], node, 1.0
        everywhere, leaving = each(0.0), each(0.0)
        for v in range(n_groups):
            value = take(alphas, (t, v)) * take(stay, (v,)) + take(entry, (v,)) * node
            value = value * take(densities, (y, v))
            put(alphas, (t + 1, v), value)
            everywhere = everywhere + value
        for v in range(n_groups, n_vectors):
            moved = take(alphas, (t, v - n_groups)) * take(leave, (v - n_groups,))
            value = (take(alphas, (t, v)) * take(stay, (v,)) + moved) * take(densities, (y, v))
            put(alphas, (t + 1, v), value)
            everywhere = everywhere + value
        for v in range(n_vectors - n_groups, n_vectors):
            leaving = leaving + take(alphas, (t + 1, v)) * take(leave, (v,))
        left, node = total(everywhere), total(leaving)
        if left < FAINT:
            scales[t] = 1.0 / left
            node *= scales[t]
            scale(alphas[t + 1], scales[t])
            left = 1.0
    return left


@njit
def expect(
    symbols: Integers, densities: Floats, entry: Floats, stay: Floats, leave: Floats,
    entered: Floats, occupied: Floats, final: Floats,
) -> float:  # fmt: skip
    """Return the log score of a sequence, and add its expected counts to the arrays.

    States are stored in vectors as in ``parallel_density``.

    Parameters
    ----------
    symbols : (T,). densities : (Y, V, LANES) of every symbol in every state.
    entry, stay, leave : (G, LANES), (V, LANES), (V, LANES) probabilities.
    entered, occupied, final : (G, LANES), (Y, V, LANES), (V, LANES); see ``parallel_symbols.Counts``.
    """
    n_frames, n_vectors, n_groups = len(symbols), len(stay), len(entry)
    alphas = np.empty((n_frames + 1, n_vectors, LANES))
    scales, nodes = np.empty(n_frames), np.empty(n_frames)
    alphas[0] = 0.0
    left = _forward(symbols, densities, entry, stay, leave, alphas, scales, nodes)
    score = math.log(left)
    beta = np.full((n_vectors, LANES), 1.0 / left)
    for v in range(n_vectors):
        put(final, (v,), take(final, (v,)) + take(alphas, (n_frames, v)) * (1.0 / left))
    for t in range(n_frames - 1, -1, -1):
        y, factor, worth = symbols[t], scales[t], each(0.0)
        if factor != 1.0:
            score -= math.log(factor)
        # The product of a state stays in its ``beta`` until the next state of the branch is reached.
        for v in range(n_vectors):
            later = take(beta, (v,))
            put(occupied, (y, v), take(occupied, (y, v)) + take(alphas, (t + 1, v)) * later)
            follow = take(densities, (y, v)) * later * factor
            put(beta, (v,), follow)
            if v < n_groups:
                begun = take(entry, (v,)) * follow
                put(entered, (v,), take(entered, (v,)) + begun * nodes[t])
                worth = worth + begun
            else:
                own = take(beta, (v - n_groups,))
                put(beta, (v - n_groups,), take(stay, (v - n_groups,)) * own + take(leave, (v - n_groups,)) * follow)
        node = total(worth)
        for v in range(n_vectors - n_groups, n_vectors):
            put(beta, (v,), take(stay, (v,)) * take(beta, (v,)) + take(leave, (v,)) * node)
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
