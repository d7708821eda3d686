"""The posterior probabilities of the states of a parallel HMM, a fixed number of frames after they are heard.

The forward pass goes on with every frame; the backward pass begins again with each, ``lag`` frames after the one
whose probabilities it completes. With a lag of at least the length of the sequence, this is the forward-backward
algorithm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.parallel import flat


class Memory(NamedTuple):
    """The last lag + 1 frames, in rings: ``densities`` and forward probabilities ``alphas`` (lag + 1, S).

    ``clock`` (1,) is the number of frames.
    """

    densities: Floats
    alphas: Floats
    clock: Integers


@njit
def _enter(density: Floats, entry: Floats, stay: Floats, leave: Floats, memory: Memory) -> None:
    """Move the forward probabilities to a frame with densities (S,)."""
    densities, alphas, clock = memory
    n_branches, n_states, size = len(entry), len(stay), len(alphas)
    before, after = alphas[(clock[0] - 1) % size], alphas[clock[0] % size]
    node, total = 1.0, 0.0
    if clock[0] > 0:
        node = 0.0
        for s in range(n_states - n_branches, n_states):
            node += before[s] * leave[s]
    # From the last state to the first, because with a lag of 0 the two are the same row.
    for s in range(n_states - 1, -1, -1):
        arriving = node * entry[s] if s < n_branches else before[s - n_branches] * leave[s - n_branches]
        after[s] = (before[s] * stay[s] + arriving) * density[s]
        total += after[s]
    for s in range(n_states):
        after[s] /= total
        densities[clock[0] % size, s] = density[s]
    clock[0] += 1


@njit
def _back(row: Floats, entry: Floats, stay: Floats, leave: Floats, beta: Floats) -> None:
    """Move the backward probabilities (S,) to the frame before one with densities ``row`` (S,); they sum to 1."""
    n_branches, n_states = len(entry), len(stay)
    node, total = 0.0, 0.0
    for s in range(n_states):
        beta[s] *= row[s]
    for s in range(n_branches):
        node += entry[s] * beta[s]
    for s in range(n_states):
        following = node if s >= n_states - n_branches else beta[s + n_branches]
        beta[s] = stay[s] * beta[s] + leave[s] * following
        total += beta[s]
    for s in range(n_states):
        beta[s] /= total


@njit
def _believe(alpha: Floats, beta: Floats, belief: Floats) -> None:
    """Fill ``belief`` (S,) with the product of forward and backward probabilities, scaled to the sum 1."""
    total = 0.0
    for s in range(len(belief)):
        belief[s] = alpha[s] * beta[s]
        total += belief[s]
    for s in range(len(belief)):
        belief[s] /= total


@njit
def _hear(densities: Floats, entry: Floats, stay: Floats, leave: Floats, memory: Memory, beliefs: Floats) -> int:
    """Go on by frames (T, S), fill ``beliefs`` with those that are complete, and return their number."""
    size, n, beta = len(memory.alphas), 0, np.empty(len(stay))
    for t in range(len(densities)):
        _enter(densities[t], entry, stay, leave, memory)
        last = memory.clock[0] - 1
        if last >= size - 1:
            beta[:] = 1.0
            for j in range(size - 1):
                _back(memory.densities[(last - j) % size], entry, stay, leave, beta)
            _believe(memory.alphas[(last - size + 1) % size], beta, beliefs[n])
            n += 1
    return n


@njit
def _end(entry: Floats, stay: Floats, leave: Floats, memory: Memory, beliefs: Floats) -> None:
    """Fill ``beliefs`` (n, S) with those of the last n frames."""
    size, beta = len(memory.alphas), np.ones(len(stay))
    for j in range(len(beliefs)):
        row = (memory.clock[0] - 1 - j) % size
        _believe(memory.alphas[row], beta, beliefs[len(beliefs) - 1 - j])
        _back(memory.densities[row], entry, stay, leave, beta)


class FixedLagBeliefs:
    """The posterior probabilities of the states of a sequence, ``lag`` frames late.

    Parameters
    ----------
    entry, stay : (M,) and (M, N) probabilities of a parallel HMM; state s = n * M + m is the n-th of branch m.
    lag : number of frames, at least 0.
    """

    def __init__(self, entry: Floats, stay: Floats, lag: int) -> None:
        self._chain = entry, flat(stay), 1.0 - flat(stay)
        densities, alphas = np.zeros((2, lag + 1, stay.size))
        self._memory = Memory(densities, alphas, np.zeros(1, dtype=np.int64))

    def hear(self, densities: Floats) -> Floats:
        """Return the probabilities (n, S) that are complete with frames of positive densities (T, S)."""
        beliefs = np.empty_like(densities)
        return beliefs[: _hear(densities, *self._chain, self._memory, beliefs)]

    def end(self) -> Floats:
        """Return the probabilities of the last ``lag`` frames, or of all if there are fewer."""
        _, alphas, clock = self._memory
        beliefs = np.empty((min(len(alphas) - 1, int(clock[0])), alphas.shape[1]))
        _end(*self._chain, self._memory, beliefs)
        return beliefs
