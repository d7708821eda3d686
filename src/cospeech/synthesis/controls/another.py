"""Another real record of the actor: real phrases that belong to other speech, the ceiling of S."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.synthesis.controls import pool
from cospeech.synthesis.interface import Speech, Synthesis, Training, decoding, phrases_of


class Model(NamedTuple):
    """The phrases of the training records, and all records of the actor in order, including the held-out one."""

    phrases: pool.Pool
    order: tuple[str, ...]


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the training phrases and the order of the actor's records."""
    return Model(training.gestures, training.order)


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the phrases of the next record, continued by those of later records if necessary, and cut to length.

    The last record is followed by the first. A record of another actor gets the records in their order.
    """
    place = model.order.index(speech.record) if speech.record in model.order else -1
    order = [*model.order[place + 1 :], *model.order[: place + 1]]
    following = [name for name in order if name in model.phrases and name != speech.record]
    starts, labels, begin = [], [], 0
    while begin < speech.n_frames:
        table = model.phrases[following[0]]
        starts.append(begin + table["start_frame"].to_numpy())
        labels.append(table["label"].to_numpy(dtype=object))
        begin += int(table["end_frame"].iloc[-1])
        following = [*following[1:], following[0]]
    first = np.concatenate(starts)
    kept = first < speech.n_frames
    return Synthesis(decoding(speech), phrases_of(speech, first[kept], np.concatenate(labels)[kept]))


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return the phrases as one segment table, and the order of the records."""
    return pool.to_tables(model.phrases) | {"order": pd.DataFrame({"record": list(model.order)})}


def from_tables(tables: Mapping[str, pd.DataFrame]) -> Model:
    """Return the model of ``to_tables``."""
    return Model(pool.from_tables(tables), tuple(tables["order"]["record"]))
