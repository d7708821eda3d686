"""The dress of an actor: the positions at which the markers, balls of ``markers.RADIUS_M``, are fixed to the body.

A tracker should find the centres of the balls.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.motion import skeleton
from cospeech.motion.markers import MARKERS, NAMES

PLACE_M = {
    "head_left": (0.095, 0.10, 0.01),
    "head_right": (-0.095, 0.10, 0.01),
    "head_front": (0.0, 0.15, 0.100),
    "chest": (0.0, 0.10, 0.114),
    "back": (0.0, 0.10, -0.114),
    "left_shoulder": (0.18, 0.265, 0.0),
    "right_shoulder": (-0.18, 0.265, 0.0),
    "left_elbow": (0.055, -0.285, 0.0),
    "right_elbow": (-0.055, -0.285, 0.0),
    "left_hand": (0.012, -0.02, 0.0),
    "right_hand": (-0.012, -0.02, 0.0),
    "left_leg": (0.03, -0.25, 0.08),
    "right_leg": (-0.03, -0.25, 0.08),
    "left_foot": (0.0, 0.02, 0.12),
    "right_foot": (0.0, 0.02, 0.12),
}
"""Nominal position of each marker in the frame of its joint, metres.

The hand marker sits on the head of the ulna, which lies on the axis of forearm rotation. It hardly moves when the
palm turns, so that one marker beyond the elbow determines elbow flexion and the axial rotation of the upper arm.
"""

SPREAD_M = 0.004


def places(actor: str, seed: int) -> Floats:
    """Return the marker positions on ``actor``, (15, 3) in the frames of their joints, metres."""
    rng = random_source(seed, actor)
    return np.array([PLACE_M[name] for name in NAMES]) + rng.normal(0.0, SPREAD_M, (len(NAMES), 3))


def wear(motion: pd.DataFrame, placed_m: Floats) -> Floats:
    """Return the world positions (T, 15, 3) in metres of markers at ``placed_m`` (15, 3) through a motion table."""
    turned, joints = skeleton.chain(
        motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float), skeleton.angles(motion)
    )
    worn = [skeleton.JOINTS.index(marker.joint) for marker in MARKERS]
    return joints[:, worn] + np.einsum("tmij,mj->tmi", turned[:, worn], placed_m)
