"""Decisions that may wait: the online controller with an output that is delayed by a few time steps, and its regret.

A controller whose output is delayed by d steps knows, at each decision, the beliefs of the next d steps. It finds the
best continuation over these steps by dynamic programming, and counts the rest with the values of the policy. With
d = 0 it is the controller of Levine et al. 2010, 7.2, and with a long delay it approaches the offline animation of
7.1. Its regret is the share by which its path costs more than the latter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.synthesis.controller import offline, policy_kernels
from cospeech.synthesis.controller.library import Path, Pieces, Rows, path_cost
from cospeech.synthesis.controller.policy import Policy


class Regret(NamedTuple):
    """What a delay costs and buys.

    Attributes
    ----------
    delay_ms : delay of the output.
    cost : of the path of the delayed controller, per time step (see ``library.path_cost``).
    optimum : of the offline animation, per time step.
    regret : (cost - optimum) / optimum.
    """

    delay_ms: float
    cost: float
    optimum: float
    regret: float


def rest_values(
    policy: Policy, cut: Pieces, rows: Rows, distances: Floats, transitions: Floats, discount: float
) -> Floats:
    """Return the expected discounted cost from each frame of each segment on, (frames of all segments, I).

    Frames are numbered segment by segment. For the first frame of a piece, this is the value of the piece; for the
    others, the choice of what follows the piece is, like there, made in the state of the frame.
    """
    piece, frame = _frames(cut)
    left = cut.end[piece] - frame + 1
    terms = np.stack([np.zeros_like(left), left - 1], axis=1)
    values = np.empty((len(piece), len(transitions)))
    policy_kernels.piece_costs(cut.segment[piece], terms, distances, transitions, discount, values)
    for n in np.unique(left):
        power = np.linalg.matrix_power(transitions, int(n)).T
        entered, onward = policy.entering @ power, policy.values @ power
        for index in np.flatnonzero(left == n):
            b = int(piece[index])
            best = (rows(slice(b, b + 1))[0][:, None] + entered).min(axis=0)
            if not cut.closing[b]:
                best = np.minimum(best, onward[b + 1])
            values[index] += discount**n * best
    return values


def _frames(cut: Pieces) -> tuple[Integers, Integers]:
    """Return the piece of each frame of the library, and its number within its segment."""
    piece = np.repeat(np.arange(len(cut.segment)), cut.length)
    started = np.concatenate([[0], np.cumsum(cut.length)[:-1]])
    return piece, np.arange(len(piece)) - started[piece] + cut.begin[piece]


@njit
def _least(row: Floats, values: Floats) -> float:
    """Return the minimum of ``row + values``."""
    m0 = m1 = m2 = m3 = np.inf
    a = 0
    while a + 4 <= len(row):
        m0 = min(m0, row[a] + values[a])
        m1 = min(m1, row[a + 1] + values[a + 1])
        m2 = min(m2, row[a + 2] + values[a + 2])
        m3 = min(m3, row[a + 3] + values[a + 3])
        a += 4
    while a < len(row):
        m0 = min(m0, row[a] + values[a])
        a += 1
    return min(min(m0, m1), min(m2, m3))


@njit
def _piece_values(
    first: Integers,
    segment: Integers,
    length: Integers,
    begun: Integers,
    closing: Flags,
    costs: Floats,
    rest: Floats,
    distances: Floats,
    beliefs: Floats,
    discount: float,
    shown: Floats,
) -> None:
    """Fill ``shown`` (B,) with the expected discounted cost from each piece on, if its first frame is shown next.

    Parameters
    ----------
    begun : (B,) number of the first frame of each piece within ``rest``.
    costs : (B, A) successor costs.
    beliefs : (d + 1, I) of the next time step and the d steps after it.
    """
    delay, n_pieces, n_segments = len(beliefs) - 1, len(segment), len(distances)
    nearby = np.zeros((delay, n_segments))  # expected distance at each step
    for g in range(delay):
        for a in range(n_segments):
            for i in range(beliefs.shape[1]):
                nearby[g, a] += beliefs[g, i] * distances[a, i]
    ended = np.empty((delay + 1, n_pieces))  # value after each piece, by the step of the next frame
    entered = np.empty(n_segments)
    for g in range(delay, -1, -1):
        for b in range(n_pieces):
            known = min(length[b], delay - g)
            value, factor = 0.0, 1.0
            for h in range(known):
                value += factor * nearby[g + h, segment[b]]
                factor *= discount
            if length[b] <= delay - g:
                value += factor * ended[g + length[b], b]
            else:
                expected = 0.0
                for i in range(beliefs.shape[1]):
                    expected += beliefs[delay, i] * rest[begun[b] + known, i]
                value += factor * expected
            shown[b] = value
        for a in range(n_segments):
            entered[a] = shown[first[a]]
        for b in range(n_pieces if g > 0 else 0):
            if length[b] <= g:
                ended[g, b] = _least(costs[b], entered)
                if not closing[b]:
                    ended[g, b] = min(ended[g, b], shown[b + 1])


def play(cut: Pieces, rows: Rows, rest: Floats, distances: Floats, beliefs: Floats, discount: float) -> Path:
    """Return the path of a delayed controller.

    Parameters
    ----------
    rows : successor costs, of which the whole table (B, A) is needed here.
    rest : see ``rest_values``.
    beliefs : (T, d + 1, I) beliefs of each time step and the d steps after it, as known d steps later; NaN after the
        end of the utterance (see ``crf.lagged``).
    """
    costs = rows(slice(None))
    n_frames, width = beliefs.shape[:2]
    begun = np.concatenate([[0], np.cumsum(cut.length)[:-1]])
    segment, frame = np.empty(n_frames, dtype=np.int64), np.empty(n_frames, dtype=np.int64)
    shown = np.empty(len(cut.segment))
    piece, left = -1, 0
    for t in range(n_frames):
        if left == 0:
            known = beliefs[t, : min(width, n_frames - t)]
            _piece_values(
                cut.first, cut.segment, cut.length, begun, cut.closing, costs, rest, distances, known, discount, shown
            )
            candidates = shown[cut.first[:-1]] + (costs[piece] if piece >= 0 else 0.0)
            best = int(np.argmin(candidates))
            onward = piece >= 0 and not cut.closing[piece] and shown[piece + 1] <= candidates[best]
            piece = piece + 1 if onward else int(cut.first[best])
            left = int(cut.length[piece])
        segment[t] = cut.segment[piece]
        frame[t] = cut.end[piece] + 1 - left
        left -= 1
    return Path(segment, frame)


def regret_curve(
    cut: Pieces,
    rows: Rows,
    rest: Floats,
    distances: Floats,
    lagged: Callable[[int], Floats],
    offline_beliefs: Floats,
    discount: float,
    step_s: float,
    delays: Sequence[int],
) -> list[Regret]:
    """Return the regret of an utterance for each delay.

    Parameters
    ----------
    lagged : returns the beliefs (T, d + 1, I) of a controller that is delayed by d time steps.
    offline_beliefs : (T, I) gamma; both paths are paid for with these.
    step_s : time step in seconds.
    delays : in time steps.
    """
    optimum = offline.animate(cut, rows, distances, offline_beliefs).cost
    n_frames = len(offline_beliefs)
    curve = []
    for delay in delays:
        path = play(cut, rows, rest, distances, lagged(delay), discount)
        cost = path_cost(path, cut, rows, distances, offline_beliefs)
        curve.append(Regret(1000 * step_s * delay, cost / n_frames, optimum / n_frames, cost / optimum - 1.0))
    return curve
