"""The recorded heads of the training records: what the controls show instead of head gestures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.synthesis.interface import Speech, Synthesis, Training, decoding
from cospeech.synthesis.live import ANGLES, head_table


class Pool(NamedTuple):
    """Head tables by training record, and all records of the actor in order, including the held-out one."""

    heads: Mapping[str, pd.DataFrame]
    order: tuple[str, ...]


def train(training: Training, settings: Mapping[str, Any]) -> Pool:
    """Return the training records in which the head is known at some time.

    Raises
    ------
    UserError : if there are none.
    """
    names = list(ANGLES)
    known = {record: head for record, head in training.heads.items() if head[names].notna().all(axis=1).any()}
    if not known:
        raise UserError(f"actor {training.actor}: no training record shows the head")
    return Pool(known, training.order)


def angles(head: pd.DataFrame, times_s: Floats) -> Floats:
    """Return the angles (n, 3) in degrees at times (n,), interpolated between the frames in which they are known."""
    known = head[head[list(ANGLES)].notna().all(axis=1)]
    return np.column_stack([np.interp(times_s, known["time_s"], known[name]) for name in ANGLES])


def duration_s(head: pd.DataFrame) -> float:
    """Return the duration of a head table in seconds."""
    return len(head) / skeleton.frame_rate(head)


def shown(speech: Speech, made: Floats) -> Synthesis:
    """Return the angles (T, 3) of a control, which does not use the speech."""
    return Synthesis(decoding(speech), head=head_table(made, speech.motion_fps))


def times_s(speech: Speech) -> Floats:
    """Return the times of the frames to make, (T,)."""
    return segments.frame_times(speech.n_motion_frames, speech.motion_fps)


def to_tables(pool: Pool) -> dict[str, pd.DataFrame]:
    """Return the heads as one table, and the order of the records."""
    heads = pd.concat(
        [head[["frame", "time_s", *ANGLES]].assign(record=record) for record, head in pool.heads.items()]
    )
    return {"pool": heads.reset_index(drop=True), "order": pd.DataFrame({"record": list(pool.order)})}


def from_tables(tables: Mapping[str, pd.DataFrame]) -> Pool:
    """Return the pool of ``to_tables``."""
    groups = tables["pool"].groupby("record", sort=False)
    heads = {str(record): head.drop(columns="record").reset_index(drop=True) for record, head in groups}
    return Pool(heads, tuple(tables["order"]["record"]))
