"""Training data and driving speech of a fold, or of a whole actor, from the tables of other rooms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Labels
from cospeech.errors import UserError
from cospeech.synthesis.interface import Planted, Training
from cospeech.synthesis.speech import Streams, frame_labels

Value = TypeVar("Value")

MELODY_S = 0.01
"""Frame period of melodies in seconds."""


class Actor(NamedTuple):
    """An actor, with the frames and labels that all tables of the actor use.

    Attributes
    ----------
    name : the actor. records : the records of the actor in the order of the corpus.
    frame_s : distance between prosody frames in seconds. labels : gesture classes. symbols : prosody clusters.
    """

    name: str
    records: Sequence[str]
    frame_s: float
    labels: Sequence[str]
    symbols: Sequence[str]


class Truth(NamedTuple):
    """What the virtual studio planted: the tables of its process, and its phrases, of all actors."""

    model: Mapping[str, pd.DataFrame]
    gestures: pd.DataFrame
    prosody: pd.DataFrame


def fold(
    actor: Actor,
    held_out: str | None,
    gestures: pd.DataFrame,
    prosody_segments: pd.DataFrame,
    prosody: Mapping[str, pd.DataFrame] | None = None,
    motions: Mapping[str, pd.DataFrame] | None = None,
    truth: Truth | None = None,
    syllables: Mapping[str, pd.DataFrame] | None = None,
    phases: pd.DataFrame | None = None,
    subunits: Mapping[str, pd.DataFrame] | None = None,
) -> tuple[Training, Streams]:
    """Return what systems may learn from if ``held_out`` is left out, and the speech of all records of the actor.

    Parameters
    ----------
    held_out : the record to leave out; None for a model of all records.
    gestures : gesture segments of the actor's records at any rate; those of the held-out record are ignored.
    prosody_segments : prosody segments of all the actor's records on the prosody frame.
    prosody, motions, syllables : prosody, motion and syllable tables by record, if a system needs them.
    phases, subunits : gesture phases, and gesture subunits by body section, of all records that are learnt from, if a
        system needs them.

    Raises
    ------
    UserError : if no record is left to learn from, a record has no speech, or segments have gaps.
    """
    labels = frame_labels(prosody_segments)
    lengths = {name: len(stream) for name, stream in labels.items()}
    phrases = training_phrases(gestures, lengths, actor.frame_s, held_out)
    spoken = planted_labels(truth.prosody, lengths, actor.frame_s) if truth else {}
    known = Training(
        actor=actor.name,
        frame_s=actor.frame_s,
        labels=tuple(actor.labels),
        symbols=tuple(actor.symbols),
        gestures=phrases,
        speech=_only(phrases, labels),
        prosody=_only(phrases, prosody or {}),
        motions=_only(phrases, motions or {}),
        syllables=_only(phrases, syllables or {}),
        phases=_only(phrases, _by_record(phases)),
        subunits=_only(phrases, _by_section(subunits or {})),
        order=tuple(actor.records),
        planted=_planted(actor, held_out, truth, spoken) if truth else None,
    )
    return known, Streams(labels, prosody or {}, spoken, syllables or {})


def head_fold(
    actor: str, held_out: str | None, melodies: Mapping[str, pd.DataFrame], heads: Mapping[str, pd.DataFrame]
) -> tuple[Training, Streams]:
    """Return what systems that move the head may learn from, and the melodies of all records of the actor.

    Parameters
    ----------
    actor : name of the actor.
    held_out : the record to leave out; None for a model of all records.
    melodies, heads : melody and angles of the head of all records of the actor, in the order of the corpus. The
        frames of the session are those of the melodies.

    Raises
    ------
    UserError : if no record is left to learn from.
    """
    learnt = {name: table for name, table in heads.items() if name != held_out}
    if not learnt:
        raise UserError(f"record {held_out}: its actor has no other record to learn from; add one")
    known = Training(
        actor=actor,
        frame_s=MELODY_S,
        labels=(),
        symbols=(),
        gestures={},
        speech={},
        melodies=_only(learnt, melodies),
        heads=learnt,
        order=tuple(heads),
    )
    return known, Streams({}, melodies=melodies)


def _by_record(table: pd.DataFrame | None) -> dict[str, pd.DataFrame]:
    if table is None:
        return {}
    return {str(name): part.reset_index(drop=True) for name, part in table.groupby("record", sort=False)}


def _by_section(sections: Mapping[str, pd.DataFrame]) -> dict[str, dict[str, pd.DataFrame]]:
    """Return the tables of each record by section, of tables that contain all records."""
    parts = {section: _by_record(table) for section, table in sections.items()}
    names = dict.fromkeys(name for tables in parts.values() for name in tables)
    return {name: {section: tables[name] for section, tables in parts.items()} for name in names}


def training_phrases(
    gestures: pd.DataFrame, lengths: Mapping[str, int], frame_s: float, held_out: str | None = None
) -> dict[str, pd.DataFrame]:
    """Return the gesture phrases of each training record on the prosody frame.

    Parameters
    ----------
    gestures : gesture segments of the actor's records at any rate; those of the held-out record are left out.
    lengths : length of each of the actor's records in prosody frames.

    Raises
    ------
    UserError : if no record is left to learn from, a record has no speech, or segments have gaps.
    """
    if held_out is not None and held_out not in lengths:
        raise UserError(f"record {held_out}: has no prosody segments; delete the results of its fold and run again")
    phrases = {}
    for key, table in gestures[gestures["record"] != held_out].groupby("record", sort=False):
        name = str(key)
        if name not in lengths:
            raise UserError(f"record {name}: has gesture segments but no prosody segments; run the workflow again")
        segments.check(table, f"gesture segments of record {name}")
        phrases[name] = segments.resample(table, lengths[name], 1 / frame_s)
    if not phrases:
        raise UserError(f"record {held_out}: its actor has no other record to learn from; add one")
    return phrases


def planted_labels(planted: pd.DataFrame, lengths: Mapping[str, int], frame_s: float) -> dict[str, Labels]:
    """Return the planted prosody label of every frame, (T,), of each record of ``lengths``.

    Parameters
    ----------
    planted : planted prosody segments of all records at any rate.
    lengths : length of each record in prosody frames.
    """
    return {
        name: segments.to_labels(segments.resample(planted[planted["record"] == name], n_frames, 1 / frame_s))
        for name, n_frames in lengths.items()
    }


def _planted(actor: Actor, held_out: str | None, truth: Truth, spoken: Mapping[str, Labels]) -> Planted:
    lengths = {name: len(stream) for name, stream in spoken.items()}
    own = truth.gestures[truth.gestures["record"].isin(list(lengths))]
    phrases = training_phrases(own, lengths, actor.frame_s, held_out)
    model = {name: table[table["actor"] == actor.name] for name, table in truth.model.items()}
    return Planted(model, phrases, _only(phrases, spoken))


def _only(names: Mapping[str, pd.DataFrame], mapping: Mapping[str, Value]) -> dict[str, Value]:
    return {name: mapping[name] for name in names if name in mapping}
