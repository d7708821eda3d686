"""A head that does not move: the normalised distance of every recorded head from it is 1 (Sargin 2006, eq. 4.20)."""

from __future__ import annotations

import numpy as np

from cospeech.synthesis.head.generation import N_AXES
from cospeech.synthesis.head.pool import Pool, from_tables, shown, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return angles of 0."""
    return shown(speech, np.zeros((speech.n_motion_frames, N_AXES)))
