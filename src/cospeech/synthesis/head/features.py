"""Features of the head and of the voice for the patterns of the first stage (Sargin 2006, eq. 4.1 and 4.9)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.synthesis.live import ANGLES, MELODY

HEAD = (*ANGLES, *(f"d_{name}" for name in ANGLES))
"""Angles of the head and their first differences."""

MELODY_HZ = 100.0
"""Rate of the melody."""

LONGEST_GAP_S = 0.2
"""Angles are interpolated over frames that could not be measured, if these last no longer."""


class Stretch(NamedTuple):
    """Frames of a record in which the head is known: the ``first`` one, and the ``angles`` (T, 3) in degrees."""

    record: str
    first: int
    angles: Floats


def stretches(record: str, head: pd.DataFrame, least: int) -> list[Stretch]:
    """Return the stretches of at least ``least`` frames in which the head is known, short gaps interpolated."""
    angles = angles_of(head)
    known = np.isfinite(angles).all(axis=1)
    measured = np.flatnonzero(known)
    if len(measured) == 0:
        return []
    longest = round(LONGEST_GAP_S * skeleton.frame_rate(head))
    cuts = np.flatnonzero(np.diff(measured) > longest + 1) + 1
    found = []
    for part in np.split(measured, cuts):
        frames = np.arange(part[0], part[-1] + 1)
        filled = np.column_stack([np.interp(frames, part, column) for column in angles[part].T])
        if len(frames) >= least:
            found.append(Stretch(record, int(part[0]), filled))
    return found


def angles_of(head: pd.DataFrame) -> Floats:
    """Return the angles of a head table, (T, 3) in degrees, NaN where they are not known."""
    return head[list(ANGLES)].to_numpy(dtype=float)


def at_rate(head: pd.DataFrame, fps: float) -> pd.DataFrame:
    """Return the angles of a head at another frame rate, interpolated; null between frames of which one is null."""
    own = skeleton.frame_rate(head)
    if own == fps:
        return head
    n_frames = max(1, round(len(head) * fps / own))
    times_s = (np.arange(n_frames) + 0.5) / fps
    angles = {name: np.interp(times_s, head["time_s"], head[name].to_numpy(dtype=float)) for name in ANGLES}
    return pd.DataFrame({"frame": np.arange(n_frames), "time_s": times_s, **angles})


def head_features(angles: Floats) -> Floats:
    """Return the angles (T, 3) and their first differences, (T, 6); the first difference is repeated."""
    steps = np.diff(angles, axis=0)
    return np.ascontiguousarray(np.column_stack([angles, np.vstack([steps[:1], steps])]))


def melody_features(melody: pd.DataFrame) -> Floats:
    """Return pitch, its derivative and intensity, (T, 3)."""
    return np.ascontiguousarray(melody[list(MELODY)].to_numpy(dtype=float))


def melody_frames(n_frames: int, fps: float, first: int = 0) -> Integers:
    """Return the melody frame (n_frames,) that contains the centre of each frame of the head from ``first`` on."""
    centres = (first + np.arange(n_frames) + 0.5) * (MELODY_HZ / fps)
    return np.floor(centres + 1e-9).astype(np.int64)


def common_rate(heads: list[pd.DataFrame]) -> float:
    """Return the most frequent frame rate of some heads, the highest of several."""
    if not heads:
        raise UserError("no training record has angles of the head; head gestures cannot be learnt")
    rates, counts = np.unique([skeleton.frame_rate(head) for head in heads], return_counts=True)
    return float(rates[len(rates) - 1 - int(np.argmax(counts[::-1]))])
