"""The most likely states of a parallel HMM, decided a fixed number of frames after they are heard (Viterbi).

With a lag of at least the length of the sequence, the states are those of the most likely path. With a shorter lag,
the state of a frame is the one on the path that is most likely when the last frame of the lag has been heard, so that
successive states need not form one path; from a lag of a few segments on, they nearly always do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.parallel import flat

IMPOSSIBLE = -math.inf


class Memory(NamedTuple):
    """What is remembered of the frames that were heard.

    Attributes
    ----------
    score : (S,) log-probability of the best path to each state, relative to the best of all.
    came : (max(lag, 1), S) the state before each state on its best path, of the last frames, in a ring.
    clock : (1,) number of frames.
    total : (1,) log-probability of the best path.
    """

    score: Floats
    came: Integers
    clock: Integers
    total: Floats


@njit
def _enter(density: Floats, entry: Floats, stay: Floats, leave: Floats, memory: Memory, before: Floats) -> None:
    """Extend the best paths by a frame with log-densities (S,); ``before`` (S,) is overwritten."""
    score, came, clock, total = memory
    n_branches, n_states = len(entry), len(stay)
    row = came[clock[0] % len(came)]
    node, last = 0.0, 0
    if clock[0] > 0:
        node = IMPOSSIBLE
        for s in range(n_states - n_branches, n_states):
            if score[s] + leave[s] > node:
                node, last = score[s] + leave[s], s
    for s in range(n_states):
        before[s] = score[s]
    best = IMPOSSIBLE
    for s in range(n_states):
        value, origin = before[s] + stay[s], s
        arriving = node + entry[s] if s < n_branches else before[s - n_branches] + leave[s - n_branches]
        if arriving > value:
            value, origin = arriving, last if s < n_branches else s - n_branches
        score[s], row[s] = value + density[s], origin
        best = max(best, score[s])
    for s in range(n_states):
        score[s] -= best
    total[0] += best
    clock[0] += 1


@njit
def _origin(memory: Memory, steps: int) -> int:
    """Return the state that the best path was in ``steps`` frames before the last frame."""
    state = int(memory.score.argmax())
    for j in range(steps):
        state = memory.came[(memory.clock[0] - 1 - j) % len(memory.came), state]
    return state


@njit
def _hear(
    densities: Floats, entry: Floats, stay: Floats, leave: Floats, lag: int, memory: Memory, states: Integers
) -> int:
    """Extend the best paths by frames (T, S), fill ``states`` with those decided, and return their number."""
    before, n = np.empty(len(stay)), 0
    for t in range(len(densities)):
        _enter(densities[t], entry, stay, leave, memory, before)
        if memory.clock[0] > lag:
            states[n] = _origin(memory, lag)
            n += 1
    return n


@njit
def _trace(memory: Memory, states: Integers) -> None:
    """Fill ``states`` with the last ones of the best path."""
    state = int(memory.score.argmax())
    for j in range(len(states)):
        states[len(states) - 1 - j] = state
        state = memory.came[(memory.clock[0] - 1 - j) % len(memory.came), state]


class FixedLag:
    """The states of a sequence, decided ``lag`` frames late.

    Parameters
    ----------
    entry, stay : (M,) and (M, N) probabilities of a parallel HMM; state s = n * M + m is the n-th of branch m.
    lag : number of frames, at least 0.
    """

    def __init__(self, entry: Floats, stay: Floats, lag: int) -> None:
        with np.errstate(divide="ignore"):
            self._chain = np.log(entry), np.log(flat(stay)), np.log1p(-flat(stay))
        self._lag = lag
        n_states = stay.size
        self.memory = Memory(
            np.full(n_states, IMPOSSIBLE),
            np.zeros((max(lag, 1), n_states), dtype=np.int64),
            np.zeros(1, dtype=np.int64),
            np.zeros(1),
        )

    def hear(self, densities: Floats) -> Integers:
        """Return the states that become certain with frames of log-densities (T, S); at the start, fewer than T."""
        states = np.empty(len(densities), dtype=np.int64)
        return states[: _hear(densities, *self._chain, self._lag, self.memory, states)]

    def end(self) -> Integers:
        """Return the states of the last ``lag`` frames, or of all if there are fewer."""
        states = np.empty(min(self._lag, int(self.memory.clock[0])), dtype=np.int64)
        _trace(self.memory, states)
        return states


def best_path(entry: Floats, stay: Floats, densities: Floats) -> tuple[Integers, float]:
    """Return the states (T,) of the most likely path for log-densities (T, S), and its log-probability."""
    path = FixedLag(entry, stay, len(densities))
    path.hear(densities)
    return path.end(), float(path.memory.total[0])


def begins(states: Integers, n_branches: int) -> Flags:
    """Return whether a pass through a branch begins in each frame (T,).

    A pass of one frame through a branch of one state cannot be told from staying in it.
    """
    changed = np.append(True, states[1:] != states[:-1])
    return changed & (states < n_branches)
