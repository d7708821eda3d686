"""How far the hands of a synthesised body move when those of the recorded one do.

This measure needs no gesture classes: it applies to every system whose motion is known, and to every corpus. Short
spontaneous records of people reached a correlation of .12 with their own speech, compared with .00 for the speech of
another record.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.motion import skeleton

WRISTS = ("left_hand", "right_hand")
"""Named after the body parts that begin there."""

WINDOW_S = 0.5
"""Width of the moving average of the speed: about the duration of a stroke."""


def speed(motion: pd.DataFrame) -> Floats:
    """Return the mean speed of both wrists in metres per second, (T,), relative to the hips, as a moving average."""
    fps = skeleton.frame_rate(motion)
    still = np.zeros((len(motion), 3))
    positions = skeleton.forward(still, skeleton.angles(motion))
    steps = [np.linalg.norm(np.diff(positions[wrist], axis=0), axis=1) for wrist in WRISTS]
    if len(motion) < 2:
        return np.zeros(len(motion))
    per_frame = np.append(np.mean(steps, axis=0), 0.0) * fps
    per_frame[-1] = per_frame[-2]
    half = max(1, round(WINDOW_S * fps / 2))
    sums = np.concatenate([[0.0], np.cumsum(per_frame)])
    first = np.maximum(np.arange(len(motion)) - half, 0)
    end = np.minimum(np.arange(len(motion)) + half + 1, len(motion))
    return np.asarray((sums[end] - sums[first]) / (end - first), dtype=np.float64)


def correlation(one: Floats, other: Floats) -> float:
    """Return Pearson's correlation of two series (T,), NaN if one of them is constant."""
    if len(one) < 2 or np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return math.nan
    return float(np.corrcoef(one, other)[0, 1])


def scores(
    named: Mapping[str, Any], original: pd.DataFrame, draws: Sequence[pd.DataFrame], head_s: float, tail_s: float
) -> pd.DataFrame:
    """Return the table ``motion_scores`` of what one system made of one record.

    Parameters
    ----------
    named : system, variant and record.
    original : motion table of the record.
    draws : motion table of each draw; one that a system failed to make is empty, and is left out.
    head_s, tail_s : the ends that the interior of the record leaves out.
    """
    own, fps = speed(original), skeleton.frame_rate(original)
    parts = {"whole": (0, len(own)), "interior": segments.interior(len(own), 1.0 / fps, head_s, tail_s)}
    rows = [
        {**named, "draw": draw, "measure": "hand_speed_r", "part": part, "duration_s": (high - low) / fps}
        | {"value": correlation(own[low:high], made[low:high])}
        for draw, motion in enumerate(draws)
        if len(motion)
        for made in [speed(motion)]
        for part, (low, high) in parts.items()
    ]
    return pd.DataFrame(rows, columns=[*named, "draw", "measure", "part", "duration_s", "value"])
