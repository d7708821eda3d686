"""The most frequent label throughout: many frames are right, and nothing else is."""

from __future__ import annotations

import numpy as np

from cospeech.data import segments
from cospeech.synthesis.controls.pool import Pool, from_tables, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis, decoding, phrases_of

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return one phrase over all frames, of the label with most training frames; the first by name among equals."""
    labels, frames = np.unique(
        np.concatenate([segments.to_labels(table) for table in model.values()]).astype(str),
        return_counts=True,
    )
    return Synthesis(decoding(speech), phrases_of(speech, [0], [labels[frames.argmax()]]))
