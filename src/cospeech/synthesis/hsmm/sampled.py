"""A path drawn from the posterior of the weighted HSMM, as the best path has too few and too regular phrases."""

from __future__ import annotations

from cospeech.data.rng import random_source
from cospeech.markov import hsmm
from cospeech.synthesis.hsmm.model import Model, from_tables, synthesis, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return a path drawn with probability proportional to exp(score); its own score is the ``log_score``."""
    rng = random_source(seed, "hsmm_sampled", speech.record)
    path = hsmm.sample(model.hsmm, speech.labels, rng, model.weight, model.censoring)
    return synthesis(path, speech, model.weight, model.censoring)
