"""The HSMM without its emissions: the most likely phrases of a record of that length, independent of the speech."""

from __future__ import annotations

from cospeech.markov import hsmm
from cospeech.synthesis.hsmm.model import Model, from_tables, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis, decoding, phrases_of

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the best path with emission weight 0, which depends only on the length of the speech."""
    path = hsmm.decode(model.hsmm, speech.labels, 0.0, model.censoring)
    row = decoding(speech, log_score=path.log_score, emission_weight=0.0, censoring=model.censoring)
    return Synthesis(row, phrases_of(speech, path.starts, path.labels))
