"""The HSMM without its emissions: the most likely phrases of a record of that length, whatever is said."""

from __future__ import annotations

from cospeech.markov import hsmm
from cospeech.synthesis import System
from cospeech.synthesis.result import Synthesis, of_path
from cospeech.synthesis.speech import Speech

SYSTEM = System(
    name="prior",
    title="HSMM without its emissions",
    role="control",
    order=20,
)


def synthesise(model: hsmm.SemiMarkov, speech: Speech, censoring: hsmm.Censoring) -> Synthesis:
    """Return the best path at emission weight 0: of the speech only the length counts."""
    made = of_path(hsmm.decode(model, speech.labels, 0.0, censoring), speech, 0.0, censoring)
    return Synthesis(made.phrases, made.decoding.assign(driving_record=None, shift_s=None))
