"""The HSMM's decoders under wrong speech: controls that share everything with their system but the moment."""

from __future__ import annotations

from cospeech.markov import hsmm as semi
from cospeech.synthesis import System, hsmm, hsmm_sampled
from cospeech.synthesis.result import Synthesis
from cospeech.synthesis.speech import Speech


def synthesise(
    control: System, model: semi.SemiMarkov, speech: Speech, weight: float, censoring: semi.Censoring, seed: int
) -> Synthesis:
    """Return what the decoder of ``control`` makes of ``speech``.

    Parameters
    ----------
    weight : the emission weight that ``hsmm_weighted`` and ``hsmm_sampled`` have under the record's own speech.
    """
    if control.decoder == "hsmm_sampled":
        return hsmm_sampled.synthesise(model, speech, weight, censoring, seed)
    return hsmm.synthesise(model, speech, 1.0 if control.decoder == "hsmm" else weight, censoring)
