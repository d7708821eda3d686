"""Compiled recursions of left-to-right HMMs; ``word_hmm`` is their interface.

Each lane of a vector is one pair of a clip and a model: in training 8 clips, each with its own model, and in scoring
one clip and 8 models. All logarithms have the base 2.

The forward probability of a state is stored as the log-probability of the best path to it (Viterbi) and the ratio of
the forward probability to that of this path, which is at least 1 and grows no faster than the number of paths. A
state is reached from two states only, so that one exponential per frame and state suffices. Nothing underflows,
however badly a model fits. The backward probabilities are stored in the same way.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.lanes import LANES, each, exp2, greater, greatest, put, take, where_greater
from cospeech.markov.parallel_density import ABREAST, log_densities

NEGLIGIBLE = 1e-14
"""Posterior probability below which a state counts for nothing in the sums over frames."""

NEVER = -1e30
"""The log-probability of what cannot happen. Finite, so that differences remain defined."""


@njit(inline="always")
def _sum(one: Any, one_ratio: Any, other: Any, other_ratio: Any) -> Any:
    """Return the sum of two probabilities, each given as a log2-probability and a ratio, in the same form."""
    best = greater(one, other)
    least = where_greater(one, other, other, one)
    gain = exp2(least - best)
    ratio = where_greater(one, other, one_ratio + other_ratio * gain, one_ratio * gain + other_ratio)
    return best, ratio


@njit
def forward(n: int, scores: Floats, stay: Floats, move: Floats, best: Floats, ratio: Floats) -> None:
    """Fill ``best`` and ``ratio`` with the forward probabilities of n frames.

    Parameters
    ----------
    scores : (>= n, S, LANES) log2 densities.
    stay, move : (S, LANES) log2-probabilities of staying in a state and of moving to the next one.
    best, ratio : (>= n, S, LANES).
    """
    n_states = len(stay)
    put(best, (0, 0), take(scores, (0, 0)))
    put(ratio, (0, 0), each(1.0))
    for i in range(1, n_states):
        put(best, (0, i), each(NEVER))
        put(ratio, (0, i), each(0.0))
    for t in range(1, n):
        put(best, (t, 0), take(best, (t - 1, 0)) + take(stay, (0,)) + take(scores, (t, 0)))
        put(ratio, (t, 0), take(ratio, (t - 1, 0)))
        for i in range(1, n_states):
            stayed = take(best, (t - 1, i)) + take(stay, (i,))
            moved = take(best, (t - 1, i - 1)) + take(move, (i - 1,))
            reached, share = _sum(stayed, take(ratio, (t - 1, i)), moved, take(ratio, (t - 1, i - 1)))
            put(best, (t, i), reached + take(scores, (t, i)))
            put(ratio, (t, i), share)


@njit
def total(best: Floats, ratio: Floats, lane: int) -> float:
    """Return the log2-probability of a sequence from the forward probabilities (S, LANES) of its last frame."""
    greatest = best[0, lane]
    for i in range(1, len(best)):
        greatest = max(greatest, best[i, lane])
    value = 0.0
    for i in range(len(best)):
        value += ratio[i, lane] * 2.0 ** max(best[i, lane] - greatest, -1000.0)
    return float(greatest + math.log2(value))


@njit
def posteriors(
    n: int, scores: Floats, stay: Floats, move: Floats, best: Floats, ratio: Floats, last: Floats, likelihood: Floats
) -> None:
    """Replace the forward probabilities ``best`` by the probabilities of the states, given the whole sequence.

    Parameters
    ----------
    last : (1, LANES) index of the last frame of each sequence; later frames get the probability 0.
    likelihood : (1, LANES) log2-probability of each sequence.
    """
    n_states = len(stay)
    later, later_ratio = np.zeros((n_states, LANES)), np.ones((n_states, LANES))
    end, whole = take(last, (0,)), take(likelihood, (0,))
    for t in range(n - 1, -1, -1):
        for i in range(n_states):
            if t < n - 1:
                value = take(stay, (i,)) + take(scores, (t + 1, i)) + take(later, (i,))
                share = take(later_ratio, (i,))
                if i < n_states - 1:
                    moved = take(move, (i,)) + take(scores, (t + 1, i + 1)) + take(later, (i + 1,))
                    value, share = _sum(value, share, moved, take(later_ratio, (i + 1,)))
                put(later, (i,), where_greater(end, each(t + 0.5), value, each(0.0)))
                put(later_ratio, (i,), where_greater(end, each(t + 0.5), share, each(1.0)))
            found = exp2(take(best, (t, i)) + take(later, (i,)) - whole)
            found = found * take(ratio, (t, i)) * take(later_ratio, (i,))
            put(best, (t, i), where_greater(end, each(t - 0.5), found, each(0.0)))


@njit
def _densities(n: int, block: Floats, weight: Floats, shift: Floats, constant: Floats, scores: Floats) -> None:
    """Fill ``scores`` (>= n, S, LANES) with log2 densities of frames (>= n, D, LANES), ``ABREAST`` at a time."""
    n_features = block.shape[1]
    for i in range(len(constant)):
        for t in range(0, n, ABREAST):
            l0 = l1 = l2 = l3 = take(constant, (i,))
            for d in range(n_features):
                w, s = take(weight, (i, d)), take(shift, (i, d))
                y0, y1 = take(block, (t, d)) * w - s, take(block, (t + 1, d)) * w - s
                y2, y3 = take(block, (t + 2, d)) * w - s, take(block, (t + 3, d)) * w - s
                l0, l1, l2, l3 = l0 - y0 * y0, l1 - y1 * y1, l2 - y2 * y2, l3 - y3 * y3
            put(scores, (t, i), l0)
            put(scores, (t + 1, i), l1)
            put(scores, (t + 2, i), l2)
            put(scores, (t + 3, i), l3)


@njit
def _moments(n: int, block: Floats, posterior: Floats, occupied: Floats, first: Floats, second: Floats) -> None:
    """Set the sums over n frames (>= n, D, LANES), weighted by posterior probabilities (>= n, S, LANES).

    Sums are read and written once for ``ABREAST`` frames; the posteriors of the frames after the last one become 0.
    Most states are impossible at most times, since a clip moves through them in order: they are left out.
    """
    occupied[:], first[:], second[:] = 0.0, 0.0, 0.0
    posterior[n : (n + ABREAST - 1) // ABREAST * ABREAST] = 0.0
    for i in range(posterior.shape[1]):
        for t in range(0, n, ABREAST):
            w0, w1 = take(posterior, (t, i)), take(posterior, (t + 1, i))
            w2, w3 = take(posterior, (t + 2, i)), take(posterior, (t + 3, i))
            if greatest(greater(greater(w0, w1), greater(w2, w3))) < NEGLIGIBLE:
                continue
            put(occupied, (i,), take(occupied, (i,)) + ((w0 + w1) + (w2 + w3)))
            for d in range(block.shape[1]):
                x0, x1 = take(block, (t, d)), take(block, (t + 1, d))
                x2, x3 = take(block, (t + 2, d)), take(block, (t + 3, d))
                once, twice = take(first, (i, d)), take(second, (i, d))
                y0, y1, y2, y3 = w0 * x0, w1 * x1, w2 * x2, w3 * x3
                put(first, (i, d), once + ((y0 + y1) + (y2 + y3)))
                put(second, (i, d), (twice + y0 * x0 + y1 * x1) + (y2 * x2 + y3 * x3))


@njit
def _gather(frames: Floats, first_row: Integers, n_rows: Integers, pivot: Floats, n: int, block: Floats) -> None:
    """Fill ``block`` (>= n, D, LANES) with the frames of one clip per lane minus ``pivot``, and then with 0."""
    for t in range(n):
        for d in range(len(pivot)):
            for lane in range(LANES):
                block[t, d, lane] = frames[first_row[lane] + t, d] - pivot[d] if t < n_rows[lane] else 0.0


@njit
def expect(
    frames: Floats, begin: Integers, length: Integers, owner: Integers, pivot: Floats,
    weight: Floats, shift: Floats, constant: Floats, stay: Floats, move: Floats,
    likelihood: Floats, occupied: Floats, ended: Floats, first: Floats, second: Floats,
) -> None:  # fmt: skip
    """Add the expected counts of all clips to those of their models.

    Parameters
    ----------
    frames : (T, D) of all clips, below one another.
    begin, length, owner : (C,) first frame and number of frames of each clip, and the index of its model.
    pivot : (D,) subtracted from all frames.
    weight, shift : (R, S, D), and constant, stay, move : (R, S), parameters of the models, see ``word_hmm._packed``.
    likelihood, occupied, ended, first, second : (R,), (R, S), (R, S), (R, S, D), (R, S, D), updated: log2-likelihood,
        frames in each state, clips that end in it, and sums of its frames and their squares.
    """
    n_states, n_features, longest = weight.shape[1], weight.shape[2], length.max()
    padded = (longest + ABREAST - 1) // ABREAST * ABREAST
    block = np.zeros((padded, n_features, LANES))
    scores, best = np.empty((padded, n_states, LANES)), np.empty((padded, n_states, LANES))
    ratio = np.empty((padded, n_states, LANES))
    own_weight, own_shift = np.zeros((n_states, n_features, LANES)), np.zeros((n_states, n_features, LANES))
    own_constant, own_stay = np.zeros((n_states, LANES)), np.zeros((n_states, LANES))
    own_move, own_occupied = np.zeros((n_states, LANES)), np.empty((n_states, LANES))
    own_first, own_second = np.empty((n_states, n_features, LANES)), np.empty((n_states, n_features, LANES))
    last, own_likelihood = np.empty((1, LANES)), np.zeros((1, LANES))
    first_row, n_rows = np.zeros(LANES, dtype=np.int64), np.zeros(LANES, dtype=np.int64)
    for group in range(0, len(begin), LANES):
        n_clips = min(LANES, len(begin) - group)
        n = length[group : group + n_clips].max()
        for lane in range(LANES):
            clip = min(group + lane, len(begin) - 1)
            own = length[clip] if lane < n_clips else 0
            last[0, lane] = own - 1
            model = owner[clip]
            own_constant[:, lane], own_stay[:, lane], own_move[:, lane] = constant[model], stay[model], move[model]
            for i in range(n_states):
                for d in range(n_features):
                    own_weight[i, d, lane] = weight[model, i, d]
                    own_shift[i, d, lane] = shift[model, i, d]
            first_row[lane], n_rows[lane] = begin[clip], own
        _gather(frames, first_row, n_rows, pivot, (n + ABREAST - 1) // ABREAST * ABREAST, block)
        _densities(n, block, own_weight, own_shift, own_constant, scores)
        forward(n, scores, own_stay, own_move, best, ratio)
        for lane in range(n_clips):
            end = length[group + lane] - 1
            own_likelihood[0, lane] = total(best[end], ratio[end], lane)
        posteriors(n, scores, own_stay, own_move, best, ratio, last, own_likelihood)
        _moments(n, block, best, own_occupied, own_first, own_second)
        for lane in range(n_clips):
            model, end = owner[group + lane], length[group + lane] - 1
            likelihood[model] += own_likelihood[0, lane]
            for i in range(n_states):
                occupied[model, i] += own_occupied[i, lane]
                ended[model, i] += best[end, i, lane]
                for d in range(n_features):
                    first[model, i, d] += own_first[i, d, lane]
                    second[model, i, d] += own_second[i, d, lane]


@njit
def score(
    frames: Floats, begin: Integers, length: Integers, pivot: Floats,
    weight: Floats, shift: Floats, constant: Floats, stay: Floats, move: Floats, found: Floats,
) -> None:  # fmt: skip
    """Write the log2-likelihood of each clip under each model to ``found`` (C, G * LANES).

    Parameters
    ----------
    frames, begin, length, pivot : see ``expect``.
    weight, shift : (G, S, D, LANES), and constant, stay, move : (G, S, LANES), the models in groups.
    """
    n_groups, n_states, n_features = weight.shape[0], weight.shape[1], weight.shape[2]
    padded = (length.max() + ABREAST - 1) // ABREAST * ABREAST
    block = np.zeros((padded, n_features))
    scores, best = np.empty((padded, n_states, LANES)), np.empty((padded, n_states, LANES))
    ratio = np.empty((padded, n_states, LANES))
    for clip in range(len(begin)):
        n = length[clip]
        for t in range(n):
            for d in range(n_features):
                block[t, d] = frames[begin[clip] + t, d] - pivot[d]
        for group in range(n_groups):
            log_densities(n, block, weight[group], shift[group], constant[group], scores)
            forward(n, scores, stay[group], move[group], best, ratio)
            for lane in range(LANES):
                found[clip, group * LANES + lane] = total(best[n - 1], ratio[n - 1], lane)
