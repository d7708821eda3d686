"""The skeleton: joints, bone offsets, Euler angles and forward kinematics.

World frame: x to the actor's left, y up, z in the direction that the actor faces, in metres. With all angles zero,
the actor stands upright with hanging arms and palms facing the thighs. The angles of a joint rotate its body part in
the frame of the parent. The order is R = Rx(x) Rz(z) Ry(y): for a hanging arm, x lifts it forward (negative) or
backward, z lifts it to the side, and y rotates it about the bone. Gimbal lock occurs only at z = +-90 degrees, with
the arm straight out to the side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry import rotation

EULER_ORDER = "XZY"
"""Intrinsic order of the joint angles."""


@dataclass(frozen=True)
class Joint:
    """One joint: its parent, and its position in the frame of the parent in metres."""

    name: str
    parent: str | None
    offset_m: tuple[float, float, float]


BODY = (
    Joint("hips", None, (0.0, 0.95, 0.0)),
    Joint("spine", "hips", (0.0, 0.10, -0.01)),
    Joint("chest", "spine", (0.0, 0.16, -0.01)),
    Joint("neck", "chest", (0.0, 0.24, 0.0)),
    Joint("head", "neck", (0.0, 0.10, 0.02)),
    Joint("left_arm", "chest", (0.18, 0.19, 0.0)),
    Joint("left_forearm", "left_arm", (0.0, -0.29, 0.0)),
    Joint("left_hand", "left_forearm", (0.0, -0.25, 0.0)),
    Joint("right_arm", "chest", (-0.18, 0.19, 0.0)),
    Joint("right_forearm", "right_arm", (0.0, -0.29, 0.0)),
    Joint("right_hand", "right_forearm", (0.0, -0.25, 0.0)),
    Joint("left_thigh", "hips", (0.09, -0.03, 0.0)),
    Joint("left_shin", "left_thigh", (0.0, -0.43, 0.0)),
    Joint("left_foot", "left_shin", (0.0, -0.42, 0.0)),
    Joint("right_thigh", "hips", (-0.09, -0.03, 0.0)),
    Joint("right_shin", "right_thigh", (0.0, -0.43, 0.0)),
    Joint("right_foot", "right_shin", (0.0, -0.42, 0.0)),
)
"""The joints, parents first, with the proportions of an adult of 1.75 m."""

TIPS_M = {
    "head": (0.0, 0.18, 0.02),
    "left_hand": (0.0, -0.18, 0.0),
    "right_hand": (0.0, -0.18, 0.0),
    "left_foot": (0.0, -0.05, 0.18),
    "right_foot": (0.0, -0.05, 0.18),
}
"""The far ends of body parts without a further joint, in the frame of their joint."""

JOINTS = tuple(joint.name for joint in BODY)
PARENT = {joint.name: joint.parent for joint in BODY}
OFFSET_M = {joint.name: np.array(joint.offset_m) for joint in BODY}

ARM_JOINTS = ("left_arm", "left_forearm", "right_arm", "right_forearm")
"""The four body parts of the gesture feature (Özkul 2012, eq. 4.7)."""

SECTIONS = {
    "head": ("neck", "head"),
    "arms": ("spine", "chest", "left_arm", "left_forearm", "left_hand", "right_arm", "right_forearm", "right_hand"),
    "legs": ("hips", "left_thigh", "left_shin", "left_foot", "right_thigh", "right_shin", "right_foot"),
}
"""The sections of the body that gesture independently (Levine 2009, 2.2); every joint belongs to one."""

ROOT_COLUMNS = ("root_x_m", "root_y_m", "root_z_m")


def angle_columns(joints: tuple[str, ...] = JOINTS) -> list[str]:
    """Return the names of the angle columns of ``joints`` in a motion table, x, y and z of each."""
    return [f"{joint}_{axis}_deg" for joint in joints for axis in "xyz"]


def angles(motion: pd.DataFrame, joints: tuple[str, ...] = JOINTS) -> Floats:
    """Return the joint angles x, y, z of a motion table in degrees, (T, J, 3)."""
    return motion[angle_columns(joints)].to_numpy(dtype=float).reshape(len(motion), len(joints), 3)


def rotations(angles_deg: Floats) -> Floats:
    """Return the rotation matrices (..., 3, 3) of Euler angles x, y, z (..., 3) in degrees."""
    return rotation.from_euler(EULER_ORDER, angles_deg[..., [0, 2, 1]])


def euler(matrices: Floats) -> Floats:
    """Return the Euler angles x, y, z (..., 3) in degrees of rotation matrices (..., 3, 3)."""
    return rotation.to_euler(EULER_ORDER, matrices)[..., [0, 2, 1]]


def unwrap(angles_deg: Floats) -> Floats:
    """Return angles (T, ...) without jumps of full turns between consecutive frames."""
    return np.unwrap(angles_deg, axis=0, period=360.0)


def motion_table(root_m: Floats, angles_deg: Floats, fps: float) -> pd.DataFrame:
    """Return the motion table of root positions (T, 3) in metres and joint angles (T, J, 3) in degrees."""
    n_frames = len(root_m)
    values = np.column_stack([root_m, angles_deg.reshape(n_frames, 3 * len(JOINTS))])
    table = pd.DataFrame(values, columns=[*ROOT_COLUMNS, *angle_columns()])
    table.insert(0, "frame", np.arange(n_frames))
    table.insert(1, "time_s", (np.arange(n_frames) + 0.5) / fps)
    return table


def columns() -> list[str]:
    """Return the names of all columns of a motion table."""
    return ["frame", "time_s", *ROOT_COLUMNS, *angle_columns()]


def standing(n_frames: int, fps: float) -> pd.DataFrame:
    """Return the motion table of a body that stands upright with hanging arms and does not move."""
    return motion_table(np.zeros((n_frames, 3)), np.zeros((n_frames, len(JOINTS), 3)), fps)


def frame_rate(motion: pd.DataFrame) -> float:
    """Return the frame rate of a motion table in frames per second, from the time of its first frame."""
    return round(0.5 / float(motion["time_s"].iloc[0]), 6)


def chain(root_m: Floats, angles_deg: Floats) -> tuple[Floats, Floats]:
    """Return the orientation (T, J, 3, 3) and the position (T, J, 3) in metres of every joint in the world.

    Parameters
    ----------
    root_m : (T, 3) displacement of the hips from their position in ``BODY``.
    angles_deg : (T, J, 3) joint angles in the order of ``JOINTS``, degrees.
    """
    turned = rotations(angles_deg)
    placed = np.empty((len(root_m), len(BODY), 3))
    for index, joint in enumerate(BODY):
        if joint.parent is None:
            placed[:, index] = root_m + OFFSET_M[joint.name]
        else:
            parent = JOINTS.index(joint.parent)
            turned[:, index] = turned[:, parent] @ turned[:, index]
            placed[:, index] = placed[:, parent] + turned[:, parent] @ OFFSET_M[joint.name]
    return turned, placed


def forward(root_m: Floats, angles_deg: Floats) -> dict[str, Floats]:
    """Return the world positions (T, 3) in metres of every joint, and of every tip as ``<joint>_tip``.

    Parameters
    ----------
    root_m : (T, 3) displacement of the hips from their position in ``BODY``.
    angles_deg : (T, J, 3) joint angles in the order of ``JOINTS``, degrees.
    """
    turned, placed = chain(root_m, angles_deg)
    places = {name: placed[:, index] for index, name in enumerate(JOINTS)}
    for name, tip in TIPS_M.items():
        index = JOINTS.index(name)
        places[f"{name}_tip"] = placed[:, index] + turned[:, index] @ np.array(tip)
    return places
