"""Segment tables: labelled intervals of a record in frames and seconds, and their conversion to label sequences.

A segment is half-open, [start, end). Frame k of a sequence with rate f covers [k / f, (k + 1) / f), and its centre is
(k + 0.5) / f. Neighbouring segments may have the same label and still be two segments.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Labels
from cospeech.data.vocabulary import GESTURES as GESTURES
from cospeech.errors import UserError

Spans = list[tuple[float, float, str]]
"""Labelled intervals as other programs exchange them: start and end in seconds, label."""


def frame_times(n_frames: int, fps: float) -> npt.NDArray[np.float64]:
    """Return the centres of the frames in seconds, (n_frames,)."""
    return np.asarray((np.arange(n_frames) + 0.5) / fps, dtype=np.float64)


def interior(n_frames: int, frame_s: float, head_s: float, tail_s: float) -> tuple[int, int]:
    """Return the first frame of a record's interior and the first frame after it; equal if there is no interior.

    The interior leaves out the first ``head_s`` and the last ``tail_s`` seconds, rounded up to whole frames.
    """
    head, tail = (math.ceil(length_s / frame_s - 1e-6) for length_s in (head_s, tail_s))
    first = min(n_frames, head)
    return first, max(first, n_frames - tail)


def from_starts(record: str, starts: npt.ArrayLike, labels: npt.ArrayLike, n_frames: int, fps: float) -> pd.DataFrame:
    """Return the table of segments that begin at frames ``starts``, each of which ends where the next one begins.

    Parameters
    ----------
    starts : (L,) first frames in ascending order, beginning with 0.
    labels : (L,) label of each segment.
    n_frames : the end of the last segment.
    """
    first = np.asarray(starts, dtype=np.int64)
    end = np.append(first[1:], n_frames)
    return pd.DataFrame(
        {
            "record": record,
            "segment": np.arange(len(first), dtype=np.int64),
            "start_frame": first,
            "end_frame": end,
            "start_s": first / fps,
            "end_s": end / fps,
            "label": np.asarray(labels, dtype=object).astype(str),
        }
    )


def from_labels(record: str, labels: npt.ArrayLike, fps: float, begins: npt.ArrayLike | None = None) -> pd.DataFrame:
    """Return the segment table of a sequence of frame labels.

    Parameters
    ----------
    labels : (T,) label of every frame. A segment begins where the label changes.
    begins : (T,) of bool; a segment also begins where it is true, so that neighbours with the same label stay apart.
    """
    stream = np.asarray(labels)
    change = np.ones(len(stream), dtype=bool)
    change[1:] = stream[1:] != stream[:-1]
    if begins is not None:
        change[1:] |= np.asarray(begins, dtype=bool)[1:]
    starts = np.flatnonzero(change)
    return from_starts(record, starts, stream[starts], len(stream), fps)


def to_labels(table: pd.DataFrame, n_frames: int | None = None) -> Labels:
    """Return the label of every frame, (n_frames,), of a segment table without gaps; by default of all its frames."""
    lengths = (table["end_frame"] - table["start_frame"]).to_numpy()
    labels = np.repeat(table["label"].to_numpy(dtype=object), lengths)
    return labels if n_frames is None else labels[:n_frames]


def at_times(table: pd.DataFrame, times_s: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Return the row of the segment that contains each time, (n,); times outside the table belong to the nearest."""
    row = np.searchsorted(table["start_s"].to_numpy(), np.asarray(times_s), side="right") - 1
    return np.clip(row, 0, len(table) - 1).astype(np.int64)


def resample(table: pd.DataFrame, n_frames: int, fps: float) -> pd.DataFrame:
    """Return the segments on another frame grid: a frame belongs to the segment that contains its centre.

    Neighbours with the same label stay apart. Segments that are too short to contain a frame centre are dropped.
    """
    rows = at_times(table, frame_times(n_frames, fps))
    starts = np.flatnonzero(np.append(True, rows[1:] != rows[:-1]))
    labels = table["label"].to_numpy(dtype=object)[rows[starts]]
    return from_starts(str(table["record"].iloc[0]), starts, labels, n_frames, fps)


def check(table: pd.DataFrame, where: str) -> None:
    """Raise UserError unless the segments of a record start at frame 0 and have no gaps and no overlaps."""
    start, end = table["start_frame"].to_numpy(), table["end_frame"].to_numpy()
    if len(table) == 0:
        raise UserError(f"{where}: holds no segment")
    if start[0] != 0:
        raise UserError(f"{where}: the first segment starts at frame {start[0]}, not at 0")
    wrong = np.flatnonzero((end <= start) | (np.append(start[1:], end[-1]) != end))
    if len(wrong):
        row = int(wrong[0])
        raise UserError(
            f"{where}: segment {row} [{start[row]}, {end[row]}) is empty, or overlaps or leaves a gap to the next"
        )
