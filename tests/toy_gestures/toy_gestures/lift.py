"""Both hands rise with the intensity of the speech."""

import numpy as np
import pandas as pd

from cospeech.motion import skeleton
from cospeech.synthesis.interface import Synthesis, decoding


def train(training, settings):
    """Return a table of one row: the intensities of hanging and of fully raised hands, and the highest angle."""
    intensity = np.concatenate([table["intensity"] for table in training.prosody.values()])
    low, high = np.quantile(intensity, [0.2, 0.95])
    return pd.DataFrame({"low": [low], "high": [high], "highest_deg": [settings["highest_deg"]]})


def synthesise(model, speech, seed):
    """Return the motion of a standing body whose forearms are bent in proportion to the intensity."""
    low, high, highest_deg = model.iloc[0]
    motion = skeleton.standing(speech.n_motion_frames, speech.motion_fps)
    intensity = np.interp(motion["time_s"], speech.prosody["time_s"], speech.prosody["intensity"])
    for joint in ("left_forearm", "right_forearm"):
        motion[f"{joint}_x_deg"] = -highest_deg * np.clip((intensity - low) / (high - low), 0.0, 1.0)
    row = decoding(speech, driving_record=speech.driving_record, shift_s=speech.shift_s)
    return Synthesis(row, motion=motion)


def to_tables(model):
    """Return the model, which is a table already."""
    return {"lift": model}


def from_tables(tables):
    """Return the model of ``to_tables``."""
    return tables["lift"]
