"""A path drawn from the HSMM's posterior in place of the best one, which has too few phrases and too regular ones.

Model and emission weight are those of ``hsmm_weighted``.
"""

from __future__ import annotations

from cospeech.markov import hsmm
from cospeech.synthesis import System
from cospeech.synthesis.result import Synthesis, of_path
from cospeech.synthesis.speech import Speech, random_source

SYSTEM = System(
    name="hsmm_sampled",
    title="HSMM, drawn from the posterior",
    role="system",
    order=30,
)


def synthesise(
    model: hsmm.SemiMarkov, speech: Speech, weight: float, censoring: hsmm.Censoring, seed: int
) -> Synthesis:
    """Return a path drawn with probability proportional to exp(score); its own score is the ``log_score``.

    Parameters
    ----------
    seed : the run's seed; what is drawn depends on it, on the record and on the speech that is heard.
    """
    rng = random_source(seed, SYSTEM.name, speech.record)
    return of_path(hsmm.sample(model, speech.labels, rng, weight, censoring), speech, weight, censoring)
