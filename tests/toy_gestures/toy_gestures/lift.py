"""Both hands rise with the intensity of the speech, while it is heard."""

import numpy as np
import pandas as pd

from cospeech.motion import skeleton


class State:
    """The intensities heard so far, and the number of frames that have been shown."""

    def __init__(self, model, stream):
        self.model = model
        self.stream = stream
        self.times_s = []
        self.intensities = []
        self.n_shown = 0


def train(training, settings):
    """Return a table of one row: the intensities of hanging and of fully raised hands, and the highest angle."""
    intensity = np.concatenate([table["intensity"] for table in training.prosody.values()])
    low, high = np.quantile(intensity, [0.2, 0.95])
    return pd.DataFrame({"low": [low], "high": [high], "highest_deg": [settings["highest_deg"]]})


def start(model, stream, seed):
    """Return the state before anything is heard."""
    return State(model, stream)


def step(state, heard):
    """Return the frames up to the time that has been heard."""
    state.times_s.append(heard.time_s)
    state.intensities.append(heard.features["intensity"])
    return _frames(state, int(np.floor(heard.time_s * state.stream.motion_fps + 0.5)))


def end(state, speech):
    """Return the last frames; they keep the intensity that was heard last."""
    return _frames(state, speech.n_motion_frames)


def _frames(state, end):
    """Return the frames from those that have been shown up to ``end``: bodies with bent forearms."""
    low, high, highest_deg = state.model.iloc[0]
    first, fps = state.n_shown, state.stream.motion_fps
    state.n_shown = max(first, end)
    motion = skeleton.standing(state.n_shown - first, fps)
    motion["frame"] += first
    motion["time_s"] = (motion["frame"] + 0.5) / fps
    intensity = np.interp(motion["time_s"], state.times_s, state.intensities)
    for joint in ("left_forearm", "right_forearm"):
        motion[f"{joint}_x_deg"] = -highest_deg * np.clip((intensity - low) / (high - low), 0.0, 1.0)
    return motion


def to_tables(model):
    """Return the model, which is a table already."""
    return {"lift": model}


def from_tables(tables):
    """Return the model of ``to_tables``."""
    return tables["lift"]
