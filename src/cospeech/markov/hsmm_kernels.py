"""Compiled recursions of the hidden semi-Markov model; ``hsmm`` is their interface.

Notation: S states, D duration bins (bin k - 1 is a segment of k frames), T frames; all values are logarithms in
float64. Let E[j, t] be the sum of the weighted log emissions of state j over frames [0, t). A segment of state j over
frames [s, t) scores ``entry[j, s] - E[j, s] + log d_j(t - s) + E[j, t]``. The first two terms, the *offer* of start
frame s, do not depend on t, and the last does not depend on s: what remains to be maximised (or summed) over s is
offer plus duration.

The maximum is found by pushing: as soon as an offer is known, it is compared with the best value so far of all end
frames that it can reach. These are neighbours in memory and can be vectorised, whereas a maximum over the durations
of one end frame cannot. Offers are pushed BLOCK at a time, so that an end frame is read and written once per block.
The offer and the preceding state are kept for all frames, one number and one byte per state; the values of the end
frames are kept in a sliding window only.

In counted and floored durations, most bins have the same value, the minimum, and only a few exceed it. The maximum
over all bins at the minimum duration then depends on the offers alone and is shared by the blocks, and only the
durations that exceed the minimum are pushed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit

BLOCK = 8

SPAN = 1024
"""Number of frames by which the window of end frames advances; a multiple of ``BLOCK``."""

SPARSE = 4
"""Durations are sparse if fewer than one in this many exceed their minimum."""

STRAY = 200.0
"""Maximum distance of an offer from the reference of its state before the reference moves; exp(200) is far from
overflow."""

SMALLEST, LARGEST = 1e-200, 1e200
"""Range of a sum in which no term that matters can have been lost."""


@njit
def _push(best: Any, offer: Any, durations: Any, lanes: int) -> None:
    """Update the best values of ``lanes`` end frames, from the one after the block on, with the block's offers.

    Parameters
    ----------
    best : (lanes,) best value so far of each end frame, updated.
    offer : (BLOCK,).
    durations : (>= lanes + BLOCK - 1,).
    """
    # Unrolled: a loop over the block inside the loop over the lanes would prevent vectorisation.
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
    """Update the best values in ``window`` with a block's offers, for the durations above the minimum only.

    Parameters
    ----------
    window : best values so far, updated.
    offer : (BLOCK,) offers of the frames from index ``first`` of the window on.
    durations : (>= D,).
    risen : the durations above the minimum, in frames.
    """
    for k in risen:
        lasting = durations[k - 1]
        for b in range(BLOCK):
            window[first + k + b] = max(window[first + k + b], offer[b] + lasting)


@njit
def _push_one(window: Any, offer: float, durations: Any, risen: Any, start: int, reach: int) -> None:
    """Do what ``_push_risen`` does for the offer of one frame and the durations below ``reach``."""
    for k in risen:
        if k >= reach:
            break
        window[start + k] = max(window[start + k], offer + durations[k - 1])


@njit
def _push_greatest(greatest: Any, offer: Any) -> None:
    """Update ``greatest``, of the blocks of end frames that all offers of a block reach, with the largest offer."""
    best = offer[0]
    for value in offer:
        best = max(best, value)
    for b in range(len(greatest)):
        greatest[b] = max(greatest[b], best)


@njit
def _take_least(
    window: Any, offer: Any, greatest: float, n_whole: int, n_bins: int, least: float, first: int
) -> None:
    """Update the best values of a block of end frames with the earlier offers, at the ``least`` duration.

    Parameters
    ----------
    window : (BLOCK,) best values so far, updated.
    offer : (>= first,) offers of all earlier frames.
    greatest : the largest offer of the ``n_whole`` preceding blocks, whose offers reach all frames of this block;
        offers before these reach some of them.
    """
    s = max(0, first - n_whole * BLOCK)
    for b in range(BLOCK - 1, -1, -1):
        while s > max(0, first + b - n_bins):
            s -= 1
            greatest = max(greatest, offer[s])
        window[b] = max(window[b], greatest + least)


@njit
def _slide(window: Floats) -> None:
    """Advance ``window`` by SPAN frames: shift its values to the front and fill the end with minus infinity."""
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
    initial : (S,).
    transitions : (S, S), from row to column.
    durations : (S, D + BLOCK), the last BLOCK of them -inf.
    risen : (S, R) durations above the minimum, in frames.
    n_risen : (S,) number of these; -1 if there are too many to push them one by one.
    emissions : (S, K), weighted and finite.
    observations : (T,) symbols in 0 ... K - 1.
    offer : (S, T + BLOCK), all -inf; filled with the score of the best path up to the start at t of a segment of j,
        minus the emissions of j over [0, t).
    emitted : (S,), all 0; filled with the emissions of j over all frames.
    before : (S, T) of integers; filled with the state before a segment of j that starts at t.
    """
    n_states, n_frames = before.shape
    n_bins = durations.shape[1] - BLOCK
    # Best values so far of the end frames from ``origin`` on; earlier ones are no longer needed.
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
    """Write the segments of the best path to the ends of ``starts`` and ``states``, (T,); return score and number.

    The best durations are not stored: the maximisation is repeated where a segment of the best path ends. Ties go to
    the first state, then to the shortest duration.

    Parameters
    ----------
    durations, last : (S, D), of all segments but the last, and of the last one.
    offer, emitted, before : see ``best_scores``.
    """
    n_states, n_bins = durations.shape
    n_frames = len(starts)
    score = -np.inf
    state = length = n_segments = 0
    for j in range(n_states):
        for k in range(1, min(n_bins, n_frames) + 1):
            x = offer[j, n_frames - k] + last[j, k - 1] + emitted[j]
            if x > score:
                score, state, length = x, j, k
    start = n_frames
    while length > 0:
        start -= length
        n_segments += 1
        starts[n_frames - n_segments] = start
        states[n_frames - n_segments] = state
        length = 0
        if start > 0:
            state = int(before[state, start])
            best = -np.inf
            for k in range(1, min(n_bins, start) + 1):
                x = offer[state, start - k] + durations[state, k - 1]
                if x > best:
                    best, length = x, k
    return score, n_segments


@njit
def _log_sum(terms: Any) -> float:
    """Return the log of the sum of exp of ``terms``; minus infinity if all are."""
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
    """Sum the scores of all paths over [0, t) for all t: ``best_scores`` with log-sum-exp in place of max.

    Parameters
    ----------
    durations : (S, D).
    ending, offer : (S, T), all -inf; filled in.
    sums : (S, T + D), all 0; work space for the sum over start frames of exp(offer + duration) of every end frame.
    initial, transitions, emissions, observations, emitted : see ``best_scores``.

    Notes
    -----
    Offers are pushed as probabilities, exp(offer - reference) times those of the durations, so that the loop
    vectorises. The reference of a state follows its offers, and the sums are rescaled with it. An end frame whose sum
    left the safe range is summed again in logarithms.
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
    """Return the log of the summed score of all paths, and fill ``of_state`` with that of those ending in each state.

    Parameters
    ----------
    last : (S, D).
    offer : (S, T).
    emitted, of_state : (S,).
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
    """Return the index drawn by ``uniform`` in [0, 1) with probabilities proportional to exp(terms)."""
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
    """Write the segments of a path drawn from the posterior to the ends of ``starts`` and ``states``, (T,).

    Parameters
    ----------
    of_state : (S,), as filled in by ``closing_scores``; overwritten.
    uniforms : (T + 1, 2) in [0, 1), for the state and the duration of a segment that ends at each frame.
    transitions, durations, last, ending, offer : see ``summed_scores`` and ``trace_back``.

    Returns
    -------
    Number of segments.
    """
    n_states, n_bins = durations.shape
    n_frames = len(starts)
    of_length = np.empty(n_bins)
    start = n_frames
    n_segments = 0
    while start > 0:
        lengths = durations if n_segments > 0 else last
        state = _pick(of_state, uniforms[start, 0])
        longest = min(n_bins, start)
        for k in range(1, longest + 1):
            of_length[k - 1] = offer[state, start - k] + lengths[state, k - 1]
        start -= 1 + _pick(of_length[:longest], uniforms[start, 1])
        n_segments += 1
        starts[n_frames - n_segments] = start
        states[n_frames - n_segments] = state
        for i in range(n_states):
            of_state[i] = ending[i, start] + transitions[i, state]
    return n_segments
