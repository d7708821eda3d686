"""Compiled parts of policy iteration; ``policy`` is their interface.

Notation: A segments, B pieces, I hidden states. ``values`` (B, I) is the expected discounted cost of all frames from
the start of a piece on, if the piece begins in state i; the cost of the transition into it is not included.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.markov.crf_chain import predict

CONTINUE = -1
"""In place of a segment: continue with the next piece of the same segment."""

UNKNOWN = -2
"""In place of a segment: nothing has been chosen yet."""


@njit(nogil=True)
def piece_costs(
    segment: Integers, terms: Integers, distances: Floats, transitions: Floats, discount: float, costs: Floats
) -> None:
    """Fill ``costs`` (B, I) with the sum over g of discount^g * sum over j of P_g(j | i) delta_a(j).

    Parameters
    ----------
    terms : (B, 2) first and last g of each piece; the sum is empty if the last is before the first.
    distances : (A, I).
    transitions : (I, I), from row to column.
    """
    n_states = len(transitions)
    ahead, after = np.empty(n_states), np.empty(n_states)
    for b in range(len(segment)):
        for i in range(n_states):
            ahead[i] = distances[segment[b], i]
            costs[b, i] = 0.0
        for g in range(terms[b, 1] + 1):
            if g >= terms[b, 0]:
                for i in range(n_states):
                    costs[b, i] += ahead[i]
            for i in range(n_states):
                total = 0.0
                for j in range(n_states):
                    total += transitions[i, j] * ahead[j]
                after[i] = discount * total
            ahead, after = after, ahead


@njit(nogil=True)
def entering_values(powers: Floats, entered: Floats, expected: Floats) -> None:
    """Fill ``expected`` (N, A, I) with the sum over j of P_n(j | i) * entered[a, j].

    Parameters
    ----------
    powers : (N, I, I) transposed powers of the transition matrix, from column to row.
    entered : (A, I).
    """
    for n in range(len(powers)):
        for a in range(len(entered)):
            row = expected[n, a]
            row[:] = 0.0
            for j in range(entered.shape[1]):
                value, column = entered[a, j], powers[n, j]
                for i in range(len(row)):
                    row[i] += value * column[i]


@njit(nogil=True)
def improve(
    start: int,
    rows: Floats,
    closing: Flags,
    power_of: Integers,
    powers: Floats,
    costs: Floats,
    factors: Floats,
    offers: Floats,
    expected: Floats,
    least: Floats,
    excess: Floats,
    values: Floats,
    choices: Integers,
    jumps: Floats,
    improved: Floats,
) -> None:
    """Choose the best continuation of a block of pieces.

    Parameters
    ----------
    start : the first piece of the block.
    rows : (block, A) successor costs of the block.
    power_of : (B,) index of the power of the transition matrix that leads to the end of each piece.
    powers : (N, I, I), transposed.
    costs, factors : (B, I) cost of each piece, and (B,) discount of what follows it.
    offers : (B, I) cost of a further continuation whose value is known; infinite if there is none.
    expected : (N, A, I), see ``entering_values``.
    least, excess : (N, I) minimum of ``expected`` over the segments, and (N, A) minimum over the states of
        ``expected - least``. A segment whose successor cost plus excess is no less than what has been found already,
        in excess of ``least``, cannot be the best one in any state, which saves looking at its states.
    values : (B, I) values so far.
    choices, jumps : (B, I) chosen segment, ``CONTINUE``, A for the offer, or ``UNKNOWN``, and its successor cost or
        that of the offer; updated.
    improved : (B, I), filled with the new values.
    """
    n_segments, n_states = rows.shape[1], values.shape[1]
    best, onward = np.empty(n_states), np.empty(n_states)
    for k in range(len(rows)):
        b = start + k
        n, row = power_of[b], rows[k]
        if not closing[b]:
            predict(values[b + 1], powers[n], onward)
        if choices[b, 0] == UNKNOWN:
            nearest = 0
            for a in range(n_segments):
                if row[a] < row[nearest]:
                    nearest = a
            for i in range(n_states):
                choices[b, i], jumps[b, i] = nearest, row[nearest]
        bound = -math.inf
        for i in range(n_states):
            choice = choices[b, i]
            if 0 <= choice < n_segments:
                best[i] = jumps[b, i] + expected[n, choice, i]
            else:
                best[i] = jumps[b, i] if choice == n_segments else onward[i]
            if not closing[b] and onward[i] < best[i]:
                best[i] = onward[i]
                choices[b, i], jumps[b, i] = CONTINUE, 0.0
            if offers[b, i] < best[i]:
                best[i] = offers[b, i]
                choices[b, i], jumps[b, i] = n_segments, offers[b, i]
            bound = max(bound, best[i] - least[n, i])
        for a in range(n_segments):
            if row[a] + excess[n, a] >= bound:
                continue
            bound = -math.inf
            for i in range(n_states):
                x = row[a] + expected[n, a, i]
                if x < best[i]:
                    best[i] = x
                    choices[b, i], jumps[b, i] = a, row[a]
                bound = max(bound, best[i] - least[n, i])
        for i in range(n_states):
            improved[b, i] = costs[b, i] + factors[b] * best[i]


@njit(nogil=True)
def evaluate(
    first: Integers,
    power_of: Integers,
    powers: Floats,
    turned: Floats,
    costs: Floats,
    factors: Floats,
    choices: Integers,
    jumps: Floats,
    tolerance: float,
    sweeps: int,
    values: Floats,
) -> None:
    """Update ``values`` (B, I) to those of the chosen continuations, by Gauss-Seidel sweeps against the time.

    A piece is mostly followed by the next one, whose value of the same sweep is then used already. The sweeps end
    when no value changes by more than ``tolerance``.

    Parameters
    ----------
    first : (A + 1,) the first piece of each segment.
    powers, turned : (N, I, I) powers of the transition matrix, and transposed.
    others : see ``improve``.
    """
    n_pieces, n_states = values.shape
    n_segments = len(first) - 1
    onward = np.empty(n_states)
    alike = np.empty(n_pieces, dtype=np.bool_)
    for b in range(n_pieces):
        alike[b] = choices[b, 0] < n_segments and np.all(choices[b] == choices[b, 0])
    for _ in range(sweeps):
        change = 0.0
        for b in range(n_pieces - 1, -1, -1):
            power = powers[power_of[b]]
            if alike[b]:  # as a vector over the states
                choice = choices[b, 0]
                predict(values[b + 1 if choice == CONTINUE else first[choice]], turned[power_of[b]], onward)
                for i in range(n_states):
                    value = costs[b, i] + factors[b] * (jumps[b, i] + onward[i])
                    change = max(change, abs(value - values[b, i]))
                    values[b, i] = value
                continue
            for i in range(n_states):
                total = jumps[b, i]
                choice = choices[b, i]
                if choice < n_segments:
                    row = values[b + 1 if choice == CONTINUE else first[choice]]
                    p0 = p1 = p2 = p3 = 0.0  # four sums, as one alone would wait for itself
                    j = 0
                    while j + 4 <= n_states:
                        p0 += power[i, j] * row[j]
                        p1 += power[i, j + 1] * row[j + 1]
                        p2 += power[i, j + 2] * row[j + 2]
                        p3 += power[i, j + 3] * row[j + 3]
                        j += 4
                    while j < n_states:
                        p0 += power[i, j] * row[j]
                        j += 1
                    total += (p0 + p1) + (p2 + p3)
                value = costs[b, i] + factors[b] * total
                change = max(change, abs(value - values[b, i]))
                values[b, i] = value
        if change <= tolerance:
            break


@njit
def decide(
    values: Floats, entering: Floats, closing: Flags, row: Floats, piece: int, belief: Floats
) -> tuple[int, float]:
    """Return the cheapest continuation after a piece, a segment or ``CONTINUE``, and its expected cost.

    Parameters
    ----------
    values, entering : (B, I) and (A, I), from the first frame of each piece and of each segment on.
    closing : (B,) whether a piece is the last of its segment.
    row : (A,) successor costs of the piece.
    belief : (I,); states of probability 0 cost no time.
    """
    known = np.flatnonzero(belief)
    best, least = CONTINUE, math.inf
    if not closing[piece]:
        least = 0.0
        for i in known:
            least += belief[i] * values[piece + 1, i]
    for a in range(len(entering)):
        cost = row[a]
        for i in known:
            cost += belief[i] * entering[a, i]
        if cost < least:
            best, least = a, cost
    return best, least


@njit
def undominated(candidates: Floats, order: Integers, kept: Integers) -> int:
    """Return how many candidates are not dominated, and write their indices to ``kept`` (A,).

    Parameters
    ----------
    candidates : (A, I) costs. One is dominated if another one costs less in every state.
    order : (A,) the candidates by increasing sum over the states, so that each follows all that dominate it.
    """
    n_kept = 0
    n_states = candidates.shape[1]
    for a in order:
        dominated = False
        for k in range(n_kept):
            other = kept[k]
            i = 0
            while i < n_states and candidates[other, i] < candidates[a, i]:
                i += 1
            if i == n_states:
                dominated = True
                break
        if not dominated:
            kept[n_kept] = a
            n_kept += 1
    return n_kept
