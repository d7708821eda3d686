"""Systems that can run live: frame by frame, as speech is heard.

Their synthesis of a whole record is a loop over the same steps, so live and offline results cannot diverge.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion import library
from cospeech.motion.body import STANDARD
from cospeech.synthesis.declaration import Output
from cospeech.synthesis.interface import Model, Speech, Synthesis, decoding, phrases_of

State = Any
"""What a live system remembers; only its method looks inside, and changes it."""

Made = pd.DataFrame | Floats
"""What a step makes: rows of a table, or poses as an array, which is much faster.

A system that makes phrases returns rows with the columns ``start_frame`` and ``label``. One that makes motion returns
the next frames of the motion table, or their poses (n, 3 + 4 J): the position of the root in metres, then a unit
quaternion (w, x, y, z) per joint, which rotates the body part in the frame of its parent. One that makes the head
returns the angles (n, 3) of the next frames in degrees, about the axes of schema ``head``.
"""

MELODY = ("pitch", "d_pitch", "intensity")
"""Columns of the melody that systems hear."""

ANGLES = ("x_deg", "y_deg", "z_deg")

NO_MELODY: Floats = np.empty((0, len(MELODY)))


class Stream(NamedTuple):
    """What is known of speech before it is heard: a name, the distance between prosody frames, the motion's rate."""

    record: str
    frame_s: float
    motion_fps: float


class Heard(NamedTuple):
    """One prosody frame of the speech, or some frames of its melody.

    A system that needs the melody hears that and nothing else. It must not matter how many of its frames are heard at
    once: live, these are the ones of 10 ms that have become known; a whole record is heard in one step.

    Attributes
    ----------
    frame : counts from 0. time_s : centre of the frame. Of several frames of melody, those of the first one.
    label : its prosody label; empty if the system needs none.
    features : its prosody features by name; empty if the system needs none.
    syllables : the syllables that become known with this frame, usually none: the numbers of their rows in the
        syllable table by name, NaN where the table has null.
    melody : (n, 3) the columns ``MELODY`` of the next frames of melody; empty if the system needs none.
    words : the keywords of a record that end with this frame. Those of a live stream arrive by ``prepare``.
    """

    frame: int
    time_s: float
    label: str
    features: Mapping[str, float]
    syllables: tuple[Mapping[str, float], ...] = ()
    melody: Floats = NO_MELODY
    words: tuple[str, ...] = ()


class Controls(NamedTuple):
    """What can be changed while a live system runs: keywords that call for gestures, and styles of the motion."""

    keywords: tuple[str, ...] = ()
    styles: tuple[str, ...] = ()


class LiveMethod(Protocol):
    """The module behind a declaration with ``live``: these functions take the place of ``Method.synthesise``.

    A system that can be changed while it runs also has ``controls(model) -> Controls`` and ``prepare(state, name,
    value)``, where the name is ``keyword`` or ``style:<name>``. The latter raises UserError if there is no such
    keyword or style. It may be called in another thread, changes nothing, and returns a function that makes the
    change.
    """

    def start(self, model: Model, stream: Stream, seed: int) -> State:
        """Return the state before anything is heard."""

    def step(self, state: State, heard: Heard) -> Made:
        """Return what became certain with this frame, possibly no row: phrases, or frames of motion or head."""

    def end(self, state: State, speech: Speech) -> Made:
        """Return what is still missing when the speech ends; of ``speech``, only the lengths may be used."""


def frames(speech: Speech) -> Iterator[Heard]:
    """Yield the prosody frames of a whole record, one after another, or its melody at once."""
    if speech.melody is not None:
        melody = np.ascontiguousarray(speech.melody[list(MELODY)].to_numpy(dtype=float))
        yield Heard(0, float(speech.melody["time_s"].iloc[0]), "", {}, melody=melody)
        return
    names = [] if speech.prosody is None else [name for name in speech.prosody.columns if name != "frame"]
    values = np.empty((speech.n_frames, 0)) if speech.prosody is None else speech.prosody[names].to_numpy(dtype=float)
    known, ended = by_frame(speech), _words_by_frame(speech)
    for frame in range(speech.n_frames):
        label = str(speech.labels[frame]) if len(speech.labels) else ""
        features = dict(zip(names, values[frame].tolist(), strict=True))
        time_s = (frame + 0.5) * speech.frame_s
        rows, words = tuple(known.get(frame, ())), tuple(ended.get(frame, ()))
        yield Heard(frame, time_s, label, features, rows, words=words)


def by_frame(speech: Speech) -> dict[int, list[dict[str, float]]]:
    """Return the syllables that become known with each prosody frame; see ``frame_known``.

    Those that become known only because the speech ends belong to no frame: a live listener notices the end when all
    frames are over.
    """
    known: dict[int, list[dict[str, float]]] = {}
    if speech.syllables is None:
        return known
    numbers = speech.syllables.select_dtypes("number").astype(float)
    at = frame_known(numbers["known_s"].to_numpy(), speech.frame_s)
    for frame, row in zip(at.tolist(), numbers.to_numpy().tolist(), strict=True):
        known.setdefault(frame, []).append(dict(zip(numbers.columns, row, strict=True)))
    return known


def _words_by_frame(speech: Speech) -> dict[int, list[str]]:
    """Return the words that end with each prosody frame."""
    ended: dict[int, list[str]] = {}
    if speech.words is not None:
        for end_s, word in zip(speech.words["end_s"], speech.words["word"], strict=True):
            ended.setdefault(frame_at(float(end_s), speech.frame_s), []).append(str(word))
    return ended


def frame_known(known_s: Floats, frame_s: float) -> npt.NDArray[np.int64]:
    """Return the prosody frame with which syllables become known at times ``known_s`` (n,) in seconds.

    A live listener that has heard a frame to its end knows what becomes known by then.
    """
    return np.array([frame_at(one, frame_s) for one in known_s.tolist()], dtype=np.int64)


def frame_at(known_s: float, frame_s: float) -> int:
    """Return the prosody frame with which one syllable becomes known; see ``frame_known``."""
    return max(math.ceil(known_s / frame_s - 1e-6) - 1, 0)


def by_steps(method: LiveMethod, makes: Output, model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return what a live system makes of a whole record: all its steps, one after another, and its end."""
    parts = all_steps(method, model, speech, seed)
    row = decoding(speech, driving_record=speech.driving_record, shift_s=speech.shift_s)
    if makes == "phrases":
        made = pd.concat([pd.DataFrame(part, columns=["start_frame", "label"]) for part in parts], ignore_index=True)
        return Synthesis(row, phrases=phrases_of(speech, made["start_frame"], made["label"]))
    if makes == "head":
        return Synthesis(row, head=head_table(np.concatenate(parts)[: speech.n_motion_frames], speech.motion_fps))
    return Synthesis(row, motion=motion_table(parts, speech.motion_fps))


def all_steps(method: LiveMethod, model: Model, speech: Speech, seed: int) -> list[Made]:
    """Return what the steps for a whole record and its end make, without the steps that make nothing."""
    state = method.start(model, Stream(speech.record, speech.frame_s, speech.motion_fps), seed)
    steps = [method.step(state, heard) for heard in frames(speech)]
    return [part for part in (*steps, method.end(state, speech)) if len(part)]


def head_table(angles: Floats, fps: float) -> pd.DataFrame:
    """Return the table (schema ``head``) of the angles (T, 3) of a head, degrees."""
    frames = {"frame": np.arange(len(angles)), "time_s": segments.frame_times(len(angles), fps)}
    return pd.DataFrame({**frames, **dict(zip(ANGLES, angles.T, strict=True))})


def motion_table(parts: Sequence[Made], fps: float) -> pd.DataFrame:
    """Return the motion table of frames that were made one after another, as tables or as poses.

    Raises
    ------
    UserError : if the poses are of another body than that of motion tables.
    """
    tables = [part for part in parts if isinstance(part, pd.DataFrame)]
    if len(tables) == len(parts):
        return pd.concat(tables, ignore_index=True)
    rows = np.concatenate([np.asarray(part) for part in parts])
    poses = library.Poses.from_frames(rows)
    if poses.rotations.shape[1] != len(STANDARD.joints):
        raise UserError(
            f"the model moves another body, of {poses.rotations.shape[1]} joints, which a motion table cannot "
            "describe; run it with 'cospeech live'"
        )
    return library.to_motion(poses, fps)
