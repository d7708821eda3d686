"""Body language as proposed: subunits are selected by the model at every observation (Levine 2009, chapter 5)."""

from __future__ import annotations

import pandas as pd

from cospeech.synthesis.bodylanguage import report as reports
from cospeech.synthesis.bodylanguage.model import Model, from_tables, to_tables, train
from cospeech.synthesis.bodylanguage.player import Player, end, step
from cospeech.synthesis.interface import Speech, Training
from cospeech.synthesis.live import Stream

__all__ = ["end", "from_tables", "report", "start", "step", "to_tables", "train"]


def start(model: Model, stream: Stream, seed: int) -> Player:
    """Return the state before anything is heard."""
    return Player(model, stream, seed, by_model=True, at_syllables=True)


def report(training: Training, model: Model, speech: Speech, seed: int) -> dict[str, pd.DataFrame]:
    """Return the material of the thesis's table 3.1 and figure 5.2, and the decisions."""
    stream = Stream(speech.record, speech.frame_s, speech.motion_fps)
    return reports.report(training, model, speech, start(model, stream, seed))
