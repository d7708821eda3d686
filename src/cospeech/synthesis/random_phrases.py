"""The thesis's baseline: phrases drawn at random from the training records, appended until the record is full."""

from __future__ import annotations

import numpy as np

from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.result import Synthesis, without_model
from cospeech.synthesis.speech import random_source

SYSTEM = System(
    name="random",
    title="Random phrases",
    role="control",
    order=10,
)


def synthesise(fold: Fold, seed: int) -> Synthesis:
    """Return phrases (label and duration) drawn with replacement from all training phrases; the last one is cut."""
    rng = random_source(seed, SYSTEM.name, fold.record)
    labels = np.concatenate([table["label"].to_numpy(dtype=object) for table in fold.gestures.values()])
    lengths = np.concatenate([table["end_frame"] - table["start_frame"] for table in fold.gestures.values()])
    drawn = rng.integers(len(labels), size=fold.n_frames)  # enough even if every phrase had one frame
    starts = np.cumsum(lengths[drawn]) - lengths[drawn]
    kept = starts < fold.n_frames
    return without_model(fold, starts[kept], labels[drawn[kept]])
