"""Compiled recursions of the hidden semi-Markov model; ``semi`` is their face.

Conventions: S states, D duration bins (bin k - 1 is a phrase of k frames), T frames; everything is a logarithm,
float64. With E the running sum of the weighted log emissions of a state, a phrase of state j over frames [s, t)
is worth ``entry[j, s] - E[j, s] + log d_j(t - s) + E[j, t]``: its first two terms, the *offer* of a start frame s,
do not know t, and its last does not know s. What is left to maximise over s (or to sum) is offer plus duration.

The best end frames are found by pushing: as soon as an offer is known it is laid against all end frames that
it can reach, which are neighbours in memory and so become lanes, whereas a maximum over durations for one end
frame does not vectorise. Offers are pushed BLOCK at a time, so that an end frame is read and written once a block.
Of all frames the offers are kept and the state before them, one number and one byte for each state; of the sums only
a window.

Durations that were counted, and floored, are mostly one value, their least, but for a few bins that rise above it.
Then what all bins are worth at the least is a maximum of offers alone, which blocks share, and only what rises is
pushed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit

BLOCK = 8

SPAN = 1024
"""Frames after which the window of the end frames moves on; a multiple of ``BLOCK``."""

SPARSE = 4
"""Durations are sparse where less than one in so many rises above their least value."""

STRAY = 200.0
"""How far an offer may lie from its state's reference before that moves; exp(200) is far from the largest number."""

SMALLEST, LARGEST = 1e-200, 1e200
"""Range of a sum in which no part that matters can have been lost."""


@njit
def _push(best: Any, offer: Any, durations: Any, lanes: int) -> None:
    """Lay BLOCK offers against ``lanes`` end frames, the first of them right behind the block's last start.

    best : (lanes,) best sum so far of each end frame, updated. offer : (BLOCK,).
    durations : (>= lanes + BLOCK - 1,).
    """
    # Written out: a loop over the block inside the loop over the lanes would keep the compiler from using lanes.
    o0, o1, o2, o3 = offer[0], offer[1], offer[2], offer[3]
    o4, o5, o6, o7 = offer[4], offer[5], offer[6], offer[7]
    d0 = durations[7 : 7 + lanes]
    d1 = durations[6 : 6 + lanes]
    d2 = durations[5 : 5 + lanes]
    d3 = durations[4 : 4 + lanes]
    d4 = durations[3 : 3 + lanes]
    d5 = durations[2 : 2 + lanes]
    d6 = durations[1 : 1 + lanes]
    d7 = durations[0:lanes]
    for t in range(lanes):
        x = max(best[t], o0 + d0[t])
        x = max(x, o1 + d1[t])
        x = max(x, o2 + d2[t])
        x = max(x, o3 + d3[t])
        x = max(x, o4 + d4[t])
        x = max(x, o5 + d5[t])
        x = max(x, o6 + d6[t])
        best[t] = max(x, o7 + d7[t])


@njit
def _push_risen(window: Any, offer: Any, durations: Any, risen: Any, first: int) -> None:
    """Lay BLOCK offers, the first from frame ``first`` of ``window``, against the ends of the ``risen`` durations.

    window : sums so far, updated. offer : (BLOCK,). durations : (>= D,). risen : in frames.
    """
    for k in risen:
        lasting = durations[k - 1]
        for b in range(BLOCK):
            window[first + k + b] = max(window[first + k + b], offer[b] + lasting)


@njit
def _push_one(window: Any, offer: float, durations: Any, risen: Any, start: int, reach: int) -> None:
    """Lay one offer, from frame ``start`` of ``window``, against the ends of ``risen`` durations below ``reach``."""
    for k in risen:
        if k >= reach:
            break
        window[start + k] = max(window[start + k], offer + durations[k - 1])


@njit
def _push_greatest(greatest: Any, offer: Any) -> None:
    """Lay the greatest of BLOCK offers against the blocks of end frames that all of them can reach."""
    best = offer[0]
    for value in offer:
        best = max(best, value)
    for b in range(len(greatest)):
        greatest[b] = max(greatest[b], best)


@njit
def _take_least(
    window: Any, offer: Any, greatest: float, n_whole: int, n_bins: int, least: float, first: int
) -> None:
    """Lay what offers before the block are worth at the ``least`` duration against its end frames, (BLOCK,).

    offer : (>= first,). greatest : the best of the ``n_whole`` blocks before, whose offers reach all these frames;
        the others reach some.
    """
    s = max(0, first - n_whole * BLOCK)
    for b in range(BLOCK - 1, -1, -1):
        while s > max(0, first + b - n_bins):
            s -= 1
            greatest = max(greatest, offer[s])
        window[b] = max(window[b], greatest + least)


@njit
def _slide(window: Floats) -> None:
    """Move ``window`` SPAN frames on: what it held of later frames comes forward, behind it nothing is known."""
    kept = window.shape[1] - SPAN
    for j in range(len(window)):
        for c in range(kept):
            window[j, c] = window[j, c + SPAN]
        window[j, kept:] = -np.inf


@njit
def best_scores(
    initial: Floats,
    transitions: Floats,
    durations: Floats,
    risen: Integers,
    n_risen: Integers,
    emissions: Floats,
    observations: Integers,
    offer: Floats,
    emitted: Floats,
    before: Any,
) -> None:
    """Find the best paths over [0, t) for all t (Özkul 2012, eq. 5.9).

    Parameters
    ----------
    initial : (S,). transitions : (S, S), from row to column. durations : (S, D + BLOCK), ending in -inf.
    risen : (S, R) the durations, in frames, that are worth more than the least. n_risen : (S,) how many these are;
        -1 where they are too many to be looked at one by one.
    emissions : (S, K), weighted and finite. observations : (T,) in 0 ... K - 1.
    offer : (S, T + BLOCK) of -inf; becomes the score of the best path with a phrase of j that starts at t, less the
        emissions of j up to t.
    emitted : (S,) of 0; becomes the emissions of j over the whole record.
    before : (S, T) of integers; becomes the state before a phrase of j that starts at t.
    """
    n_states, n_frames = before.shape
    n_bins = durations.shape[1] - BLOCK
    # Best sums so far of the end frames from ``origin`` on: no other is asked for any more.
    ending, origin = np.full((n_states, SPAN + n_bins + BLOCK), -np.inf), 0
    worth, least, within = np.empty(n_states), np.empty(n_states), np.empty(n_states)
    n_whole = max(0, n_bins - BLOCK + 1) // BLOCK
    greatest = np.full((n_states, n_frames // BLOCK + 2 + n_whole), -np.inf)
    for j in range(n_states):
        least[j] = durations[j, :n_bins].min()
    for first in range(0, n_frames, BLOCK):
        if first - origin == SPAN:
            _slide(ending)
            origin += SPAN
        beyond = first + BLOCK
        for j in range(n_states):
            within[j] = -np.inf
            if n_risen[j] >= 0:
                ends = ending[j, first - origin : beyond - origin]
                _take_least(ends, offer[j], greatest[j, first // BLOCK], n_whole, n_bins, least[j], first)
        for s in range(first, min(beyond, n_frames)):
            for j in range(n_states):
                worth[j] = max(ending[j, s - origin], within[j] + least[j]) + emitted[j]
            for j in range(n_states):
                best, last = initial[j] if s == 0 else -np.inf, 0
                for i in range(n_states if s > 0 else 0):
                    x = worth[i] + transitions[i, j]
                    best, last = (x, i) if x > best else (best, last)
                before[j, s] = last
                start = offer[j, s] = best - emitted[j]
                emitted[j] += emissions[j, observations[s]]
                if n_risen[j] >= 0:
                    within[j] = max(within[j], start)
                    _push_one(ending[j], start, durations[j], risen[j, : n_risen[j]], s - origin, beyond - s)
                else:
                    for t in range(s + 1, beyond):
                        ending[j, t - origin] = max(ending[j, t - origin], start + durations[j, t - s - 1])
        reach = beyond - origin
        for j in range(n_states):
            pushed = offer[j, first:beyond]
            if n_risen[j] >= 0:
                _push_greatest(greatest[j, beyond // BLOCK : beyond // BLOCK + n_whole], pushed)
                _push_risen(ending[j], pushed, durations[j], risen[j, : n_risen[j]], first - origin)
            else:
                _push(ending[j, reach : reach + n_bins], pushed, durations[j], n_bins)


@njit
def trace_back(
    durations: Floats,
    last: Floats,
    offer: Floats,
    emitted: Floats,
    before: Any,
    starts: Integers,
    states: Integers,
) -> tuple[float, int]:
    """Write the phrases of the best path to the ends of ``starts`` and ``states``, (T,); return score and number.

    No durations are kept: the maximisation is repeated where a phrase of the best path ends, and nowhere else.
    Among equals the first state wins, then the shortest duration.

    Parameters
    ----------
    durations, last : (S, D), of any phrase and of the last one. Others : see ``best_scores``.
    """
    n_states, n_bins = durations.shape
    n_frames = len(starts)
    score = -np.inf
    state = length = n_phrases = 0
    for j in range(n_states):
        for k in range(1, min(n_bins, n_frames) + 1):
            x = offer[j, n_frames - k] + last[j, k - 1] + emitted[j]
            if x > score:
                score, state, length = x, j, k
    start = n_frames
    while length > 0:
        start -= length
        n_phrases += 1
        starts[n_frames - n_phrases] = start
        states[n_frames - n_phrases] = state
        length = 0
        if start > 0:
            state = int(before[state, start])
            best = -np.inf
            for k in range(1, min(n_bins, start) + 1):
                x = offer[state, start - k] + durations[state, k - 1]
                if x > best:
                    best, length = x, k
    return score, n_phrases


@njit
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


@njit
def summed_scores(
    initial: Floats,
    transitions: Floats,
    durations: Floats,
    emissions: Floats,
    observations: Integers,
    ending: Floats,
    offer: Floats,
    emitted: Floats,
    sums: Floats,
) -> None:
    """Fill in the summed scores of all paths over [0, t): as ``best_scores``, with log sum exp in place of max.

    Parameters
    ----------
    durations : (S, D). ending, offer : (S, T). Others : see ``best_scores``.
    sums : (S, T + D) of 0, for the sum over starts of exp(offer + duration) of every end frame; overwritten.

    Notes
    -----
    An offer is pushed, to become lanes, in probabilities: exp(offer - reference) times those of the durations. The
    reference of a state follows its offers, and what was summed is scaled along. An end frame whose sum left the
    range in which nothing can have been lost is summed again in logarithms.
    """
    n_states, n_frames = offer.shape
    n_bins = durations.shape[1]
    lasting = np.exp(durations)
    reference = np.full(n_states, -np.inf)
    terms = np.empty(max(n_bins, n_states))
    for s in range(n_frames):
        if s > 0:
            for j in range(n_states):
                if SMALLEST < sums[j, s] < LARGEST:
                    ending[j, s] = emitted[j] + reference[j] + np.log(sums[j, s])
                else:
                    for k in range(1, min(n_bins, s) + 1):
                        terms[k - 1] = offer[j, s - k] + durations[j, k - 1]
                    ending[j, s] = emitted[j] + _log_sum(terms[: min(n_bins, s)])
        for j in range(n_states):
            entry = initial[j]
            if s > 0:
                for i in range(n_states):
                    terms[i] = ending[i, s] + transitions[i, j]
                entry = _log_sum(terms[:n_states])
            entry -= emitted[j]
            offer[j, s] = entry
            emitted[j] += emissions[j, observations[s]]
            if entry > -np.inf:
                reached = sums[j, s + 1 : s + 1 + n_bins]
                if abs(entry - reference[j]) > STRAY:
                    if reference[j] > -np.inf:
                        reached *= np.exp(reference[j] - entry)
                    reference[j] = entry
                share = np.exp(entry - reference[j])
                duration = lasting[j]
                for k in range(len(reached)):
                    reached[k] += share * duration[k]


@njit
def closing_scores(last: Floats, offer: Floats, emitted: Floats, of_state: Floats) -> float:
    """Fill in, for each state, the log of the summed score of the paths that end in it; return that of all paths.

    Parameters
    ----------
    last : (S, D). offer : (S, T). emitted : (S,). of_state : (S,), filled in.
    """
    n_states, n_frames = offer.shape
    longest = min(last.shape[1], n_frames)
    terms = np.empty(longest)
    for j in range(n_states):
        for k in range(1, longest + 1):
            terms[k - 1] = offer[j, n_frames - k] + last[j, k - 1]
        of_state[j] = emitted[j] + _log_sum(terms)
    return _log_sum(of_state)


@njit
def _pick(terms: Any, uniform: float) -> int:
    """Return the index that ``uniform`` in [0, 1) picks from probabilities proportional to exp(terms)."""
    total = _log_sum(terms)
    reached = 0.0
    picked = 0
    for index in range(len(terms)):
        probability = np.exp(terms[index] - total)
        if probability > 0.0:
            picked = index
            reached += probability
            if reached > uniform:
                break
    return picked


@njit
def draw_back(
    transitions: Floats,
    durations: Floats,
    last: Floats,
    ending: Floats,
    offer: Floats,
    of_state: Floats,
    uniforms: Floats,
    starts: Integers,
    states: Integers,
) -> int:
    """Write the phrases of a path drawn from the posterior to the ends of ``starts`` and ``states``, (T,).

    Returns the number of phrases.

    Parameters
    ----------
    of_state : (S,), what ``closing_scores`` filled in; overwritten.
    uniforms : (T + 1, 2) in [0, 1), one pair for each frame that a phrase may end at: for its state and its length.
    Others : see ``summed_scores`` and ``trace_back``.
    """
    n_states, n_bins = durations.shape
    n_frames = len(starts)
    of_length = np.empty(n_bins)
    start = n_frames
    n_phrases = 0
    while start > 0:
        lengths = durations if n_phrases > 0 else last
        state = _pick(of_state, uniforms[start, 0])
        longest = min(n_bins, start)
        for k in range(1, longest + 1):
            of_length[k - 1] = offer[state, start - k] + lengths[state, k - 1]
        start -= 1 + _pick(of_length[:longest], uniforms[start, 1])
        n_phrases += 1
        starts[n_frames - n_phrases] = start
        states[n_frames - n_phrases] = state
        for i in range(n_states):
            of_state[i] = ending[i, start] + transitions[i, state]
    return n_phrases
