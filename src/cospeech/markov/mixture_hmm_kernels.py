"""Compiled densities, expected counts and decoding of mixture HMMs; ``mixture_hmm`` is their interface.

The components of all states of a model are numbered state by state: state i of K components each has those from i K
on.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit


@njit
def _weighted_log_densities(frame: Floats, mean: Floats, halved: Floats, constant: Floats, found: Floats) -> None:
    """Write the log of weight times density of each component, (C,)."""
    found[:] = constant
    for d in range(len(frame)):
        for c in range(len(found)):
            offset = frame[d] - mean[d, c]
            found[c] -= offset * offset * halved[d, c]


@njit
def _log_sum(values: Floats) -> float:
    largest = values.max()
    if largest == -math.inf:
        return -math.inf
    total = 0.0
    for value in values:
        total += math.exp(value - largest)
    return largest + math.log(total)


@njit
def log_densities(frames: Floats, mean: Floats, halved: Floats, constant: Floats, found: Floats) -> None:
    """Write the log density of each frame in each state, (T, S).

    Parameters
    ----------
    frames : (T, D).
    mean, halved : (D, C) means of the components, and halves of their inverse variances.
    constant : (C,) log of weight times density at the mean.
    """
    n_states = found.shape[1]
    own = np.empty(len(constant))
    n_components = len(constant) // n_states
    for t in range(len(frames)):
        _weighted_log_densities(frames[t], mean, halved, constant, own)
        for i in range(n_states):
            found[t, i] = _log_sum(own[i * n_components : (i + 1) * n_components])


@njit
def _log_add(one: float, other: float) -> float:
    largest = max(one, other)
    return largest if largest == -math.inf else largest + math.log1p(math.exp(-abs(one - other)))


@njit
def beliefs(scores: Floats, stay: Floats, leave: Floats, found: Floats) -> float:
    """Write P(q_t = i | clip), (T, S), of a clip with log densities (T, S), and return its log-likelihood.

    The clip begins in the first state and ends by leaving the last one.

    Parameters
    ----------
    stay, leave : (S,) log-probabilities of staying in a state and of leaving it.
    """
    n_frames, n_states = scores.shape
    forward = np.full((n_frames, n_states), -np.inf)
    forward[0, 0] = scores[0, 0]
    for t in range(1, n_frames):
        forward[t, 0] = forward[t - 1, 0] + stay[0] + scores[t, 0]
        for i in range(1, n_states):
            forward[t, i] = _log_add(forward[t - 1, i] + stay[i], forward[t - 1, i - 1] + leave[i - 1]) + scores[t, i]
    total = forward[n_frames - 1, n_states - 1] + leave[n_states - 1]
    ahead = np.full(n_states, -np.inf)
    ahead[n_states - 1] = leave[n_states - 1]
    for t in range(n_frames - 1, -1, -1):
        for i in range(n_states):
            found[t, i] = math.exp(forward[t, i] + ahead[i] - total)
        for i in range(n_states):  # in place: state i + 1 is still that of the later frame
            own = ahead[i] + stay[i] + scores[t, i]
            if i + 1 < n_states:
                own = _log_add(own, ahead[i + 1] + leave[i] + scores[t, i + 1])
            ahead[i] = own
    return float(total)


@njit
def expect(
    frames: Floats,
    begin: Integers,
    length: Integers,
    stay: Floats,
    leave: Floats,
    mean: Floats,
    halved: Floats,
    constant: Floats,
    occupied: Floats,
    first: Floats,
    second: Floats,
) -> float:
    """Add the expected counts of clips, and return their log-likelihood.

    Parameters
    ----------
    frames, begin, length : the clips, as in ``word_hmm.Clips``.
    occupied : (C,) frames of each component.
    first, second : (D, C) sums of the frames minus the mean of the component, and of their squares.
    """
    n_states, n_components = len(stay), len(constant) // len(stay)
    total = 0.0
    for clip in range(len(begin)):
        own = np.empty((length[clip], len(constant)))
        scores, visited = np.empty((length[clip], n_states)), np.empty((length[clip], n_states))
        for t in range(length[clip]):
            _weighted_log_densities(frames[begin[clip] + t], mean, halved, constant, own[t])
            for i in range(n_states):
                scores[t, i] = _log_sum(own[t, i * n_components : (i + 1) * n_components])
        total += beliefs(scores, stay, leave, visited)
        for t in range(length[clip]):
            share = own[t]
            for c in range(len(share)):
                i = c // n_components
                share[c] = visited[t, i] * math.exp(share[c] - scores[t, i])
                occupied[c] += share[c]
            for d in range(len(mean)):
                for c in range(len(share)):
                    offset = frames[begin[clip] + t, d] - mean[d, c]
                    first[d, c] += share[c] * offset
                    second[d, c] += share[c] * offset * offset
    return total


@njit
def decode(
    scores: Floats, start: Integers, end: Integers, prior: Floats, stay: Floats, leave: Floats,
    branch: Integers, begins: Flags,
) -> float:  # fmt: skip
    """Write the most likely sequence of models, and return the log of its joint probability with the frames.

    Parameters
    ----------
    scores : (T, S) log densities of the states of all models, one model after the other.
    start, end : (M,) index of the first and the last state of each model.
    prior : (M,) log-probability of each model after any other one.
    stay, leave : (S,) log-probabilities of staying in a state and of leaving it.
    branch, begins : (T,) model of each frame, and whether a pass through it begins there.
    """
    n_frames, n_states = scores.shape
    n_models = len(start)
    best = np.full(n_states, -np.inf)
    moved = np.zeros((n_frames, n_states), dtype=np.bool_)
    ended = np.zeros(n_frames + 1, dtype=np.int64)  # the model that ends best just before each frame
    entry = 0.0
    for t in range(n_frames):
        for m in range(n_models):
            for i in range(end[m], start[m] - 1, -1):  # downwards: state i - 1 is still that of the last frame
                kept = best[i] + stay[i]
                come = entry + prior[m] if i == start[m] else best[i - 1] + leave[i - 1]
                moved[t, i] = come > kept
                best[i] = max(come, kept) + scores[t, i]
        entry = -np.inf
        for m in range(n_models):
            out = best[end[m]] + leave[end[m]]
            if out > entry:
                entry, ended[t + 1] = out, m
    model = ended[n_frames]
    state = end[model]
    for t in range(n_frames - 1, -1, -1):
        branch[t] = model
        begins[t] = moved[t, state] and state == start[model]
        if begins[t]:
            model = ended[t]
            state = end[model]
        elif moved[t, state]:
            state -= 1
    return float(entry)
