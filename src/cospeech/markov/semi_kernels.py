"""Compiled recursions of the hidden semi-Markov model; ``semi`` is their face.

Conventions: S states, D duration bins (bin k - 1 is a phrase of k frames), T frames; everything is a logarithm,
float64. With E the running sum of the weighted log emissions of a state, a phrase of state j over frames [s, t)
is worth ``entry[j, s] - E[j, s] + log d_j(t - s) + E[j, t]``: its first two terms, the *offer* of a start frame s,
do not know t, and its last does not know s. What is left to maximise over s (or to sum) is offer plus duration.

The best end frames are found by pushing: as soon as an offer is known it is laid against all end frames that
it can reach, which are neighbours in memory and so become lanes, whereas a maximum over durations for one end
frame does not vectorise. Offers are pushed BLOCK at a time, so that an end frame is read and written once a block.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int64]

BLOCK = 8


@numba.njit(cache=True)
def _push(best: Any, offer: Any, durations: Any, lanes: int) -> None:
    """Lay BLOCK offers against ``lanes`` end frames, the first of them right behind the block's last start.

    best : (lanes,) best sum so far of each end frame, updated. offer : (BLOCK,). durations : (>= lanes + BLOCK - 1,).
    """
    o0, o1, o2, o3, o4, o5, o6, o7 = (
        offer[0], offer[1], offer[2], offer[3], offer[4], offer[5], offer[6], offer[7],
    )  # fmt: skip
    d0 = durations[7 : 7 + lanes]
    d1 = durations[6 : 6 + lanes]
    d2 = durations[5 : 5 + lanes]
    d3 = durations[4 : 4 + lanes]
    d4 = durations[3 : 3 + lanes]
    d5 = durations[2 : 2 + lanes]
    d6 = durations[1 : 1 + lanes]
    d7 = durations[0:lanes]
    for t in range(lanes):
        x0, x1, x2, x3 = o0 + d0[t], o1 + d1[t], o2 + d2[t], o3 + d3[t]
        x4, x5, x6, x7 = o4 + d4[t], o5 + d5[t], o6 + d6[t], o7 + d7[t]
        x0 = x0 if x0 > x1 else x1
        x2 = x2 if x2 > x3 else x3
        x4 = x4 if x4 > x5 else x5
        x6 = x6 if x6 > x7 else x7
        x0 = x0 if x0 > x2 else x2
        x4 = x4 if x4 > x6 else x6
        x0 = x0 if x0 > x4 else x4
        best[t] = x0 if x0 > best[t] else best[t]


@numba.njit(cache=True)
def viterbi(
    initial: Float, transitions: Float, durations: Float, last: Float, emissions: Float, observations: Int
) -> tuple[float, Int, Int]:
    """Return the best path: its log score, the first frames of its phrases and their states.

    Parameters
    ----------
    initial : (S,). transitions : (S, S), from row to column. durations : (S, D).
    last : (S, D), what the last phrase uses in place of ``durations``.
    emissions : (S, K), weighted and finite. observations : (T,) in 0 ... K - 1.

    Notes
    -----
    No back pointers are kept: the traceback repeats the maximisation at the ends of the phrases of the best path
    only. Among equals the shortest duration and then the first state win.
    """
    n_states, n_bins = durations.shape
    n_frames = len(observations)
    padded = np.full((n_states, n_bins + BLOCK), -np.inf)
    padded[:, :n_bins] = durations
    best = np.full((n_states, n_frames + n_bins + 2 * BLOCK), -np.inf)
    offer = np.full((n_states, n_frames + BLOCK), -np.inf)
    emitted = np.zeros(n_states)

    for first in range(0, n_frames, BLOCK):
        beyond = first + BLOCK
        for s in range(first, min(beyond, n_frames)):
            for j in range(n_states):
                best[j, s] += emitted[j]  # from here on the score of the best path with a phrase of j ending at s
            for j in range(n_states):
                entry = initial[j]
                if s > 0:
                    entry = -np.inf
                    for i in range(n_states):
                        entry = max(entry, best[i, s] + transitions[i, j])
                offer[j, s] = entry - emitted[j]
                for t in range(s + 1, beyond):
                    best[j, t] = max(best[j, t], offer[j, s] + padded[j, t - s - 1])
            for j in range(n_states):
                emitted[j] += emissions[j, observations[s]]
        for j in range(n_states):
            _push(best[j, beyond : beyond + n_bins], offer[j, first:beyond], padded[j], n_bins)

    score = -np.inf
    state = 0
    length = 0
    for j in range(n_states):
        for k in range(1, min(n_bins, n_frames) + 1):
            candidate = offer[j, n_frames - k] + last[j, k - 1] + emitted[j]
            if candidate > score:
                score, state, length = candidate, j, k
    starts = np.empty(n_frames, dtype=np.int64)
    states = np.empty(n_frames, dtype=np.int64)
    n_phrases = 0
    end = n_frames
    while length > 0:
        start = end - length
        starts[n_phrases] = start
        states[n_phrases] = state
        n_phrases += 1
        end = start
        length = 0
        if end > 0:
            state = _argmax_column(best[:, end], transitions, state)
            length = _best_length(offer[state], durations[state], end)
    return score, starts[:n_phrases][::-1].copy(), states[:n_phrases][::-1].copy()


@numba.njit(cache=True)
def _argmax_column(scores: Any, transitions: Float, state: int) -> int:
    """Return the first state i with the largest ``scores[i] + transitions[i, state]``."""
    found = 0
    for i in range(1, len(scores)):
        if scores[i] + transitions[i, state] > scores[found] + transitions[found, state]:
            found = i
    return found


@numba.njit(cache=True)
def _best_length(offer: Any, durations: Any, end: int) -> int:
    """Return the shortest length of a phrase that ends at ``end`` with the largest offer plus duration."""
    found = 1
    for k in range(2, min(len(durations), end) + 1):
        if offer[end - k] + durations[k - 1] > offer[end - found] + durations[found - 1]:
            found = k
    return found


@numba.njit(cache=True)
def _log_sum(terms: Any) -> float:
    """Return log sum exp of ``terms``, minus infinity where all are."""
    largest = terms[0]
    for x in terms:
        largest = max(largest, x)
    if largest == -np.inf:
        return -np.inf
    total = 0.0
    for x in terms:
        total += np.exp(x - largest)
    return largest + np.log(total)


@numba.njit(cache=True)
def forward(
    initial: Float, transitions: Float, durations: Float, last: Float, emissions: Float, observations: Int
) -> tuple[float, Float, Float]:
    """Return the log of the summed score of all paths, and what a backward draw needs (arguments: see ``viterbi``).

    Returns
    -------
    log_likelihood : of the observations, where the emission weight is 1.
    ending : (S, T), log of the summed score of all paths over [0, t) with a phrase of the state ending at t.
    offer : (S, T), log of the summed score of all paths that begin a phrase at s, less the emissions up to s.
    """
    n_states, n_bins = durations.shape
    n_frames = len(observations)
    ending = np.full((n_states, n_frames), -np.inf)
    offer = np.empty((n_states, n_frames))
    emitted = np.zeros(n_states)
    terms = np.empty(max(n_bins, n_states))
    for s in range(n_frames):
        longest = min(n_bins, s)
        if s > 0:
            for j in range(n_states):
                for k in range(1, longest + 1):
                    terms[k - 1] = offer[j, s - k] + durations[j, k - 1]
                ending[j, s] = emitted[j] + _log_sum(terms[:longest])
        for j in range(n_states):
            entry = initial[j]
            if s > 0:
                for i in range(n_states):
                    terms[i] = ending[i, s] + transitions[i, j]
                entry = _log_sum(terms[:n_states])
            offer[j, s] = entry - emitted[j]
        for j in range(n_states):
            emitted[j] += emissions[j, observations[s]]
    total = np.empty(n_states)
    longest = min(n_bins, n_frames)
    for j in range(n_states):
        for k in range(1, longest + 1):
            terms[k - 1] = offer[j, n_frames - k] + last[j, k - 1]
        total[j] = emitted[j] + _log_sum(terms[:longest])
    return _log_sum(total), ending, offer


@numba.njit(cache=True)
def _draw(terms: Any, uniform: float) -> int:
    """Return the index that ``uniform`` in [0, 1) picks from the probabilities proportional to exp(terms)."""
    threshold = uniform * np.exp(_log_sum(terms) - terms.max())
    total = 0.0
    drawn = 0
    for index in range(len(terms)):
        weight = np.exp(terms[index] - terms.max())
        if weight > 0.0:
            drawn = index
            total += weight
            if total > threshold:
                break
    return drawn


@numba.njit(cache=True)
def draw(
    ending: Float, offer: Float, transitions: Float, durations: Float, last: Float, emitted: Float, uniforms: Float
) -> tuple[Int, Int]:
    """Return the first frames and states of a path drawn from the posterior by a backward pass over ``forward``.

    emitted : (S,), weighted log emissions of the whole record.
    uniforms : (T + 1, 2) in [0, 1), one pair for each frame that a phrase may end at.
    """
    n_states, n_frames = offer.shape
    n_bins = durations.shape[1]
    starts = np.empty(n_frames, dtype=np.int64)
    states = np.empty(n_frames, dtype=np.int64)
    terms = np.empty(n_bins)
    by_state = np.empty(n_states)
    longest = min(n_bins, n_frames)
    for j in range(n_states):
        for k in range(1, longest + 1):
            terms[k - 1] = offer[j, n_frames - k] + last[j, k - 1]
        by_state[j] = emitted[j] + _log_sum(terms[:longest])
    lengths = last
    n_phrases = 0
    end = n_frames
    while end > 0:
        if end < n_frames:
            for i in range(n_states):
                by_state[i] = ending[i, end] + transitions[i, states[n_phrases - 1]]
        state = _draw(by_state, uniforms[end, 0])
        longest = min(n_bins, end)
        for k in range(1, longest + 1):
            terms[k - 1] = offer[state, end - k] + lengths[state, k - 1]
        end -= _draw(terms[:longest], uniforms[end, 1]) + 1
        lengths = durations
        starts[n_phrases] = end
        states[n_phrases] = state
        n_phrases += 1
    return starts[:n_phrases][::-1].copy(), states[:n_phrases][::-1].copy()
