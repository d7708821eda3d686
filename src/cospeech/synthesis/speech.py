"""The speech that drives the synthesis of a record: its own, another record's, or its own at the wrong moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Integers, Labels
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.synthesis.declaration import Drive
from cospeech.synthesis.interface import Speech


@dataclass(frozen=True)
class Streams:
    """The speech of an actor's records, frame by frame; each mapping goes from a record to its stream.

    Attributes
    ----------
    labels : (T,) prosody labels. prosody : prosody tables of T rows. planted : (T,) planted prosody labels.
    """

    labels: Mapping[str, Labels]
    prosody: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    planted: Mapping[str, Labels] = field(default_factory=dict)

    def n_frames(self, record: str) -> int:
        """Return the length of a record."""
        return len(self.labels[record] if record in self.labels else self.prosody[record])


def frame_labels(prosody: pd.DataFrame) -> dict[str, Labels]:
    """Return the label of every frame of each record, (T,), of a segment table of several records."""
    labels = {}
    for name, table in prosody.groupby("record", sort=False):
        segments.check(table, f"prosody segments of record {name}")
        labels[str(name)] = segments.to_labels(table)
    return labels


def driving_frames(
    lengths: Mapping[str, int], record: str, drive: Drive, frame_s: float, seed: int, shift_s: float
) -> tuple[str, Integers, float]:
    """Return which frames of which record drive ``record``: the driving record, its frames (T,), and the shift.

    Parameters
    ----------
    lengths : length in frames of each record of the actor.
    drive : ``own``; ``shuffled``: another record drawn at random, cut or repeated to length; ``shifted``: own speech,
        shifted circularly by a random time of at least ``shift_s`` in either direction. What is drawn depends only on
        the seed and the record, so that the matched controls of all systems are driven by the same speech.

    Raises
    ------
    UserError : if the record is too short for the shift, or is the only one of the actor.
    """
    own = lengths[record]
    if drive == "shuffled":
        names = [name for name in lengths if name != record]
        if not names:
            raise UserError(f"record {record}: its actor has no other record whose speech could drive it; add one")
        name = names[random_source(seed, record, drive).integers(len(names))]
        return name, np.resize(np.arange(lengths[name]), own), 0.0
    if drive == "shifted":
        least = round(shift_s / frame_s)
        if own < 2 * least:
            raise UserError(
                f"record {record}: its {own * frame_s:g} s are too short for a shift of {shift_s:g} s "
                "in either direction; lower synthesis.shift_s"
            )
        frames = int(random_source(seed, record, drive).integers(least, own - least, endpoint=True))
        return record, np.roll(np.arange(own), -frames), frames * frame_s
    return record, np.arange(own), 0.0


def driving_speech(
    streams: Streams, record: str, frame_s: float, drive: Drive = "own", seed: int = 0, shift_s: float = 0.0
) -> Speech:
    """Return the speech that drives ``record``; see ``driving_frames``."""
    names = streams.labels if streams.labels else streams.prosody
    lengths = {name: streams.n_frames(name) for name in names}
    name, frames, shift = driving_frames(lengths, record, drive, frame_s, seed, shift_s)
    speech = Speech(record, frame_s, len(frames), driving_record=name, shift_s=shift)
    if name in streams.labels:
        speech = replace(speech, labels=streams.labels[name][frames])
    if name in streams.prosody:
        table = streams.prosody[name].iloc[frames].reset_index(drop=True)
        if drive != "own":  # the rows come from elsewhere, but their times are those of the record
            table["frame"], table["time_s"] = np.arange(len(table)), segments.frame_times(len(table), 1 / frame_s)
        speech = replace(speech, prosody=table)
    if name in streams.planted:
        speech = replace(speech, planted=streams.planted[name][frames])
    return speech
