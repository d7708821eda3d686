"""The mean head of the training records in every frame: what can be known of a head without speech."""

from __future__ import annotations

import numpy as np

from cospeech.synthesis.head.pool import Pool, from_tables, shown, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis
from cospeech.synthesis.live import ANGLES

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return the mean angles over all frames in which the head is known."""
    known = np.concatenate([head[list(ANGLES)].dropna().to_numpy(dtype=float) for head in model.heads.values()])
    return shown(speech, np.tile(known.mean(axis=0), (speech.n_motion_frames, 1)))
