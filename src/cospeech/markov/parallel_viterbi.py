"""Compiled decoding of the parallel HMM: the most likely path, without a back pointer for any state.

Each state carries the frame in which its best path entered the branch, and each frame keeps the best branch to leave
and that branch's entry: the path is read back segment by segment. Conventions and arguments are those of
``parallel_scaled``, but that ``entry``, ``stay`` and ``leave`` are logarithms to the base 2.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from cospeech.markov.parallel_density import BLOCK, PITCH, Bool, Float, copy, load, log_densities, turn
from cospeech.markov.parallel_scaled import FREE, MUST, NEVER, Cuts

Int = npt.NDArray[np.int64]

IMPOSSIBLE = -math.inf


@numba.njit(cache=True)
def _advance(
    before: Float, since: Int, density: Float, stay: Float, come: Float, after: Float, after_since: Int
) -> None:
    """Fill the states of ``after`` and ``after_since`` from the frame before; on a tie a path stays where it is.

    Rows are (M + S,): the first M places stand before the first states and hold what comes to them from the node.
    """
    n_branches = len(before) - len(stay)
    states, to = before[n_branches:], after[n_branches:]
    states_since, to_since = since[n_branches:], after_since[n_branches:]
    for s in range(len(stay)):
        kept, moved = states[s] + stay[s], before[s] + come[s]
        to[s] = (moved if moved > kept else kept) + density[s]
    # The same comparison again, with both values read before it: so two short loops become vector code.
    for s in range(len(stay)):
        own, new = states_since[s], since[s]
        kept, moved = states[s] + stay[s], before[s] + come[s]
        to_since[s] = new if moved > kept else own


@numba.njit(cache=True)
def decode(
    frames: Float, allowed: Bool, cuts: Cuts, entry: Float, stay: Float, leave: Float,
    weight: Float, shift: Float, constant: Float, pivot: Float, branch: Int, begins: Bool,
) -> float:  # fmt: skip
    """Fill the best ``branch`` (T,) and whether a segment ``begins`` (T,) in a frame; return the log2 score."""
    n_frames, n_states, n_branches = len(frames), len(stay), len(entry)
    block, rows, top = np.zeros((weight.shape[1], BLOCK)), np.empty((n_states, PITCH)), np.empty(BLOCK)
    density, come = np.empty((BLOCK, n_states)), np.zeros(n_states)
    copy(leave[: n_states - n_branches], come[n_branches:])
    last = leave[n_states - n_branches :]
    before, after = np.full(n_branches + n_states, IMPOSSIBLE), np.empty(n_branches + n_states)
    since, after_since = np.zeros(len(before), np.int64), np.zeros(len(before), np.int64)
    exit_branch, exit_since = np.empty(n_frames, np.int32), np.empty(n_frames, np.int64)
    for start in range(0, n_frames, BLOCK):
        n = load(frames, start, pivot, block)
        log_densities(block, n, start, allowed, weight, shift, constant, rows, top)
        turn(rows, density)
        for k in range(n):
            t = start + k
            node, best = 0.0, 0
            if t > 0:
                node = IMPOSSIBLE
                for m in range(n_branches):
                    value = before[n_states + m] + last[m]
                    if value > node:
                        node, best = value, m
                exit_branch[t - 1], exit_since[t - 1] = best, since[n_states + best]
            cut = cuts[t] if len(cuts) > 0 and t > 0 else FREE
            for m in range(n_branches):
                before[m] = IMPOSSIBLE if cut == NEVER else node + entry[m]
                since[m] = t
            if cut == MUST:
                before[n_branches:] = IMPOSSIBLE
            _advance(before, since, density[k], stay, come, after, after_since)
            before, after, since, after_since = after, before, after_since, since
    final = n_branches
    for s in range(n_branches, len(before)):
        if before[s] > before[final]:
            final = s
    begins[:] = False
    end, m, start = n_frames, (final - n_branches) % n_branches, since[final]
    while True:
        branch[start:end] = m
        begins[start] = True
        if start == 0:
            return before[final]
        end = start
        m, start = exit_branch[end - 1], exit_since[end - 1]
