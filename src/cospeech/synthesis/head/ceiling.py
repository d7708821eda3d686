"""A ceiling of the prediction of head patterns: gradient boosting over the melody patterns around a frame."""

from __future__ import annotations

import numpy as np

from cospeech.synthesis import live
from cospeech.synthesis.head.boosting import BoostedLabeller
from cospeech.synthesis.head.model import Model, from_tables, to_tables, train
from cospeech.synthesis.head.performer import Performer
from cospeech.synthesis.head.prediction import HEAD, MELODY
from cospeech.synthesis.interface import Speech, Synthesis, decoding
from cospeech.synthesis.live import Stream

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the angles of the patterns that are most probable given the melody of the whole record."""
    symbols = [example.symbols for example in model.examples]
    labeller = BoostedLabeller(
        [own[:, MELODY] for own in symbols], [own[:, HEAD] for own in symbols], len(model.stage.melody.labels)
    )
    stream = Stream(speech.record, speech.frame_s, speech.motion_fps)
    # The noise is that of the system which comes closest.
    performer = Performer(model, labeller, model.noise["head_weighted"], stream, seed)
    parts = [performer.hear(heard.melody) for heard in live.frames(speech)]
    parts.append(performer.end(speech.n_motion_frames))
    made = np.concatenate(parts)[: speech.n_motion_frames]
    row = decoding(speech, driving_record=speech.driving_record, shift_s=speech.shift_s)
    return Synthesis(row, head=live.head_table(made, speech.motion_fps))
