"""Compiled recursions of the parallel HMM, in the log domain: exact whatever the range of the densities.

States lie flat, place by place: state s = n * M + m is place n of branch m. The first M states are where branches
begin, the last M where they end, and a state's predecessor is M before it; every recursion costs O(M N) a frame.
Memory does not grow with the length of the stream: the forward pass keeps one frame in ``BLOCK``, and each block is
computed anew when the backward pass arrives there. Arguments that all kernels share:

frames : (T, D) one sequence.
allowed : (T, M) bool, the branches that may be active in each frame; (0, M) where all are, always.
cuts : (T,) int8, ``FREE``, ``MUST`` or ``NEVER``: whether a segment begins here; (0,) where all are free.
log_entry, log_stay, log_leave : (M,), (S,), (S,) log-probabilities.
weight, shift, constant : (S, D), (S, D), (S,); log-density = constant - sum over D of (x weight - shift)^2.
"""

from __future__ import annotations

import math

import numba
import numpy as np

BLOCK = 128
"""Frames between two checkpoints of the forward pass."""

FREE, MUST, NEVER = 0, 1, 2
"""A frame's cut: a segment may begin here, must begin here, or must not."""

IMPOSSIBLE = -math.inf


@numba.njit(cache=True)
def log_densities(t, frames, allowed, weight, shift, constant, out):
    """Fill ``out`` (S,) with the log-density of frame t in every state, impossible where it is not allowed."""
    n_states, n_features = weight.shape
    n_branches = allowed.shape[1]
    for s in range(n_states):
        if len(allowed) > 0 and not allowed[t, s % n_branches]:
            out[s] = IMPOSSIBLE
        else:
            total = 0.0
            for d in range(n_features):
                y = frames[t, d] * weight[s, d] - shift[s, d]
                total += y * y
            out[s] = constant[s] - total


@numba.njit(cache=True)
def log_add(a, b):
    """Return log(exp(a) + exp(b))."""
    low, high = min(a, b), max(a, b)
    return high if low == IMPOSSIBLE else high + math.log1p(math.exp(low - high))


@numba.njit(cache=True)
def log_sum(a, b):
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


@numba.njit(cache=True)
def forward_step(t, alpha, density, cuts, log_entry, log_stay, log_leave, out):
    """Fill ``out`` (S,) with the log forward probabilities of frame t from those of the frame before.

    Returns
    -------
    The log-probability of the shared node between the two frames; 0 before the first frame.
    """
    n_branches, n_states = len(log_entry), len(alpha)
    cut = cuts[t] if len(cuts) > 0 else FREE
    node = 0.0
    if t > 0:
        node = IMPOSSIBLE if cut == NEVER else log_sum(alpha[-n_branches:], log_leave[-n_branches:])
    within = t > 0 and cut != MUST
    for s in range(n_states):
        value = alpha[s] + log_stay[s] if within else IMPOSSIBLE
        if s < n_branches:
            value = log_add(value, node + log_entry[s])
        elif within:
            value = log_add(value, alpha[s - n_branches] + log_leave[s - n_branches])
        out[s] = value + density[s]
    return node


@numba.njit(cache=True)
def backward_step(t, follow, cuts, log_entry, log_stay, log_leave, out):
    """Fill ``out`` (S,) with the log backward probabilities of the frame before t.

    ``follow`` (S,) is density plus log backward probability in frame t.
    """
    n_branches, n_states = len(log_entry), len(follow)
    cut = cuts[t] if len(cuts) > 0 else FREE
    node = IMPOSSIBLE if cut == NEVER else log_sum(follow[:n_branches], log_entry)
    for s in range(n_states):
        value = IMPOSSIBLE if cut == MUST else log_stay[s] + follow[s]
        if s >= n_states - n_branches:
            value = log_add(value, log_leave[s] + node)
        elif cut != MUST:
            value = log_add(value, log_leave[s] + follow[s + n_branches])
        out[s] = value


@numba.njit(cache=True)
def log_likelihood(frames, allowed, cuts, log_entry, log_stay, log_leave, weight, shift, constant):
    """Return the log-likelihood of one sequence, which may end in any state."""
    n_states = len(constant)
    alpha, after, density = np.zeros(n_states), np.empty(n_states), np.empty(n_states)
    for t in range(len(frames)):
        log_densities(t, frames, allowed, weight, shift, constant, density)
        forward_step(t, alpha, density, cuts, log_entry, log_stay, log_leave, after)
        alpha, after = after, alpha
    return log_sum(alpha, np.zeros(n_states))


@numba.njit(cache=True)
def expect(
    frames, allowed, cuts, log_entry, log_stay, log_leave, weight, shift, constant, pivot,
    entered, occupied, stayed, left, first, second,
):  # fmt: skip
    """Add the expected counts of one sequence to the six arrays and return its log-likelihood.

    entered : (M,) segments of each branch.
    occupied, stayed, left : (S,) frames in each state, and transitions to itself and away from it.
    first, second : (S, D) sums of the features less ``pivot`` (D,), and of their squares, over the state's frames.
    """
    n_frames, n_states = len(frames), len(constant)
    n_branches = len(log_entry)
    alphas, densities = np.empty((BLOCK + 1, n_states)), np.empty((BLOCK, n_states))
    nodes = np.empty(BLOCK)
    checkpoints = np.zeros(((n_frames + BLOCK - 1) // BLOCK, n_states))
    alpha, after = np.zeros(n_states), np.empty(n_states)
    for t in range(n_frames):
        if t % BLOCK == 0:
            checkpoints[t // BLOCK] = alpha
        log_densities(t, frames, allowed, weight, shift, constant, densities[0])
        forward_step(t, alpha, densities[0], cuts, log_entry, log_stay, log_leave, after)
        alpha, after = after, alpha
    total = log_sum(alpha, np.zeros(n_states))
    if total == IMPOSSIBLE:
        return total

    beta, follow = np.zeros(n_states), np.empty(n_states)
    for block in range(len(checkpoints) - 1, -1, -1):
        start, end = block * BLOCK, min((block + 1) * BLOCK, n_frames)
        alphas[0] = checkpoints[block]
        for t in range(start, end):
            k = t - start
            log_densities(t, frames, allowed, weight, shift, constant, densities[k])
            nodes[k] = forward_step(t, alphas[k], densities[k], cuts, log_entry, log_stay, log_leave, alphas[k + 1])
        for t in range(end - 1, start - 1, -1):
            k = t - start
            for s in range(n_states):
                follow[s] = densities[k, s] + beta[s]
                gamma = math.exp(alphas[k + 1, s] + beta[s] - total)
                occupied[s] += gamma
                for d in range(frames.shape[1]):
                    x = frames[t, d] - pivot[d]
                    first[s, d] += gamma * x
                    second[s, d] += gamma * x * x
            for m in range(n_branches):
                entered[m] += math.exp(nodes[k] + log_entry[m] + follow[m] - total)
            if t == 0:
                break
            backward_step(t, follow, cuts, log_entry, log_stay, log_leave, beta)
            within = len(cuts) == 0 or cuts[t] != MUST
            for s in range(n_states):
                gamma = math.exp(alphas[k, s] + beta[s] - total)
                kept = math.exp(alphas[k, s] + log_stay[s] + follow[s] - total) if within else 0.0
                stayed[s] += kept
                left[s] += gamma - kept
    return total


@numba.njit(cache=True)
def viterbi(frames, allowed, cuts, log_entry, log_stay, log_leave, weight, shift, constant, branch, begins):
    """Fill the most likely branch (T,) and whether a segment begins (T,) of every frame; return the path's score.

    Each state carries the frame in which its best path entered the branch, and each frame keeps the best branch to
    leave and that branch's begin: the path is read back segment by segment, with no back pointer for a state.
    """
    n_frames, n_states, n_branches = len(frames), len(constant), len(log_entry)
    score, since, density = np.full(n_states, IMPOSSIBLE), np.zeros(n_states, np.int64), np.empty(n_states)
    exit_branch, exit_since = np.empty(n_frames, np.int32), np.empty(n_frames, np.int64)
    for t in range(n_frames):
        log_densities(t, frames, allowed, weight, shift, constant, density)
        cut = cuts[t] if len(cuts) > 0 else FREE
        node = 0.0 if t == 0 else IMPOSSIBLE
        if t > 0:
            best = 0
            for m in range(n_branches):
                s = n_states - n_branches + m
                value = score[s] + log_leave[s]
                if value > node:
                    node, best = value, m
            exit_branch[t - 1], exit_since[t - 1] = best, since[n_states - n_branches + best]
            if cut == NEVER:
                node = IMPOSSIBLE
        for s in range(n_states - 1, -1, -1):
            value = IMPOSSIBLE if cut == MUST else score[s] + log_stay[s]
            if s >= n_branches:
                moved = IMPOSSIBLE if cut == MUST else score[s - n_branches] + log_leave[s - n_branches]
                if moved > value:
                    value, since[s] = moved, since[s - n_branches]
            elif node + log_entry[s] > value:
                value, since[s] = node + log_entry[s], t
            score[s] = value + density[s]
    last = 0
    for s in range(n_states):
        if score[s] > score[last]:
            last = s
    begins[:] = False
    end, m, start = n_frames, last % n_branches, since[last]
    while True:
        branch[start:end] = m
        begins[start] = True
        if start == 0:
            return score[last]
        end = start
        m, start = exit_branch[end - 1], exit_since[end - 1]


@numba.njit(cache=True)
def branch_log_likelihoods(frames, n_branches, log_stay, log_leave, weight, shift, constant):
    """Return log P(frames | branch) of every branch alone, (M,): from its first state, ending in any."""
    n_states = len(constant)
    anything = np.ones((0, n_branches), np.bool_)
    alpha, density = np.full(n_states, IMPOSSIBLE), np.empty(n_states)
    for t in range(len(frames)):
        log_densities(t, frames, anything, weight, shift, constant, density)
        for s in range(n_states - 1, -1, -1):
            value = alpha[s] + log_stay[s]
            if s >= n_branches:
                value = log_add(value, alpha[s - n_branches] + log_leave[s - n_branches])
            elif t == 0:
                value = 0.0
            alpha[s] = value + density[s]
    result = np.empty(n_branches)
    for m in range(n_branches):
        result[m] = log_sum(alpha[m::n_branches], np.zeros(n_states // n_branches))
    return result
