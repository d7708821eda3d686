"""The offline controller (Levine et al. 2010, 7.1): the lowest-cost animation of a whole utterance.

It has the model and the prosody of the online controller, but it knows the whole utterance at each decision: the
beliefs are smoothed, and the path through the library is found by dynamic programming.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.synthesis import live
from cospeech.synthesis.controller import inference, offline, steps
from cospeech.synthesis.controller import report as experiments
from cospeech.synthesis.controller.control import NEUTRAL
from cospeech.synthesis.controller.model import Model, train
from cospeech.synthesis.controller.show import Screen
from cospeech.synthesis.controller.tables import from_tables, to_tables
from cospeech.synthesis.interface import Speech, Synthesis, Training, decoding

__all__ = ["from_tables", "report", "synthesise", "to_tables", "train"]


def synthesise(model: Model, speech: Speech, seed: int) -> Synthesis:
    """Return the motion of the lowest-cost path; the score is its negative cost."""
    layer = model.control
    n_steps = math.ceil(speech.n_motion_frames / speech.motion_fps / layer.step_s)
    beliefs = inference.smoothed(model.layer, prosody(model, speech, n_steps))
    found = offline.animate(layer.cut, layer.rows, layer.tones[NEUTRAL].distances, beliefs)
    screen = Screen(layer, speech.motion_fps)
    made = []
    while screen.shown < speech.n_motion_frames:
        made.append(screen.next(int(found.path.segment[screen.step]), int(found.path.frame[screen.step])))
    row = decoding(speech, log_score=-found.cost, driving_record=speech.driving_record, shift_s=speech.shift_s)
    return Synthesis(row, motion=live.motion_table([np.array(made)], speech.motion_fps))


def report(training: Training, model: Model, speech: Speech, seed: int) -> dict[str, pd.DataFrame]:
    """Return the material of the controller's exhibits (see ``report``), with the speech of a record."""
    heard = prosody(model, speech, math.ceil(speech.n_motion_frames / speech.motion_fps / model.control.step_s))
    return {
        "windows": experiments.windows(training, model, seed),
        "regret": experiments.regret(model, heard),
        "control_layer": experiments.control_layer(model),
        "beliefs": experiments.beliefs(model, heard),
        "decisions": experiments.decisions(model, heard),
    }


def prosody(model: Model, speech: Speech, n_steps: int) -> Floats:
    """Return the prosody of the time steps of a record, (T, 3), as it is known at each of them."""
    if speech.syllables is None:
        raise UserError(f"record {speech.record}: has no syllables, which drive the controller; add its sound")
    found = steps.syllables_of(speech.syllables)
    return steps.prosody(found, n_steps, model.control.step_s, model.pause_db)
