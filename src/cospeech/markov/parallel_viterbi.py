"""Compiled decoding of the parallel HMM: the most likely path, without back pointers of states.

Each state carries the frame in which its best path entered the branch, and for each frame the best branch to leave
and its entry frame are stored: the path is traced back segment by segment. Notation and arguments are those of
``parallel_scaled``, except that ``entry``, ``stay`` and ``leave`` are logarithms to the base 2.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.lanes import LANES, each, first_lane, greater, greatest, put, take, where_greater
from cospeech.markov.parallel_density import BLOCK, bar, load, log_densities
from cospeech.markov.parallel_scaled import FREE, MUST, NEVER, Cuts

IMPOSSIBLE = -math.inf


@njit
def _place(values: Floats, value: float) -> int:
    """Return the index of the first ``value`` in an array of vectors, 0 if there is none."""
    for v in range(len(values)):
        lane = first_lane(take(values, (v,)), value)
        if lane < LANES:
            return v * LANES + lane
    return 0


@njit
def _advance(
    start: int, n: int, cuts: Cuts, density: Floats, entry: Floats, stay: Floats, leave: Floats, node: float,
    score: Floats, since: Floats, exits: Integers,
) -> float:  # fmt: skip
    """Advance ``score`` and ``since`` (V, LANES) through a block of n frames; in a tie, a path stays in its state.

    Parameters
    ----------
    node : score of the node before the block.
    since : origin of the best path to each state: the frame in which it entered its branch, times the number of
        lanes, plus the branch.
    exits : (n,), filled with the origin of the path that is best left after each frame.

    Returns
    -------
    Score of the node after the block.
    """
    n_vectors, n_groups = len(stay), len(entry)
    n_lanes = n_groups * LANES
    leaving, numbers = np.empty((n_groups, LANES)), np.arange(n_lanes * 1.0).reshape(n_groups, LANES)
    last = since[n_vectors - n_groups :].reshape(-1)
    for k in range(n):
        t = start + k
        cut = cuts[t] if len(cuts) > 0 and t > 0 else FREE
        if cut == MUST:
            score[:] = IMPOSSIBLE
        if cut == NEVER:
            node = IMPOSSIBLE
        best = each(IMPOSSIBLE)
        for g in range(n_groups):
            # From the last state to the first, which needs the node, whose maximum is ready by then.
            end = n_vectors - n_groups + g
            here, own = take(score, (end,)), take(since, (end,))
            for v in range(end, g, -n_groups):
                earlier, entered = take(score, (v - n_groups,)), take(since, (v - n_groups,))
                kept, moved = here + take(stay, (v,)), earlier + take(leave, (v - n_groups,))
                put(score, (v,), greater(moved, kept) + take(density, (k, v)))
                put(since, (v,), where_greater(moved, kept, entered, own))
                here, own = earlier, entered
            kept, moved = here + take(stay, (g,)), node + take(entry, (g,))
            put(score, (g,), greater(moved, kept) + take(density, (k, g)))
            put(since, (g,), where_greater(moved, kept, take(numbers, (g,)) + float(t * n_lanes), own))
            value = take(score, (end,)) + take(leave, (end,))
            put(leaving, (g,), value)
            best = greater(value, best)
        node = greatest(best)
        exits[k] = int(last[_place(leaving, node)])
    return node


@njit
def decode(
    frames: Floats, allowed: Flags, cuts: Cuts, entry: Floats, stay: Floats, leave: Floats,
    weight: Floats, shift: Floats, constant: Floats, pivot: Floats, branch: Integers, begins: Flags,
) -> float:  # fmt: skip
    """Fill the best ``branch`` (T,) and whether a segment ``begins`` (T,) in each frame; return the log2 score.

    Until the path is traced back, ``branch`` holds the exits (see ``_advance``).
    """
    n_frames, n_lanes = len(frames), entry.size
    block, density = np.zeros((BLOCK, len(pivot))), np.empty((BLOCK, *stay.shape))
    score, since = np.full(stay.shape, IMPOSSIBLE), np.zeros(stay.shape)
    node = 0.0
    for start in range(0, n_frames, BLOCK):
        n = load(frames, start, pivot, block)
        log_densities(n, block, weight, shift, constant, density)
        bar(start, n, allowed, density, IMPOSSIBLE)
        node = _advance(start, n, cuts, density, entry, stay, leave, node, score, since, branch[start : start + n])
    highest = score.max()
    begins[:] = False
    end, last = n_frames, int(since.reshape(-1)[_place(score, highest)])
    while highest > IMPOSSIBLE:
        start, m = last // n_lanes, last % n_lanes
        last = branch[start - 1]
        branch[start:end] = m
        begins[start] = True
        if start == 0:
            break
        end = start
    return highest
