"""Movements of hands and head that accompany the keywords and accents found in speech (Sargin 2006, 3.5).

A keyword moves the hands while it lasts: *left* the left hand, *right* the right one, *straight* both. Their course
comes from an HMM of the hand's position in recorded gestures with that label. An accent moves the head, at a constant
speed, to its middle and back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.markov import spotting
from cospeech.markov.mixture_hmm import MixtureHMM, Training
from cospeech.markov.spotting import Segment, Size

HEAD_PX_PER_S = 25.0
"""Speed of the head during an accent, in pixels of the document's film (3.5.2)."""

HANDS = {"left": ("left", "straight"), "right": ("right", "straight")}
"""The keywords that each hand moves with (3.5.1)."""

AXES = ("x", "y")


class Event(NamedTuple):
    """A keyword or an accent that was found in speech."""

    start_s: float
    end_s: float
    label: str


HandModels = Mapping[tuple[str, str], MixtureHMM]
"""The model of each hand and keyword."""


def hand_models(
    movement: Mapping[str, pd.DataFrame], gestures: Sequence[Segment], states: int, training: Training, seed: int
) -> HandModels:
    """Return a model of the positions of each hand in the gestures that it takes part in.

    Parameters
    ----------
    movement : tables ``direction_movement`` by record.
    gestures : recorded gestures of the hands, in frames of these.
    states : number of states of each model.

    Raises
    ------
    UserError : if a keyword has no gesture that is long enough.
    """
    models = {}
    for hand, labels in HANDS.items():
        positions = {
            record: table[[f"{hand}_{axis}_m" for axis in AXES]].to_numpy() for record, table in movement.items()
        }
        sizes = dict.fromkeys(labels, Size(states, 1))
        trained = spotting.train(
            positions, gestures, sizes, training, random_source(seed, "directions", "hand", hand)
        )
        models.update({(hand, label): model for label, model in zip(labels, trained.models, strict=True)})
    return models


def course(model: MixtureHMM, n_frames: int) -> Floats:
    """Return the expected positions (n_frames, D) of a gesture that takes so long, which starts and ends at rest.

    The states share the frames in proportion to their expected durations, 1 / (1 - stay). Each mean is reached in the
    middle of its state, with straight lines between.
    """
    share = np.cumsum(np.append(0.0, 1.0 / (1.0 - model.stay)))
    share /= share[-1]
    knots = np.concatenate([[0.0], (share[:-1] + share[1:]) / 2.0, [1.0]])
    places = (np.arange(n_frames) + 0.5) / n_frames
    return np.column_stack([np.interp(places, knots, [0.0, *mean, 0.0]) for mean in model.mean[:, 0].T])


def progress(events: Sequence[Event], times_s: Floats) -> Floats:
    """Return how much of the event at each time (T,) is over, from 0 to 1; NaN where there is none."""
    found = np.full(len(times_s), np.nan)
    for event in events:
        during = (times_s >= event.start_s) & (times_s < event.end_s)
        found[during] = (times_s[during] - event.start_s) / (event.end_s - event.start_s)
    return found


def head_px(accents: Sequence[Event], times_s: Floats) -> Floats:
    """Return the displacement of the head in pixels at each time (T,), positive: down the image (3.5.2)."""
    found = np.zeros(len(times_s))
    for accent in accents:
        left_s = np.minimum(times_s - accent.start_s, accent.end_s - times_s)
        found = np.maximum(found, HEAD_PX_PER_S * left_s)
    return found


def animate(
    record: str,
    duration_s: float,
    keywords: Sequence[Event],
    accents: Sequence[Event],
    models: HandModels,
    fps: float,
) -> pd.DataFrame:
    """Return the animation of an answer as a table ``direction_animation``."""
    times_s = frame_times(int(duration_s * fps), fps)
    table = pd.DataFrame({"record": record, "frame": np.arange(len(times_s)), "time_s": times_s})
    table["keyword"] = pd.Series(None, index=table.index, dtype="object")
    hands = {f"{hand}_{axis}_m": np.zeros(len(times_s)) for hand in HANDS for axis in AXES}
    for keyword in keywords:
        during = np.flatnonzero((times_s >= keyword.start_s) & (times_s < keyword.end_s))
        table.loc[during, "keyword"] = keyword.label
        for hand, labels in HANDS.items():
            if keyword.label in labels:
                moved = course(models[hand, keyword.label], len(during))
                for axis, values in zip(AXES, moved.T, strict=True):
                    hands[f"{hand}_{axis}_m"][during] = values
    return table.assign(
        keyword_share=progress(keywords, times_s),
        accent_share=progress(accents, times_s),
        head_px=head_px(accents, times_s),
        **hands,
    )
