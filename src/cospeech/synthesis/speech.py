"""The speech that drives the synthesis of a record: its own, another record's, or its own at the wrong moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Integers, Labels
from cospeech.data.rng import random_source
from cospeech.synthesis.declaration import Drive
from cospeech.synthesis.interface import Speech


@dataclass(frozen=True)
class Streams:
    """The speech of an actor's records, frame by frame; each mapping goes from a record to its stream.

    Attributes
    ----------
    labels : (T,) prosody labels. prosody : prosody tables of T rows. planted : (T,) planted prosody labels.
    syllables : syllable tables. melodies : melody tables of T rows, of a session whose frames are those of 100 Hz.
    """

    labels: Mapping[str, Labels]
    prosody: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    planted: Mapping[str, Labels] = field(default_factory=dict)
    syllables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    melodies: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    @property
    def lengths(self) -> dict[str, int]:
        """The length of each record in frames."""
        streams: Mapping[str, Labels | pd.DataFrame] = self.labels or self.prosody or self.melodies
        return {name: len(stream) for name, stream in streams.items()}


def frame_labels(prosody: pd.DataFrame) -> dict[str, Labels]:
    """Return the label of every frame of each record, (T,), of a segment table of several records."""
    labels = {}
    for name, table in prosody.groupby("record", sort=False):
        segments.check(table, f"prosody segments of record {name}")
        labels[str(name)] = segments.to_labels(table)
    return labels


class Wrong(NamedTuple):
    """How the matched controls of a record are driven by the wrong speech.

    Attributes
    ----------
    shift_s : smallest shift of a record's own speech in either direction.
    head_s, tail_s : the ends of a record, which scores of its interior leave out.
    """

    shift_s: float
    head_s: float = 0.0
    tail_s: float = 0.0


class Source(NamedTuple):
    """Where driving speech comes from: a record, its frames (T,), and the shift of its interior in seconds."""

    record: str
    frames: Integers
    shift_s: float = 0.0


def sources(
    lengths: Mapping[str, int], record: str, drive: Drive, frame_s: float, seed: int, wrong: Wrong, draws: int
) -> list[Source]:
    """Return where the speech that drives ``record`` comes from, one source per draw.

    ``own`` is the record's own speech in every draw, ``shuffled`` that of a different other record in each, and
    ``shifted`` its own, shifted circularly by a different time of at least ``wrong.shift_s`` in either direction.
    There are fewer draws if there are fewer other records, or fewer shifts.

    Wrong speech never carries the ends of a record into the interior that is scored, where pauses and resting hands
    at both ends would go together at the wrong moment: the interior of a record is driven by the interior of its own
    or the other record, shifted circularly or repeated to length, and its ends are driven by the corresponding ends.

    Parameters
    ----------
    lengths : length in frames of each record of the actor.
    seed : seed of the run. What is drawn depends only on it and on the record, so that the matched controls of all
        systems are driven by the same speech.

    Returns
    -------
    Sources; none if the record is too short to be shifted, or if no other record has an interior.
    """
    n_frames = lengths[record]
    if drive == "own":
        return [Source(record, np.arange(n_frames))] * draws
    rng = random_source(seed, record, drive)

    def interior(name: str) -> tuple[int, int]:
        return segments.interior(lengths[name], frame_s, wrong.head_s, wrong.tail_s)

    place = interior(record)
    if drive == "shuffled":
        others = [name for name in lengths if name != record and interior(name)[0] < interior(name)[1]]
        chosen = [others[k] for k in rng.permutation(len(others))[:draws]]
        return [Source(name, _in_place(n_frames, place, lengths[name], interior(name), 0)) for name in chosen]
    least = round(wrong.shift_s / frame_s)
    possible = place[1] - place[0] - 2 * least + 1
    n_shifts = max(0, min(draws, possible))
    # Spread evenly over all possible shifts, in random order.
    shifts = least + np.floor((rng.uniform() + rng.permutation(n_shifts)) * possible / max(1, n_shifts))
    return [
        Source(record, _in_place(n_frames, place, n_frames, place, int(shift)), int(shift) * frame_s)
        for shift in shifts
    ]


def _in_place(
    n_frames: int, place: tuple[int, int], n_source: int, interior: tuple[int, int], shift: int
) -> Integers:
    """Return the frame of a source that drives each frame of a record: interior by interior, end by end.

    Parameters
    ----------
    n_frames, place : length of the record, and the first frame of its interior and the first frame after it.
    n_source, interior : the same of the source, whose interior has at least one frame.
    shift : circular shift of the source's interior in frames.
    """
    frames = np.arange(n_frames)
    inner = interior[0] + (frames - place[0] + shift) % (interior[1] - interior[0])
    ends = np.where(frames < place[0], frames, frames - n_frames + n_source)
    return np.where((frames >= place[0]) & (frames < place[1]), inner, ends)


def driving_speeches(
    streams: Streams,
    record: str,
    frame_s: float,
    drive: Drive = "own",
    seed: int = 0,
    wrong: Wrong = Wrong(0.0),  # noqa: B008
    draws: int = 1,
) -> list[Speech]:
    """Return the speech that drives ``record``, once per draw; see ``sources``."""
    lengths = streams.lengths
    drawn = sources(lengths, record, drive, frame_s, seed, wrong, draws)
    return [
        _speech(streams, source, Speech(record, frame_s, lengths[record], draw=draw), drive)
        for draw, source in enumerate(drawn)
    ]


def _speech(streams: Streams, source: Source, silent: Speech, drive: Drive) -> Speech:
    name, frames, frame_s = source.record, source.frames, silent.frame_s
    speech = replace(silent, driving_record=name, shift_s=source.shift_s)
    if name in streams.labels:
        speech = replace(speech, labels=streams.labels[name][frames])
    if name in streams.prosody:
        speech = replace(speech, prosody=_moved_frames(streams.prosody[name], frames, frame_s, drive))
    if name in streams.melodies:
        speech = replace(speech, melody=_moved_frames(streams.melodies[name], frames, frame_s, drive))
    if name in streams.syllables:
        moved = moved_syllables(streams.syllables[name], frames, frame_s)
        speech = replace(speech, syllables=moved.assign(record=speech.record))
    if name in streams.planted:
        speech = replace(speech, planted=streams.planted[name][frames])
    return speech


def _moved_frames(table: pd.DataFrame, frames: Integers, frame_s: float, drive: Drive) -> pd.DataFrame:
    """Return the rows of a table that drive a record, with the times of the record."""
    moved = table.iloc[frames].reset_index(drop=True)
    if drive != "own":
        moved["frame"], moved["time_s"] = np.arange(len(moved)), segments.frame_times(len(moved), 1 / frame_s)
    return moved


def moved_syllables(syllables: pd.DataFrame, frames: Integers, frame_s: float) -> pd.DataFrame:
    """Return the syllables of a source at the times at which its frames drive a record.

    Each stretch of consecutive frames brings the syllables that peak in it, cut where it begins and ends.

    Parameters
    ----------
    syllables : syllable table of the source.
    frames : (T,) the frame of the source that drives each frame of the record.
    """
    cuts = np.flatnonzero(np.diff(frames) != 1) + 1
    parts = []
    for first, end in zip([0, *cuts], [*cuts, len(frames)], strict=True):
        begin_s, moved_by_s = frames[first] * frame_s, (first - frames[first]) * frame_s
        end_s = begin_s + (end - first) * frame_s
        # The first and the last stretch may reach beyond the frames: sound need not end with a whole frame.
        inside = (syllables["peak_s"] >= begin_s) & ((syllables["peak_s"] < end_s) | (end == len(frames)))
        part = syllables[inside].copy()
        for name, low, high in (
            ("start_s", begin_s, np.inf),
            ("end_s", -np.inf, end_s if end < len(frames) else np.inf),
        ):
            part[name] = part[name].clip(low, high)
        for name in ("start_s", "peak_s", "end_s", "known_s"):
            part[name] = (part[name] + moved_by_s).clip(lower=0.0)
        parts.append(part)
    moved = pd.concat(parts, ignore_index=True)
    moved["syllable"] = np.arange(len(moved))
    return moved
