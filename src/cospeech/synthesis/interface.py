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
"""A trained model. Only the method that trained it knows what it contains."""


@dataclass(frozen=True)
class Planted:
    """What the virtual studio planted: the ground truth, for ceilings.

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
    """What a system may learn from: an actor's records, except the one that a fold holds out.

    What the declaration of the system does not need may be empty or None.

    Attributes
    ----------
    actor : the actor of the records.
    frame_s : distance between prosody frames in seconds.
    labels : gesture classes.
    symbols : prosody clusters.
    gestures : segment table of the gesture phrases of each record, on the prosody frame.
    speech : (T,) prosody label of every frame, of each record.
    prosody : prosody table of each record.
    motions : motion table of each record, at its own rate.
    syllables : syllable table of each record.
    phases : table of the gesture phases of each record.
    subunits : tables of the gesture subunits of each record, by body section: head, arms and legs.
    melodies : table of pitch and intensity at 100 Hz of each record (schema ``melody``).
    heads : table of the angles of the head of each record, at its own rate (schema ``head``).
    order : names of all records of the actor in the order of the corpus, including the held-out one.
    planted : the ground truth of the virtual studio.
    """

    actor: str
    frame_s: float
    labels: tuple[str, ...]
    symbols: tuple[str, ...]
    gestures: Mapping[str, pd.DataFrame]
    speech: Mapping[str, Labels]
    prosody: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    motions: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    syllables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    phases: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    subunits: Mapping[str, Mapping[str, pd.DataFrame]] = field(default_factory=dict)
    melodies: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    heads: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    planted: Planted | None = None


@dataclass(frozen=True)
class Speech:
    """The speech that drives the synthesis of a record.

    Attributes
    ----------
    record : the record to synthesise.
    frame_s : distance between prosody frames in seconds.
    n_frames : length of the record in prosody frames.
    labels : (T,) prosody label of every frame; empty if the system needs none.
    prosody : prosody table of T rows, or None. Its times are those of the record, whatever record drives it.
    syllables : syllable table, or None. Its times are those of the record, too.
    melody : pitch and intensity at 100 Hz (schema ``melody``), or None. Its times are those of the record, too.
    words : words that call for gestures (schema ``words``), or None.
    planted : (T,) planted prosody label of every frame, or None.
    driving_record : the record that the speech comes from.
    shift_s : circular shift of the interior of the driving record (see ``speech.sources``).
    draw : which draw of a control that depends on chance this is, counted from 0.
    motion_fps, n_motion_frames : frame rate and length of the motion to return, for systems that make motion, or of
        the angles of the head, for systems that make those.
    """

    record: str
    frame_s: float
    n_frames: int
    labels: Labels = field(default_factory=lambda: np.empty(0, dtype=object))
    prosody: pd.DataFrame | None = None
    syllables: pd.DataFrame | None = None
    melody: pd.DataFrame | None = None
    words: pd.DataFrame | None = None
    planted: Labels | None = None
    driving_record: str = ""
    shift_s: float = 0.0
    draw: int = 0
    motion_fps: float = 0.0
    n_motion_frames: int = 0


class Synthesis(NamedTuple):
    """What a system made of the speech of a record: phrases, motion or angles of the head, as it declares.

    Attributes
    ----------
    decoding : one row on how it was made (schema ``decoding``).
    phrases : gesture phrases on the prosody frame (schema ``segments``), or None.
    motion : motion table, or None.
    head : angles of the head (schema ``head``), or None.
    """

    decoding: pd.DataFrame
    phrases: pd.DataFrame | None = None
    motion: pd.DataFrame | None = None
    head: pd.DataFrame | None = None


class Method(Protocol):
    """The module behind a declaration."""

    def train(self, training: Training, settings: Mapping[str, Any]) -> Model:
        """Return a model of the actor.

        ``settings`` are the section ``synthesis`` of the configuration, with the system's own settings on top.
        """

    def synthesise(self, model: Model, speech: Speech, seed: int) -> Synthesis:
        """Return phrases, motion or angles of the head for the speech. Equal seeds must give equal results."""

    def to_tables(self, model: Model) -> dict[str, pd.DataFrame]:
        """Return the model as tables, with the names that the declaration lists."""

    def from_tables(self, tables: Mapping[str, pd.DataFrame]) -> Model:
        """Return the model that ``to_tables`` converted, without loss.

        A system that needs motion gets the motion table of each training record as well, as ``motion~<record>``: they
        are stored once, next to the model, and need not be among its tables.
        """


class Reporting(Protocol):
    """What the module behind a declaration with ``reports`` has in addition."""

    def report(self, training: Training, model: Model, speech: Speech, seed: int) -> dict[str, pd.DataFrame]:
        """Return the declared reports: tables about what the model does with the speech of a record.

        They are written next to what it makes, as material for exhibits, and do not influence it.
        """


def decoding(speech: Speech, **values: Any) -> pd.DataFrame:
    """Return the row of schema ``decoding`` for a record; values that are not given are null."""
    columns = ("log_score", "emission_weight", "censoring", "driving_record", "shift_s", "failure")
    given = {name: [values.get(name)] for name in columns}
    return pd.DataFrame({"record": [speech.record], "draw": [speech.draw]} | given)


def phrases_of(speech: Speech, starts: npt.ArrayLike, labels: npt.ArrayLike) -> pd.DataFrame:
    """Return the segment table of phrases that start at frames ``starts``, (L,), and together fill the record."""
    return segments.from_starts(speech.record, starts, labels, speech.n_frames, 1 / speech.frame_s)
