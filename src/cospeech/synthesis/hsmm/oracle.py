"""The HSMM with the parameters that the virtual studio planted, driven by the prosody that it planted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cospeech.errors import UserError
from cospeech.markov import hsmm
from cospeech.synthesis.hsmm import tables, weighted
from cospeech.synthesis.hsmm.model import Model, best_weight, from_tables, to_tables
from cospeech.synthesis.interface import Speech, Synthesis, Training

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the planted model, floored like a trained one, with the weight that works best for the training records.

    Raises
    ------
    UserError : if nothing was planted.
    """
    planted = training.planted
    if planted is None:
        raise UserError("the planted parameters exist for actors of the virtual studio only")
    model = hsmm.floored(tables.from_tables(planted.model), settings["floor"])
    weight = best_weight(
        planted.gestures,
        planted.speech,
        dict.fromkeys(planted.gestures, model),
        settings["emission_weights"],
        settings["censoring"],
    )
    return Model(model, training.frame_s, settings["floor"], weight, settings["censoring"])


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the best path under the planted prosody.

    Raises
    ------
    UserError : if the prosody of the speech was not planted.
    """
    if speech.planted is None:
        raise UserError(f"{speech.record}: its prosody was not planted by the virtual studio; use another system")
    return weighted.synthesise(model, replace(speech, labels=speech.planted), seed)
