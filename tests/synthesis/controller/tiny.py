"""Tiny libraries and hidden chains for the tests of the controller, and the paper's tables, written out in full."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.synthesis.controller import library


class Tiny(NamedTuple):
    """A library with its successor costs (B, A), distances (A, I), and the transitions (I, I) of a hidden chain."""

    cut: library.Pieces
    costs: np.ndarray
    distances: np.ndarray
    transitions: np.ndarray

    @property
    def rows(self):
        return self.costs.__getitem__


def random_tiny(rng, segments, states, longest=6, shortest=1):
    cut = library.pieces(rng.integers(shortest, longest + 1, segments))
    costs = rng.uniform(0.0, 3.0, (len(cut.segment), segments))
    for b, (a, closing) in enumerate(zip(cut.segment, cut.closing, strict=True)):
        if not closing:
            costs[b, a] = np.inf
    sticky = 0.7 * np.eye(states) + 0.3 * rng.dirichlet(np.ones(states), states)
    return Tiny(cut, costs, rng.uniform(0.0, 4.0, (segments, states)), sticky)


def frames(tiny):
    """All frames of the library, (segment, frame)."""
    lengths = np.bincount(tiny.cut.segment, tiny.cut.length).astype(int)
    return [(a, f) for a, n in enumerate(lengths) for f in range(n)]


def successor_table(tiny):
    """S(a, f, a', f') of 7.1 between all frames of the library."""
    known = frames(tiny)
    table = np.full((len(known), len(known)), np.inf)
    ends = {(int(a), int(f)): b for b, (a, f) in enumerate(zip(tiny.cut.segment, tiny.cut.end, strict=True))}
    for x, (a, f) in enumerate(known):
        for y, (other, g) in enumerate(known):
            if a == other and g == f + 1:
                table[x, y] = 0.0
            elif g == 0 and (a, f) in ends:
                table[x, y] = tiny.costs[ends[a, f], other]
    return known, table


def frame_viterbi(tiny, beliefs):
    """The table of 7.1, frame by frame: the lowest cost of an utterance."""
    known, table = successor_table(tiny)
    segment = np.array([a for a, _ in known])
    reached = np.where([f == 0 for _, f in known], 0.0, np.inf) + tiny.distances[segment] @ beliefs[0]
    for belief in beliefs[1:]:
        reached = (reached[:, None] + table).min(axis=0) + tiny.distances[segment] @ belief
    return reached.min()


def all_path_costs(tiny, beliefs):
    """The cost of every path, by extending paths frame by frame."""
    known, table = successor_table(tiny)

    def extend(x, t, cost):
        cost += tiny.distances[known[x][0]] @ beliefs[t]
        if t + 1 == len(beliefs):
            yield cost
            return
        for y in np.flatnonzero(np.isfinite(table[x])):
            yield from extend(y, t + 1, cost + table[x, y])

    for x, (_, f) in enumerate(known):
        if f == 0:
            yield from extend(x, 0, 0.0)


def frame_values(tiny, discount, sweeps):
    """V_d(a', f', a, f, i) of 7.2 over single frames, less the successor cost: (frames, I)."""
    known, table = successor_table(tiny)
    segment = np.array([a for a, _ in known])
    values = np.zeros((len(known), len(tiny.transitions)))
    for _ in range(sweeps):
        ahead = values @ tiny.transitions.T
        following = (table[:, :, None] + ahead[None]).min(axis=1)
        values = tiny.distances[segment] + discount * following
    return known, values


def full_table(tiny, discount, discounts, sweeps):
    """V_d(a', a, f_k, i) of appendix A by plain value iteration on the whole table (A, B, I), term by term.

    The entry of a segment that continues is that of the piece after f_k.
    """
    cut, transitions = tiny.cut, tiny.transitions
    n_segments, n_states = tiny.distances.shape
    powers = [np.linalg.matrix_power(transitions, n) for n in range(int(cut.end.max()) + 3)]
    table = np.zeros((n_segments, len(cut.segment), n_states))

    def shown(segment, first, last):
        return sum(
            (discount**g * powers[g] @ tiny.distances[segment] for g in range(first, last + 1)), np.zeros(n_states)
        )

    for _ in range(sweeps):
        new = np.empty_like(table)
        for b, (a, closing) in enumerate(zip(cut.segment, cut.closing, strict=True)):
            for other in range(n_segments):
                continuing = other == a and not closing
                piece = b + 1 if continuing else cut.first[other]
                n = int(cut.length[piece])
                if discounts == "printed":
                    length = n if continuing else n - 1  # f_1 and f_(k+1) - f_k
                    cost = shown(other, 1, length)
                    if not continuing:
                        cost = cost + tiny.distances[other]  # in C(a', 0, a, f_k, e_i)
                else:
                    length, cost = n, shown(other, 0, n - 1)
                if not continuing:
                    cost = cost + tiny.costs[b, other]
                ahead = (powers[length] @ table[:, piece].T).min(axis=1)
                new[other, b] = cost + discount**length * ahead
        table = new
    return table
