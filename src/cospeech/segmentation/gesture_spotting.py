"""Gestures of head and hands by left-to-right HMMs (Sargin 2006, 3.3).

Hand gestures are isolated: their starts and ends are given, and each belongs to the model under which it is most
likely. Gestures of the head are spotted: the most likely path through a network of the models of nods, tilts and
other movements says where they are.

The features of the document come from film. Here, hands are described by their position and velocity, and the head by
its angular velocity, which stands for the quadratic motion parameters of the face; its models also see nods and tilts
in the angles, less their running mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.markov import spotting
from cospeech.markov.mixture_hmm import Training
from cospeech.markov.spotting import Segment, Size

OTHER = "other"
HEAD_ANGLES, HANDS = ("x_deg", "y_deg", "z_deg"), ("left_x_m", "left_y_m", "right_x_m", "right_y_m")
BASELINE_S = 3.0
"""Width of the running mean that is subtracted from the angles of the head."""
SHORTEST_S = 0.2
"""Shortest stretch between gestures on which the model of other movements is trained."""


def head_features(movement: pd.DataFrame, fps: float) -> Floats:
    """Return the angles of the head without their running mean, and their change per frame, (T, 6)."""
    angles = movement[list(HEAD_ANGLES)].to_numpy()
    centred = angles - uniform_filter1d(angles, round(BASELINE_S * fps), axis=0)
    return np.column_stack([centred, np.gradient(centred, axis=0)])


def hand_features(movement: pd.DataFrame) -> Floats:
    """Return the positions of both hands and their change per frame, (T, 8)."""
    positions = movement[list(HANDS)].to_numpy()
    return np.column_stack([positions, np.gradient(positions, axis=0)])


def segments(events: pd.DataFrame, fps: float) -> list[Segment]:
    """Return events (record, start_s, end_s, label) in frames."""
    return [
        Segment(record, round(start_s * fps), round(end_s * fps), label)
        for record, start_s, end_s, label in events[["record", "start_s", "end_s", "label"]].itertuples(index=False)
    ]


def classify(
    recordings: Mapping[str, Floats],
    known: Sequence[Segment],
    tested: Sequence[Segment],
    states: int,
    training: Training,
    seed: int,
) -> list[str]:
    """Return the label of each tested gesture, by one model of each label of the known ones.

    Raises
    ------
    UserError : if a label has no gesture that is long enough.
    """
    sizes = dict.fromkeys(sorted({segment.label for segment in known}), Size(states, 1))
    models = spotting.train(recordings, known, sizes, training, random_source(seed, "hands", str(states)))
    return [models.classify(recordings[segment.recording][segment.first : segment.end]) for segment in tested]


def spot(
    recordings: Mapping[str, Floats],
    known: Sequence[Segment],
    tested: Sequence[str],
    states: int,
    fps: float,
    training: Training,
    seed: int,
) -> list[Segment]:
    """Return the gestures that are found in recordings, by models of known ones and of what lies between them.

    Parameters
    ----------
    recordings : (T, D) features.
    known : gestures of those recordings that are trained on.
    tested : names of the recordings that gestures are looked for in.

    Raises
    ------
    UserError : if a label has no gesture that is long enough.
    """
    given = list(known)
    for record in dict.fromkeys(segment.recording for segment in known):
        own = [segment for segment in known if segment.recording == record]
        given += spotting.between(record, own, len(recordings[record]), round(SHORTEST_S * fps), OTHER)
    sizes = dict.fromkeys(sorted({segment.label for segment in given}), Size(states, 1))
    network = spotting.train(recordings, given, sizes, training, random_source(seed, "head", str(states)))
    found = [segment for record in tested for segment in network.spot(record, recordings[record])]
    return [segment for segment in found if segment.label != OTHER]
