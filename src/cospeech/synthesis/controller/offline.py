"""The lowest-cost animation of a whole utterance, by dynamic programming (Levine et al. 2010, 7.1).

The paper fills, at each time step, a table with the lowest cost of a path to each frame of each segment. Within a
segment the path is determined, so that it suffices to keep the lowest cost of *entering* each segment at each time
step; the cost of having reached any of its frames follows from the sums of its distances since then.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.synthesis.controller.library import Path, Pieces, Rows


class Animation(NamedTuple):
    """The lowest-cost path of an utterance and its cost."""

    path: Path
    cost: float


@njit
def _fill(
    segment: Integers, end: Integers, costs: Floats, distances: Floats, beliefs: Floats, before: Integers
) -> tuple[float, int, int]:
    """Fill ``before`` (T, A) with the piece after which each segment is best entered at each time step.

    Parameters
    ----------
    costs : (B, A) successor costs.
    distances : (A, I), beliefs : (T, I).

    Returns
    -------
    The lowest cost of the utterance, the last segment of its path, and the time step at which this is entered.
    """
    n_frames, n_segments = before.shape
    n_states = distances.shape[1]
    n_kept = end.max() + 2  # the time steps that a path may have entered its segment at
    entering = np.full((n_kept, n_segments), np.inf)
    summed = np.zeros((n_kept, n_segments))  # distances before each of these time steps
    reached = np.empty(len(segment))
    cheapest = np.empty(len(segment))
    longest = np.zeros(n_segments, dtype=np.int64)
    for b in range(len(segment)):
        cheapest[b] = costs[b].min()
        longest[segment[b]] = max(longest[segment[b]], end[b])
    entering[0] = 0.0
    before[0] = -1
    for t in range(n_frames):
        now = t % n_kept
        if t > 0:
            nearest = 0
            for b in range(len(segment)):
                a, entered = segment[b], t - 1 - end[b]
                reached[b] = np.inf
                if entered >= 0:
                    reached[b] = entering[entered % n_kept, a] + (summed[now, a] - summed[entered % n_kept, a])
                if reached[b] + cheapest[b] < reached[nearest] + cheapest[nearest]:
                    nearest = b
            best = entering[now]
            for a in range(n_segments):
                best[a] = reached[nearest] + costs[nearest, a]
                before[t, a] = nearest
            bound = best.max()
            for b in range(len(segment)):
                if reached[b] + cheapest[b] < bound:  # otherwise no segment is entered from here
                    bound = -np.inf
                    for a in range(n_segments):
                        x = reached[b] + costs[b, a]
                        if x < best[a]:
                            best[a] = x
                            before[t, a] = b
                        bound = max(bound, best[a])
        following = (t + 1) % n_kept
        for a in range(n_segments):
            distance = 0.0
            for i in range(n_states):
                distance += beliefs[t, i] * distances[a, i]
            summed[following, a] = summed[now, a] + distance
    lowest, last, since = np.inf, 0, 0
    now = n_frames % n_kept
    for entered in range(max(0, n_frames - n_kept + 1), n_frames):
        for a in range(n_segments):
            if n_frames - 1 - entered <= longest[a]:
                x = entering[entered % n_kept, a] + (summed[now, a] - summed[entered % n_kept, a])
                if x < lowest:
                    lowest, last, since = x, a, entered
    return lowest, last, since


def animate(cut: Pieces, rows: Rows, distances: Floats, beliefs: Floats) -> Animation:
    """Return the path with the lowest sum of expected distances and successor costs.

    It starts with the first frame of any segment and may end at any frame.

    Parameters
    ----------
    rows : successor costs, of which the whole table (B, A) is needed here.
    distances : (A, I) delta.
    beliefs : (T, I) gamma, the distribution over the hidden states at each of at least one time step.
    """
    n_frames = len(beliefs)
    before = np.empty((n_frames, len(distances)), dtype=np.int32)
    cost, last, since = _fill(cut.segment, cut.end, rows(slice(None)), distances, beliefs, before)
    segment, frame = np.empty(n_frames, dtype=np.int64), np.empty(n_frames, dtype=np.int64)
    stop = n_frames
    while True:
        segment[since:stop] = last
        frame[since:stop] = np.arange(stop - since)
        piece = int(before[since, last])
        if piece < 0:
            return Animation(Path(segment, frame), float(cost))
        stop, last = since, int(cut.segment[piece])
        since = stop - 1 - int(cut.end[piece])
