"""Head gestures as proposed: the joint patterns predict the patterns of the head (Sargin 2006, 4.3)."""

from __future__ import annotations

from cospeech.data.arrays import Floats
from cospeech.synthesis.head.model import Model, from_tables, to_tables, train
from cospeech.synthesis.head.performer import Performer, begin
from cospeech.synthesis.head.report import report
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.live import Heard, Stream

__all__ = ["end", "from_tables", "report", "start", "step", "to_tables", "train"]


def start(model: Model, stream: Stream, seed: int) -> Performer:
    """Return the state before anything is heard."""
    return begin(model, "head", stream, seed)


def step(state: Performer, heard: Heard) -> Floats:
    """Return the angles that became certain."""
    return state.hear(heard.melody)


def end(state: Performer, speech: Speech) -> Floats:
    """Return the angles that are still missing."""
    return state.end(speech.n_motion_frames)
