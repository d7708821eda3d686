"""The HSMM with an emission weight that was chosen inside the training records."""

from __future__ import annotations

from cospeech.markov import hsmm
from cospeech.synthesis.hsmm.model import Model, from_tables, synthesis, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the best path under the weighted emissions."""
    path = hsmm.decode(model.hsmm, speech.labels, model.weight, model.censoring)
    return synthesis(path, speech, model.weight, model.censoring)
