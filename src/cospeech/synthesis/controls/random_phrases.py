"""The thesis's baseline: phrases drawn at random from the training records, appended until the record is full."""

from __future__ import annotations

import numpy as np

from cospeech.data.rng import random_source
from cospeech.synthesis.controls.pool import Pool, from_tables, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis, decoding, phrases_of

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return phrases (label and duration) drawn with replacement from all training phrases; the last one is cut.

    Each draw of the record continues the random numbers of the one before.
    """
    rng = random_source(seed, "random", speech.record)
    labels = np.concatenate([table["label"].to_numpy(dtype=object) for table in model.values()])
    lengths = np.concatenate([table["end_frame"] - table["start_frame"] for table in model.values()])
    # Enough for each draw, even if every phrase had one frame.
    drawn = rng.integers(len(labels), size=(speech.draw + 1, speech.n_frames))[speech.draw]
    starts = np.cumsum(lengths[drawn]) - lengths[drawn]
    kept = starts < speech.n_frames
    return Synthesis(decoding(speech), phrases_of(speech, starts[kept], labels[drawn[kept]]))
