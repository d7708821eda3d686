"""Retarget the motion of another skeleton to ours, preserving the orientation of the body parts in the world.

Let W_j be the rotation of the source skeleton's joint j in the world of its file, i.e. the product of all rotations
from the root to j, and let A be the rotation from the file's axes to ours. The rotation of our joint in the world is

    V_j = A W_j C_j,

where C_j rotates our rest pose (upright, hanging arms) to the source's pose at zero angles, in the file's axes. A
bone with direction d in our rest pose has direction C_j d in the source's rest pose, so V_j d is the direction of the
source's bone in the world. The joint angles are the Euler angles of V_parent^T V_j. Joints that our skeleton lacks
(further vertebrae, collar bones) are absorbed by this product, and the body parts below them keep their orientation.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.corpus import rest
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.bvh import Clip
from cospeech.motion import skeleton
from cospeech.motion.euler import least_change

REQUIRED_JOINTS = ("hips", "chest", *skeleton.ARM_JOINTS)
"""Joints that the source must have; the angles of all other joints are zero if the source lacks them."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}

AXES = {"y": np.eye(3), "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])}
"""Rotation from the file's axes to ours, by the axis that points up: y up, facing +z; or z up, facing -y."""

SMPLX = {
    "hips": "pelvis",
    "spine": "spine1",
    "chest": "spine3",
    "neck": "neck",
    "head": "head",
    "left_arm": "left_shoulder",
    "left_forearm": "left_elbow",
    "left_hand": "left_wrist",
    "right_arm": "right_shoulder",
    "right_forearm": "right_elbow",
    "right_hand": "right_wrist",
    "left_thigh": "left_hip",
    "left_shin": "left_knee",
    "left_foot": "left_ankle",
    "right_thigh": "right_hip",
    "right_shin": "right_knee",
    "right_foot": "right_ankle",
}
"""SMPL-X names of our joints; the chest is the vertebra from which the neck and the collar bones branch off."""

UPPER_ARM_M = (0.12, 0.6)
"""Plausible range of the length of an upper arm; a length outside it means that the unit is wrong."""

MAX_LEAN_DEG = 60.0
"""Largest angle between the mean trunk axis and the vertical; beyond it, the up axis must be wrong."""

MAX_HEADING_DEG = 45.0
"""Largest angle between the mean heading and +z that is not mentioned in a note."""


@dataclass(frozen=True)
class MotionConventions:
    """Conventions that a motion file does not state itself (``corpus.motion`` of the configuration)."""

    up: str
    unit: str
    joints: str | dict[str, str]
    zero: str


def motion_table(clip: Clip, conventions: MotionConventions, where: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the motion table of ``clip`` on our skeleton, and notes on how it was converted.

    The displacement of the hips is relative to their mean position in the clip.

    Raises
    ------
    UserError
        If a declared joint is not in the file, a required joint is not declared, or the rest pose cannot be read from
        the bone offsets.
    """
    source = joint_map(clip.names, conventions.joints, where)
    world = world_rotations(clip)
    axes = AXES[conventions.up]
    # A body without offsets (SMPL-X) has y up in its own axes, whichever axis points up in its world.
    upright = np.eye(3) if clip.offsets is None else axes.T
    rest_rotation = rest.rest_rotations(clip, source, conventions.zero, upright, where)
    rotations = {name: axes @ world[:, joint] @ rest_rotation[name] for name, joint in source.items()}
    missing = [name for name in skeleton.JOINTS if name not in source]
    local = np.broadcast_to(np.eye(3), (len(world), len(skeleton.JOINTS), 3, 3)).copy()
    for index, name in enumerate(skeleton.JOINTS):
        parent = skeleton.PARENT[name]
        if parent is None:
            local[:, index] = rotations[name]
        elif name in source:
            local[:, index] = np.swapaxes(rotations[parent], 1, 2) @ rotations[name]
        else:
            rotations[name] = rotations[parent]
    positions = world_positions(clip, world)
    hips = positions[source["hips"]] @ axes.T * METRES[conventions.unit]
    notes = [f"joints at zero angles, as the file lacks them: {', '.join(missing)}"] if missing else []
    _check_unit(clip, source, conventions.unit, where)
    trunk = rotations["chest"]
    if clip.offsets is not None:
        trunk = axes @ rest.trunk_axes(np.stack(positions, axis=1), source, where)
    notes += _check_stance(trunk.mean(axis=0), where)
    return skeleton.motion_table(hips - hips.mean(axis=0), least_change(local), clip.fps), notes


def joint_map(names: tuple[str, ...], declared: str | dict[str, str], where: str) -> dict[str, int]:
    """Return the index in ``names`` of each of our joints that the source has."""
    if isinstance(declared, str):
        preset = {"cospeech": {name: name for name in skeleton.JOINTS}, "smplx": SMPLX}[declared]
        mapping = {ours: theirs for ours, theirs in preset.items() if theirs in names}
    else:
        mapping = declared
    for ours, theirs in mapping.items():
        if ours not in skeleton.JOINTS:
            raise UserError(f"config: corpus.motion.joints: {_unknown(ours, skeleton.JOINTS)}")
        if theirs not in names:
            raise UserError(f"{where}: {_unknown(theirs, names)}; correct corpus.motion.joints")
    for ours in REQUIRED_JOINTS:
        if ours not in mapping:
            raise UserError(
                f"{where}: no joint is mapped to '{ours}'; map one of {', '.join(names[:30])} in corpus.motion.joints"
            )
    return {ours: names.index(theirs) for ours, theirs in mapping.items()}


def _unknown(name: str, known: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"expected one of {', '.join(known[:30])}"
    return f"unknown joint '{name}'; {hint}"


def _check_unit(clip: Clip, source: dict[str, int], unit: str, where: str) -> None:
    if clip.offsets is None:
        return
    position = rest.rest_positions(clip)
    arm_m = np.linalg.norm(position[source["left_forearm"]] - position[source["left_arm"]]) * METRES[unit]
    if not UPPER_ARM_M[0] <= arm_m <= UPPER_ARM_M[1]:
        raise UserError(
            f"{where}: its upper arm is {arm_m:.3g} m long if the unit is {unit}; correct corpus.motion.unit"
        )


def _check_stance(trunk: Floats, where: str) -> list[str]:
    """Raise UserError if the trunk, with mean axes (3, 3), lies down; return a note if it does not face +z."""
    lean = np.degrees(np.arccos(np.clip(trunk[1, 1], -1, 1)))
    if lean > MAX_LEAN_DEG:
        raise UserError(
            f"{where}: the trunk leans {lean:.0f} degrees from upright on average; correct corpus.motion.up or zero"
        )
    heading = np.degrees(np.arctan2(trunk[0, 2], trunk[2, 2]))
    return [f"faces {heading:.0f} degrees to the left of +z"] if abs(heading) > MAX_HEADING_DEG else []


def world_rotations(clip: Clip) -> Floats:
    """Return the rotations of all joints in the world, (T, J, 3, 3)."""
    world = clip.rotations.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ clip.rotations[:, joint]
    return world


def world_positions(clip: Clip, world: Floats) -> list[Floats]:
    """Return the positions of all joints in the world, J arrays (T, 3), in the file's unit."""
    positions: list[Floats] = []
    for joint, parent in enumerate(clip.parents):
        offset = np.zeros(3) if clip.offsets is None else clip.offsets[joint]
        local = clip.places.get(joint, offset)
        if parent < 0:
            positions.append(np.broadcast_to(local, (len(world), 3)))
        else:
            local = np.broadcast_to(local, (len(world), 3))
            positions.append(positions[parent] + np.einsum("tij,tj->ti", world[:, parent], local))
    return positions
