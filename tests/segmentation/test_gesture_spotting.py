"""Gestures of head and hands that the test itself plants in positions and angles."""

import numpy as np
import pandas as pd

from cospeech.markov.mixture_hmm import Training
from cospeech.markov.spotting import Segment
from cospeech.segmentation import gesture_spotting

FPS = 30.0
TRAINING = Training(8, 1e-3, 0.01)


def movement(rng, record, n_gestures, names, kinds):
    """Frames of noise of standard deviation 1 with bumps in the features of each kind, and where they are."""
    columns = [*gesture_spotting.HEAD_ANGLES, *gesture_spotting.HANDS]
    frames, segments, place = rng.normal(size=(60 * n_gestures, len(columns))), [], 0
    for _ in range(n_gestures):
        label = names[rng.integers(len(names))]
        place += int(rng.integers(15, 30))
        length = int(rng.integers(15, 28))
        for feature, height in kinds[label].items():
            frames[place : place + length, columns.index(feature)] += height * np.hanning(length)
        segments.append(Segment(record, place, place + length, label))
        place += length
    return pd.DataFrame(frames[: place + 20], columns=columns), segments


def test_nods_and_tilts_are_found_in_continuous_movement():
    kinds = {"nod": {"x_deg": 12.0}, "tilt": {"z_deg": 12.0}}
    rng = np.random.default_rng(1)
    made = {f"r{n}": movement(rng, f"r{n}", 12, ["nod", "tilt"], kinds) for n in range(6)}
    features = {name: gesture_spotting.head_features(table, FPS) for name, (table, _) in made.items()}
    known = [segment for name in ("r0", "r1", "r2", "r3") for segment in made[name][1]]
    found = gesture_spotting.spot(features, known, ["r4", "r5"], 3, FPS, TRAINING, 1)
    planted = [segment for name in ("r4", "r5") for segment in made[name][1]]
    assert [(one.recording, one.label) for one in found] == [(one.recording, one.label) for one in planted]
    errors = [(one.first - other.first, one.end - other.end) for one, other in zip(found, planted, strict=True)]
    assert np.abs(errors).max() <= 8


def test_hands_are_told_apart_by_the_side_that_moves():
    kinds = {
        "left": {"left_x_m": 8.0, "left_y_m": 8.0},
        "right": {"right_x_m": -8.0, "right_y_m": 8.0},
        "straight": {"left_y_m": 8.0, "right_y_m": 8.0},
    }
    rng = np.random.default_rng(2)
    made = {f"r{n}": movement(rng, f"r{n}", 15, list(kinds), kinds) for n in range(4)}
    features = {name: gesture_spotting.hand_features(table) for name, (table, _) in made.items()}
    known, tested = ([one for name in names for one in made[name][1]] for names in (("r0", "r1", "r2"), ("r3",)))
    found = gesture_spotting.classify(features, known, tested, 5, TRAINING, 1)
    assert found == [segment.label for segment in tested]


def test_events_become_frames():
    events = pd.DataFrame([("a", 0.5, 1.0, "nod")], columns=["record", "start_s", "end_s", "label"])
    assert gesture_spotting.segments(events, FPS) == [Segment("a", 15, 30, "nod")]
