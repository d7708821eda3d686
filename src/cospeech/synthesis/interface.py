"""What passes between a system and its surroundings: training data in, a model, speech in, phrases or motion out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Labels

Model = Any
"""A trained model; only the method that made it looks inside."""


@dataclass(frozen=True)
class Planted:
    """What the virtual studio planted, for a ceiling that knows the truth.

    Attributes
    ----------
    model : the planted tables initial, transitions, emissions and durations of the actor.
    gestures : segment table of the planted gesture phrases of each training record, on the prosody frame.
    speech : (T,) planted prosody label of every frame, of each training record.
    """

    model: Mapping[str, pd.DataFrame]
    gestures: Mapping[str, pd.DataFrame]
    speech: Mapping[str, Labels]


@dataclass(frozen=True)
class Training:
    """What a system may learn from: an actor's records, without the one that a fold holds out.

    Only what the system's declaration needs is there; the rest is empty or None.

    Attributes
    ----------
    actor : whose records.
    frame_s : distance between prosody frames in seconds.
    labels : gesture classes.
    symbols : prosody clusters.
    gestures : segment table of the gesture phrases of each record, on the prosody frame.
    speech : (T,) prosody label of every frame, of each record.
    prosody : prosody table of each record.
    motions : motion table of each record, at its own rate.
    order : all records of the actor in the order of the corpus, the held-out one among them.
    planted : the truth of the virtual studio.
    """

    actor: str
    frame_s: float
    labels: tuple[str, ...]
    symbols: tuple[str, ...]
    gestures: Mapping[str, pd.DataFrame]
    speech: Mapping[str, Labels]
    prosody: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    motions: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    planted: Planted | None = None


@dataclass(frozen=True)
class Speech:
    """What a system listens to while it synthesises a record.

    Attributes
    ----------
    record : the record that is synthesised.
    frame_s : distance between prosody frames in seconds.
    n_frames : length of the record in prosody frames.
    labels : (T,) prosody label of every frame; empty where the system needs none.
    prosody : prosody table of T rows, or None.
    planted : (T,) planted prosody label of every frame, or None.
    driving_record : the record that the speech comes from.
    shift_s : circular shift: second ``shift_s`` of the driving record is heard first.
    motion_fps, n_motion_frames : frame rate and length of the motion that a system which makes motion returns.
    """

    record: str
    frame_s: float
    n_frames: int
    labels: Labels = field(default_factory=lambda: np.empty(0, dtype=object))
    prosody: pd.DataFrame | None = None
    planted: Labels | None = None
    driving_record: str = ""
    shift_s: float = 0.0
    motion_fps: float = 0.0
    n_motion_frames: int = 0


class Synthesis(NamedTuple):
    """What a system made of a record's speech.

    Attributes
    ----------
    decoding : one row on how it was made (schema ``decoding``).
    phrases : gesture phrases on the prosody frame (schema ``segments``), or None for a system that makes motion.
    motion : motion table, or None for a system that makes phrases.
    """

    decoding: pd.DataFrame
    phrases: pd.DataFrame | None = None
    motion: pd.DataFrame | None = None


class Method(Protocol):
    """The module behind a declaration."""

    def train(self, training: Training, settings: Mapping[str, Any]) -> Model:
        """Return a model of the actor. Systems that share this function share the model."""

    def synthesise(self, model: Model, speech: Speech, seed: int) -> Synthesis:
        """Return phrases or motion for the speech; the same seed gives the same result."""

    def to_tables(self, model: Model) -> dict[str, pd.DataFrame]:
        """Return the model as the tables that the declaration names."""

    def from_tables(self, tables: Mapping[str, pd.DataFrame]) -> Model:
        """Return the model of these tables, without loss."""


def decoding(speech: Speech, **values: Any) -> pd.DataFrame:
    """Return the row of schema ``decoding`` for a record; what is not given is null."""
    columns = ("log_score", "emission_weight", "censoring", "driving_record", "shift_s", "failure")
    return pd.DataFrame({"record": [speech.record]} | {name: [values.get(name)] for name in columns})


def phrases_of(speech: Speech, starts: npt.ArrayLike, labels: npt.ArrayLike) -> pd.DataFrame:
    """Return the segment table of phrases that start at frames ``starts``, (L,), and fill the record."""
    return segments.from_starts(speech.record, starts, labels, speech.n_frames, 1 / speech.frame_s)
