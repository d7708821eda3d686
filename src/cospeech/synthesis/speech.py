"""The speech that drives the synthesis of a record: its own, or the wrong one."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Labels
from cospeech.errors import UserError
from cospeech.synthesis import Drive


class Speech(NamedTuple):
    """What is heard while a record is synthesised.

    Attributes
    ----------
    record : the record that is synthesised. frame_s : distance of frames in seconds.
    labels : (T,) prosody label of every frame, T the length of ``record``.
    driving_record : record that they come from.
    shift_s : how far they were turned round: second ``shift_s`` of the driving record is heard first.
    """

    record: str
    frame_s: float
    labels: Labels
    driving_record: str
    shift_s: float

    @property
    def n_frames(self) -> int:
        """Length in frames."""
        return len(self.labels)


def frame_labels(prosody: pd.DataFrame) -> dict[str, Labels]:
    """Return the label of every frame of each record, (T,), of a segment table of several records."""
    labels = {}
    for name, table in prosody.groupby("record", sort=False):
        segments.check(table, f"prosody segments of record {name}")
        labels[str(name)] = segments.to_labels(table)
    return labels


def random_source(seed: int, *names: str) -> np.random.Generator:
    """Return the random numbers that belong to ``names`` under the run's ``seed``."""
    return np.random.default_rng([seed, *(zlib.crc32(name.encode()) for name in names)])


def heard(
    labels: Mapping[str, Labels],
    record: str,
    frame_s: float,
    drive: Drive = "own",
    seed: int = 0,
    shift_s: float = 0.0,
) -> Speech:
    """Return the speech that drives ``record``.

    Parameters
    ----------
    labels : prosody label of every frame, (T,), of each record of the actor.
    drive : ``own``; ``shuffled``: another record drawn at random, cut or wrapped round to length; ``shifted``: own
        speech turned round by a random time, at least ``shift_s`` in either direction. What is drawn depends on
        seed and record alone, so that the controls of all decoders hear the same.

    Raises
    ------
    UserError : where the record is too short for the shift, or alone.
    """
    own = labels[record]
    if drive == "shuffled":
        names = [name for name in labels if name != record]
        if not names:
            raise UserError(f"record {record}: its actor has no other record whose speech could drive it; add one")
        name = names[random_source(seed, record, drive).integers(len(names))]
        return Speech(record, frame_s, np.resize(labels[name], len(own)), name, 0.0)
    if drive == "shifted":
        least = round(shift_s / frame_s)
        if len(own) < 2 * least:
            raise UserError(
                f"record {record}: is {len(own) * frame_s:g} s long, too short to be shifted by {shift_s:g} s "
                "in either direction; lower synthesis.shift_s"
            )
        frames = int(random_source(seed, record, drive).integers(least, len(own) - least, endpoint=True))
        return Speech(record, frame_s, np.roll(own, -frames), record, frames * frame_s)
    return Speech(record, frame_s, own, record, 0.0)
