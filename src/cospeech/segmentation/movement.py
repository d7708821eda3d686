"""Where a body moves: rates of change, thresholds relative to a speaker's own motion, and runs of frames.

``phases`` and ``subunits`` are both based on this.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.motion import skeleton

SMOOTHING_S = 0.05
"""Standard deviation of the Gaussian that positions and orientations are smoothed with before they are
differentiated; noise of the recording would dominate accelerations."""

TYPICAL_FAST = 90.0
"""Percentile of a speaker's speeds that thresholds are shares of. Most speakers move their hands for a tenth of the
time at least, and it does not depend on how long they pause."""


def smooth(values: Floats, fps: float) -> Floats:
    """Return signals (T, ...) smoothed over time; beyond the ends, the first and the last value are repeated."""
    half = int(np.ceil(4.0 * SMOOTHING_S * fps))
    weights = np.exp(-0.5 * (np.arange(-half, half + 1) / (SMOOTHING_S * fps)) ** 2)
    padded = np.pad(values, [(half, half), *[(0, 0)] * (values.ndim - 1)], mode="edge")
    weights /= weights.sum()
    return sum((weight * padded[k : k + len(values)] for k, weight in enumerate(weights)), np.zeros(values.shape))


def rate(values: Floats, fps: float) -> Floats:
    """Return the change of signals (T, ...) per second, from the frames before and after; 0 if there is one frame."""
    return np.gradient(values, 1.0 / fps, axis=0) if len(values) > 1 else np.zeros(values.shape)


def threshold(speeds: Iterable[Floats], share: float, least: float) -> float:
    """Return a share of the speed that a speaker exceeds a tenth of the time, over all of the speaker's records.

    The threshold is ``least`` or more, so that the noise of a body part that does not move is not movement.
    """
    return max(least, share * float(np.percentile(np.concatenate(list(speeds)), TYPICAL_FAST)))


def moving(speed: Floats, low: float, high: float) -> Flags:
    """Return whether each frame belongs to a movement, (T,): a run of frames above ``low`` that exceeds ``high``.

    The result is the same if time is reversed.
    """
    starts, ends = runs(speed > low)
    result = speed > low
    for start, end in zip(starts, ends, strict=True):
        result[start:end] &= speed[start:end].max() > high
    return result


def runs(flags: Flags) -> tuple[Integers, Integers]:
    """Return the first frames of runs of equal flags, and the first frames after them."""
    starts = np.flatnonzero(np.append(True, flags[1:] != flags[:-1]))
    return starts, np.append(starts[1:], len(flags))


def table(record: str, index: str, starts: Integers, ends: Integers, fps: float) -> pd.DataFrame:
    """Return the table of spans of a record, without what is measured in them; ``index`` names the column of
    numbers."""
    return pd.DataFrame(
        {
            "record": record,
            index: np.arange(len(starts)),
            "start_frame": starts,
            "end_frame": ends,
            "start_s": starts / fps,
            "end_s": ends / fps,
        }
    )


def without_short(flags: Flags, minimum: float, keep: Flags | None = None) -> Flags:
    """Return flags (T,) in which every run has at least ``minimum`` frames, unless there is one only.

    The shortest run is joined with its neighbours first, of equal ones the first.

    Parameters
    ----------
    keep : (T,); a run of true flags in which it is true somewhere is kept although it is short.
    """
    starts, ends = (frames.tolist() for frames in runs(flags))
    none = np.zeros(len(flags), dtype=bool)
    kept = np.logical_or.reduceat(none if keep is None else flags & keep, starts).tolist()
    before, after = list(range(-1, len(starts) - 1)), [*range(1, len(starts)), -1]
    joined = [False] * len(starts)
    shortest = [
        (end - start, row) for row, (start, end) in enumerate(zip(starts, ends, strict=True)) if not kept[row]
    ]
    heapq.heapify(shortest)
    result = flags.copy()
    while shortest:
        length, row = heapq.heappop(shortest)
        if joined[row] or kept[row] or length != ends[row] - starts[row]:
            continue  # the run has become part of another one since
        neighbours = [other for other in (before[row], after[row]) if other >= 0]
        if length > minimum - 1e-6 or not neighbours:  # a product of seconds and rate is rounded
            break
        result[starts[row] : ends[row]] ^= True
        first, last = min(row, *neighbours), max(row, *neighbours)
        kept[first] = any(kept[other] for other in neighbours)
        ends[first], after[first] = ends[last], after[last]
        for other in {row, last} - {first}:
            joined[other] = True
        if after[first] >= 0:
            before[after[first]] = first
        heapq.heappush(shortest, (ends[first] - starts[first], first))
    return result


def body_frame(motion: pd.DataFrame) -> tuple[dict[str, Floats], Floats]:
    """Return positions (T, 3) in metres relative to the body, and world orientations (T, J, 3, 3) of the joints.

    The origin is the hips, y is up, and z is the direction that the hips face, so that walking and turning do not
    count as gestures.

    Returns
    -------
    positions : by joint of ``skeleton.JOINTS``.
    orientations : in the order of ``skeleton.JOINTS``.
    """
    root = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float)
    turned, placed = skeleton.chain(root, skeleton.angles(motion))
    heading = np.arctan2(turned[:, 0, 0, 2], turned[:, 0, 2, 2])
    cosine, sine = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, y, z = np.moveaxis(placed - placed[:, :1], 2, 0)
    relative = np.stack([cosine * x - sine * z, y, sine * x + cosine * z], axis=2)
    return {name: relative[:, index] for index, name in enumerate(skeleton.JOINTS)}, turned
