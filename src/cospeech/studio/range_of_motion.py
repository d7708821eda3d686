"""The range-of-motion take: exercises of neck, trunk, shoulders and elbows in turn, between two static poses."""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.motion import skeleton

STATIC_S = 2.0
EXERCISE_S = 4.0

EXERCISES = (
    {"neck": (25.0, 45.0, 20.0)},
    {"spine": (20.0, 25.0, 15.0), "chest": (8.0, 10.0, 8.0)},
    {"left_arm": (-80.0, 50.0, 60.0), "left_forearm": (-60.0, 0.0, 0.0)},
    {"right_arm": (-80.0, 50.0, -60.0), "right_forearm": (-60.0, 0.0, 0.0)},
    {"left_forearm": (-120.0, 0.0, 0.0), "right_forearm": (-120.0, 0.0, 0.0)},
)
"""Joints of each exercise with amplitudes about x, y and z in degrees; arms and elbows move to one side only."""

ONE_SIDED = ("left_arm", "right_arm", "left_forearm", "right_forearm")


def perform(fps: float) -> pd.DataFrame:
    """Return the motion table of the take, which lasts 24 s and starts and ends with hanging arms."""
    n_exercise, n_static = round(EXERCISE_S * fps), round(STATIC_S * fps)
    angles = np.zeros((2 * n_static + len(EXERCISES) * n_exercise, len(skeleton.JOINTS), 3))
    share = (np.arange(n_exercise) + 0.5) / n_exercise
    ease = np.sin(np.pi * share) ** 2
    for number, exercise in enumerate(EXERCISES):
        start = n_static + number * n_exercise
        for joint, reach in exercise.items():
            turns = 2.0 * np.pi * share[:, None] * (1, 2, 3)
            swing = (1.0 - np.cos(turns)) / 2.0 if joint in ONE_SIDED else np.sin(turns)
            index = skeleton.JOINTS.index(joint)
            angles[start : start + n_exercise, index] = ease[:, None] * swing * reach
    return skeleton.motion_table(np.zeros((len(angles), 3)), angles, fps)
