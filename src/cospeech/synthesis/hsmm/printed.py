"""The hidden semi-Markov model as printed: the best path under the full emissions (Özkul 2012, eq. 5.9, Alg. 1)."""

from __future__ import annotations

from cospeech.markov import hsmm
from cospeech.synthesis.hsmm.model import Model, from_tables, synthesis, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the best path."""
    return synthesis(hsmm.decode(model.hsmm, speech.labels, 1.0, model.censoring), speech, 1.0, model.censoring)
