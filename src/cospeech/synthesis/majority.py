"""The most frequent label all the time: it gets most of the share of frames right, and nothing else."""

from __future__ import annotations

import numpy as np

from cospeech.data import segments
from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.result import Synthesis, without_model

SYSTEM = System(
    name="majority",
    title="Most frequent label",
    role="control",
    order=40,
)


def synthesise(fold: Fold) -> Synthesis:
    """Return one phrase over all frames, of the label with most training frames; of equals the first by name."""
    labels, frames = np.unique(
        np.concatenate([segments.to_labels(table) for table in fold.gestures.values()]).astype(str),
        return_counts=True,
    )
    return without_model(fold, [0], [labels[frames.argmax()]])
