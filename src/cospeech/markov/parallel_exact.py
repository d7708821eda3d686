"""Compiled E-step of the parallel HMM in logarithms: exact for any range of densities, and slow.

It is used where the result of ``parallel_scaled`` is not reliable. There are no vectors.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.parallel_density import BLOCK
from cospeech.markov.parallel_scaled import FREE, MUST, NEVER, Cuts

IMPOSSIBLE = -math.inf
LOG_2 = math.log(2.0)

NEGLIGIBLE = 40.0
"""exp(-x) of greater x does not change a sum with 1."""


@njit
def log_add(a: float, b: float) -> float:
    """Return log(exp(a) + exp(b))."""
    low, high = min(a, b), max(a, b)
    return high if low < high - NEGLIGIBLE or low == IMPOSSIBLE else high + math.log1p(math.exp(low - high))


@njit
def log_sum(a: Floats, b: Floats) -> float:
    """Return the logarithm of the sum of exp(a + b) over two vectors."""
    high = IMPOSSIBLE
    for i in range(len(a)):
        high = max(high, a[i] + b[i])
    if high == IMPOSSIBLE:
        return high
    total = 0.0
    for i in range(len(a)):
        total += math.exp(a[i] + b[i] - high)
    return high + math.log(total)


@njit
def _copy(source: Floats, target: Floats) -> None:
    """Copy a vector; an assignment would take seconds to compile because of its error messages."""
    for i in range(len(source)):
        target[i] = source[i]


@njit
def log_densities(
    frame: Floats, allowed: Flags, weight: Floats, shift: Floats, constant: Floats, pivot: Floats, density: Floats
) -> None:
    """Fill ``density`` (S,) with the natural log densities of a frame (D,); ``allowed`` is (M,), or (0,) for all."""
    for s in range(len(constant)):
        total = 0.0
        for d in range(len(frame)):
            y = (frame[d] - pivot[d]) * weight[s, d] - shift[s, d]
            total += y * y
        density[s] = (constant[s] - total) * LOG_2
        if len(allowed) > 0 and not allowed[s % len(allowed)]:
            density[s] = IMPOSSIBLE


@njit
def fill_log_densities(
    frames: Floats, weight: Floats, shift: Floats, constant: Floats, pivot: Floats, densities: Floats
) -> None:
    """Fill ``densities`` (T, S) with the natural log densities of frames (T, D)."""
    anything = np.ones(0, np.bool_)
    for t in range(len(frames)):
        log_densities(frames[t], anything, weight, shift, constant, pivot, densities[t])


@njit
def _forward(
    t: int, alpha: Floats, density: Floats, cut: int, entry: Floats, stay: Floats, leave: Floats, after: Floats
) -> tuple[float, float]:
    """Fill ``after`` (S,) from ``alpha`` (S,) of the previous frame; return the node between them and the sum.

    Each frame is scaled to the sum 1, so that an extremely improbable one does not affect the precision of others.
    """
    n_branches = len(entry)
    node = 0.0 if t == 0 else IMPOSSIBLE if cut == NEVER else log_sum(alpha[-n_branches:], leave[-n_branches:])
    within = t > 0 and cut != MUST
    for s in range(len(stay)):
        value = alpha[s] + stay[s] if within else IMPOSSIBLE
        if s < n_branches:
            value = log_add(value, node + entry[s])
        elif within:
            value = log_add(value, alpha[s - n_branches] + leave[s - n_branches])
        after[s] = value + density[s]
    total = log_sum(after, np.zeros_like(after))
    for s in range(len(after)):
        after[s] -= total
    return node, total


@njit
def _backward(follow: Floats, cut: int, entry: Floats, stay: Floats, leave: Floats, beta: Floats) -> None:
    """Fill ``beta`` (S,) of a frame from ``follow`` (S,), the density times backward probability of the next one."""
    n_branches, n_states = len(entry), len(stay)
    node = IMPOSSIBLE if cut == NEVER else log_sum(follow[:n_branches], entry)
    for s in range(n_states):
        value = IMPOSSIBLE if cut == MUST else stay[s] + follow[s]
        if s >= n_states - n_branches:
            value = log_add(value, leave[s] + node)
        elif cut != MUST:
            value = log_add(value, leave[s] + follow[s + n_branches])
        beta[s] = value


@njit
def expect(
    frames: Floats, allowed: Flags, cuts: Cuts, entry: Floats, stay: Floats, leave: Floats,
    weight: Floats, shift: Floats, constant: Floats, pivot: Floats,
    entered: Floats, occupied: Floats, stayed: Floats, left: Floats, first: Floats, second: Floats,
) -> float:  # fmt: skip
    """Return the log2-likelihood of a sequence, and add its expected counts to the arrays.

    Parameters
    ----------
    frames, allowed, cuts, pivot : see ``parallel_scaled.expect``.
    entry, stay, leave : (M,), (S,), (S,) natural logarithms of probabilities; state s = n * M + m is the n-th of
        branch m.
    weight, shift, constant : (S, D), (S, D), (S,), as in ``parallel_scaled.expect``.
    entered, occupied, stayed, left, first, second : see ``parallel.Counts``.
    """
    n_frames, n_states, n_branches = len(frames), len(stay), len(entry)
    clamped = len(allowed) > 0
    anything = np.ones(0, np.bool_)
    alphas, densities = np.empty((BLOCK + 1, n_states)), np.empty((BLOCK, n_states))
    nodes, sums = np.empty(BLOCK), np.empty(BLOCK)
    checkpoints = np.zeros(((n_frames + BLOCK - 1) // BLOCK, n_states))
    alpha, after = np.zeros(n_states), np.empty(n_states)
    likelihood = 0.0
    for t in range(n_frames):
        if t % BLOCK == 0:
            _copy(alpha, checkpoints[t // BLOCK])
        may = allowed[t] if clamped else anything
        log_densities(frames[t], may, weight, shift, constant, pivot, densities[0])
        cut = cuts[t] if len(cuts) > 0 else FREE
        _, total = _forward(t, alpha, densities[0], cut, entry, stay, leave, after)
        if total == IMPOSSIBLE:
            return total
        likelihood += total
        alpha, after = after, alpha

    beta, follow = np.zeros(n_states), np.empty(n_states)
    for j in range(len(checkpoints) - 1, -1, -1):
        start, end = j * BLOCK, min((j + 1) * BLOCK, n_frames)
        _copy(checkpoints[j], alphas[0])
        for t in range(start, end):
            k = t - start
            may = allowed[t] if clamped else anything
            log_densities(frames[t], may, weight, shift, constant, pivot, densities[k])
            cut = cuts[t] if len(cuts) > 0 else FREE
            nodes[k], sums[k] = _forward(t, alphas[k], densities[k], cut, entry, stay, leave, alphas[k + 1])
        for t in range(end - 1, start - 1, -1):
            k = t - start
            for s in range(n_states):
                follow[s] = densities[k, s] + beta[s] - sums[k]
                gamma = math.exp(alphas[k + 1, s] + beta[s])
                occupied[s] += gamma
                for d in range(frames.shape[1]):
                    x = frames[t, d] - pivot[d]
                    first[d, s] += gamma * x
                    second[d, s] += gamma * x * x
            for m in range(n_branches):
                entered[m] += math.exp(nodes[k] + entry[m] + follow[m])
            if t > 0:
                cut = cuts[t] if len(cuts) > 0 else FREE
                _backward(follow, cut, entry, stay, leave, beta)
                for s in range(n_states):
                    kept = 0.0 if cut == MUST else math.exp(alphas[k, s] + stay[s] + follow[s])
                    stayed[s] += kept
                    left[s] += max(math.exp(alphas[k, s] + beta[s]) - kept, 0.0)
    return likelihood / LOG_2


@njit
def branch_likelihoods(
    frames: Floats,
    starts: Integers,
    stay: Floats,
    leave: Floats,
    weight: Floats,
    shift: Floats,
    constant: Floats,
    pivot: Floats,
    found: Floats,
) -> None:
    """Fill ``found`` (L, M) with log P(segment | branch), from the first state of the branch to any of its states.

    ``starts`` (L + 1,) are the first frames of the segments, and the end of the last one.
    """
    n_states, n_branches = len(stay), found.shape[1]
    anything, ending = np.ones(0, np.bool_), np.zeros(n_states // n_branches)
    alpha, density = np.empty(n_states), np.empty(n_states)
    for i in range(len(found)):
        alpha[:] = IMPOSSIBLE
        for t in range(starts[i], starts[i + 1]):
            log_densities(frames[t], anything, weight, shift, constant, pivot, density)
            for s in range(n_states - 1, -1, -1):
                value = alpha[s] + stay[s]
                if s >= n_branches:
                    value = log_add(value, alpha[s - n_branches] + leave[s - n_branches])
                elif t == starts[i]:
                    value = 0.0
                alpha[s] = value + density[s]
        for m in range(n_branches):
            found[i, m] = log_sum(alpha[m::n_branches], ending)
