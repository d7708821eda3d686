"""Systems that can run live: frame by frame, as speech is heard.

Their synthesis of a whole record is a loop over the same steps, so live and offline results cannot diverge.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
import pandas as pd

from cospeech.synthesis.declaration import Output
from cospeech.synthesis.interface import Model, Speech, Synthesis, decoding, phrases_of

State = Any
"""What a live system remembers; only its method looks inside, and changes it."""


class Stream(NamedTuple):
    """What is known of speech before it is heard: a name, the distance between prosody frames, the motion's rate."""

    record: str
    frame_s: float
    motion_fps: float


class Heard(NamedTuple):
    """One prosody frame of the speech.

    Attributes
    ----------
    frame : counts from 0. time_s : centre of the frame.
    label : its prosody label; empty if the system needs none.
    features : its prosody features by name; empty if the system needs none.
    """

    frame: int
    time_s: float
    label: str
    features: Mapping[str, float]


class LiveMethod(Protocol):
    """The module behind a declaration with ``live``: these functions take the place of ``Method.synthesise``."""

    def start(self, model: Model, stream: Stream, seed: int) -> State:
        """Return the state before anything is heard."""

    def step(self, state: State, heard: Heard) -> pd.DataFrame:
        """Return what became certain with this frame, possibly no row.

        These are the next frames of the motion table (a system that makes motion), or the next phrases with the
        columns ``start_frame`` and ``label`` (a system that makes phrases).
        """

    def end(self, state: State, speech: Speech) -> pd.DataFrame:
        """Return what is still missing when the speech ends; of ``speech``, only the lengths may be used."""


def frames(speech: Speech) -> Iterator[Heard]:
    """Yield the prosody frames of a whole record, one after another."""
    names = [] if speech.prosody is None else [name for name in speech.prosody.columns if name != "frame"]
    values = np.empty((speech.n_frames, 0)) if speech.prosody is None else speech.prosody[names].to_numpy(dtype=float)
    for frame in range(speech.n_frames):
        label = str(speech.labels[frame]) if len(speech.labels) else ""
        features = dict(zip(names, values[frame].tolist(), strict=True))
        yield Heard(frame, (frame + 0.5) * speech.frame_s, label, features)


def by_steps(method: LiveMethod, makes: Output, model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return what a live system makes of a whole record: all its steps, one after another, and its end."""
    state = method.start(model, Stream(speech.record, speech.frame_s, speech.motion_fps), seed)
    parts = [method.step(state, heard) for heard in frames(speech)]
    made = pd.concat([*parts, method.end(state, speech)], ignore_index=True)
    row = decoding(speech, driving_record=speech.driving_record, shift_s=speech.shift_s)
    if makes == "phrases":
        return Synthesis(row, phrases=phrases_of(speech, made["start_frame"], made["label"]))
    return Synthesis(row, motion=made)
