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

from cospeech.markov.parallel_density import BLOCK, PITCH, Bool, Float, load, log_densities, turn
from cospeech.markov.parallel_scaled import FREE, MUST, NEVER, Cuts

Int = npt.NDArray[np.int64]

IMPOSSIBLE = -math.inf


@numba.njit(cache=True)
def _advance(
    score: Float, since: Int, density: Float, cut: int, t: int, node: float,
    entry: Float, stay: Float, leave: Float, after: Float, after_since: Int,
) -> None:  # fmt: skip
    """Fill scores and entry frames of frame t (S,) from those one frame before; on a tie a path stays where it is."""
    n_branches, n_states = len(entry), len(stay)
    last = n_states - n_branches
    opened = IMPOSSIBLE if cut == NEVER else node
    within = IMPOSSIBLE if cut == MUST else 0.0
    for s in range(n_branches):
        kept, entered = score[s] + stay[s] + within, opened + entry[s]
        after[s] = (entered if entered > kept else kept) + density[s]
        after_since[s] = t if entered > kept else since[s]
    came, left, here, held = score[:last], leave[:last], score[n_branches:], stay[n_branches:]
    came_since, here_since = since[:last], since[n_branches:]
    now, to, to_since = density[n_branches:], after[n_branches:], after_since[n_branches:]
    for s in range(last):
        kept, moved = here[s] + held[s], came[s] + left[s]
        to[s] = (moved if moved > kept else kept) + within + now[s]
        to_since[s] = came_since[s] if moved > kept else here_since[s]


@numba.njit(cache=True)
def decode(
    frames: Float, allowed: Bool, cuts: Cuts, entry: Float, stay: Float, leave: Float,
    weight: Float, shift: Float, constant: Float, pivot: Float, branch: Int, begins: Bool,
) -> float:  # fmt: skip
    """Fill the best ``branch`` (T,) and whether a segment ``begins`` (T,) in a frame; return the log2 score."""
    n_frames, n_states, n_branches = len(frames), len(stay), len(entry)
    last = n_states - n_branches
    block, rows, top = np.zeros((weight.shape[1], BLOCK)), np.empty((n_states, PITCH)), np.empty(BLOCK)
    density = np.empty((BLOCK, n_states))
    score, after = np.full(n_states, IMPOSSIBLE), np.empty(n_states)
    since, after_since = np.zeros(n_states, np.int64), np.empty(n_states, np.int64)
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
                    value = score[last + m] + leave[last + m]
                    if value > node:
                        node, best = value, m
                exit_branch[t - 1], exit_since[t - 1] = best, since[last + best]
            cut = cuts[t] if len(cuts) > 0 and t > 0 else FREE
            _advance(score, since, density[k], cut, t, node, entry, stay, leave, after, after_since)
            score, after, since, after_since = after, score, after_since, since
    final = 0
    for s in range(n_states):
        if score[s] > score[final]:
            final = s
    begins[:] = False
    end, m, start = n_frames, final % n_branches, since[final]
    while True:
        branch[start:end] = m
        begins[start] = True
        if start == 0:
            return score[final]
        end = start
        m, start = exit_branch[end - 1], exit_since[end - 1]
