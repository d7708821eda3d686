"""A subject with known marker positions: motion of the virtual studio and a range-of-motion take, as 15 markers."""

import numpy as np

from cospeech.motion import markers, skeleton
from cospeech.motion.skeleton import JOINTS
from cospeech.studio import cast, motion, script

FPS = 20.0
STATIC_S = 2.0

PLACES_M = {
    "head_left": (0.08, 0.12, 0.0), "head_right": (-0.08, 0.12, 0.0), "head_front": (0.0, 0.13, 0.11),
    "chest": (0.01, 0.08, 0.12), "back": (0.0, 0.12, -0.11),
    "left_shoulder": (0.17, 0.24, 0.0), "right_shoulder": (-0.17, 0.24, 0.01),
    "left_elbow": (0.045, -0.29, -0.005), "right_elbow": (-0.04, -0.29, 0.005),
    "left_hand": (0.015, -0.03, 0.005), "right_hand": (-0.015, -0.03, 0.0),
    "left_leg": (0.03, -0.33, 0.07), "right_leg": (-0.03, -0.33, 0.07),
    "left_foot": (0.01, 0.0, 0.12), "right_foot": (-0.01, 0.0, 0.12),
}  # fmt: skip
"""Position of each marker in the frame of its joint, unknown to the method under test."""


def performance(seconds=60.0, actor="ada", seed=2012):
    """Return the motion table of a performance in the virtual studio."""
    gestures, prosody = script.write(cast.member(actor, seed, 0.025, 10.0), "x", seconds, 0.8, 0.025, seed)
    return motion.perform(actor, "x", gestures, prosody, FPS, seed)


def range_of_motion(seconds=40.0, seed=3, raised_deg=0.0):
    """Return a motion table: the static pose, then wide arm circles, elbow flexion, trunk and head rotation.

    In the static pose, the arms are raised to the sides by ``raised_deg``: 0 is hanging, 90 is a T-pose.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * FPS)) / FPS
    grow = np.clip((time - STATIC_S) / 2.0, 0.0, 1.0)
    turns = np.zeros((len(time), len(JOINTS), 3))

    def wave(hertz, phase=0.0):
        return grow * np.sin(2.0 * np.pi * hertz * (time - STATIC_S) + phase)

    for side, sign in (("left", 1.0), ("right", -1.0)):
        turns[:, JOINTS.index(f"{side}_arm")] = np.column_stack(
            [
                -50 * grow + 60 * wave(0.31, sign),
                30 * wave(0.17),
                sign * (raised_deg * (1 - grow) + 35 * grow + 35 * wave(0.23, 1.0)),
            ]
        )
        turns[:, JOINTS.index(f"{side}_forearm"), 0] = -55 * grow + 50 * wave(0.41, 2.0)
        turns[:, JOINTS.index(f"{side}_hand"), 0] = -6 * grow
    for joint, reach in (("spine", 4.0), ("chest", 8.0), ("neck", 10.0), ("head", 20.0)):
        turns[:, JOINTS.index(joint)] = np.column_stack([reach * wave(f, 1.0) for f in rng.uniform(0.1, 0.3, 3)])
    return skeleton.motion_table(np.zeros((len(time), 3)), turns, FPS)


def chain(moved):
    return skeleton.chain(moved[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(moved))


def marked(moved, noise_m=0.0005, seed=0):
    """Return the marker positions (T, M, 3) of a motion table, with white noise on each coordinate."""
    turned, placed = chain(moved)
    places = np.empty((len(moved), len(markers.MARKERS), 3))
    for index, marker in enumerate(markers.MARKERS):
        joint = JOINTS.index(marker.joint)
        places[:, index] = placed[:, joint] + turned[:, joint] @ np.array(PLACES_M[marker.name])
    return places + np.random.default_rng(seed).normal(0.0, noise_m, places.shape)
