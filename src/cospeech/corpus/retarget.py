"""Bring the motion of another skeleton onto ours, keeping in the world what the body parts do.

Let W_j be the rotation of the source's joint j in the world of its file, all rotations from the root down to it
composed, and A the change from the file's axes to ours. Our joint's rotation in the world is

    V_j = A W_j C_j,

where C_j turns the rest pose of our skeleton (upright, hanging arms) into the source's pose at zero angles, in the
file's axes. A bone that points along d in our rest pose points along C_j d in the source's, so that V_j d is the
direction of the source's bone in the world. The joint angles are those of V_parent^T V_j: joints that we do not have
(further vertebrae, collar bones) are composed away, and what hangs below them keeps its orientation.
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

NEEDED = ("hips", "chest", *skeleton.ARM_JOINTS)
"""Joints without which there is no gesture; the others stay at zero angles where the source lacks them."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}

AXES = {"y": np.eye(3), "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])}
"""From the file's axes to ours: y up, facing +z; or z up, facing -y."""

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
"""Our joints in SMPL-X; the chest is the vertebra from which neck and collar bones go out."""

UPPER_ARM_M = (0.12, 0.6)
"""Lengths of an upper arm that a body, child or giant, may have; others tell of another unit."""

LEAN = 60.0
"""Angle in degrees between the mean trunk and the vertical beyond which another axis must be up."""

TURNED = 45.0
"""Angle in degrees by which the mean facing may be off +z before it is said."""


@dataclass(frozen=True)
class Declaration:
    """What a motion file does not say of itself (``corpus.motion`` of the configuration)."""

    up: str
    unit: str
    joints: str | dict[str, str]
    zero: str


def motion_table(clip: Clip, declared: Declaration, where: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the motion table of ``clip`` on our skeleton, and notes on what was done.

    The hips' displacement is from their mean place in the clip.

    Raises
    ------
    UserError : where a declared joint is not in the file, a needed one is not declared, or offsets tell no rest pose.
    """
    source = joint_map(clip.names, declared.joints, where)
    world = world_rotations(clip)
    axes = AXES[declared.up]
    # A body without offsets (SMPL-X) stands y up in axes of its own, whatever is up in the world it was put into.
    upright = np.eye(3) if clip.offsets is None else axes.T
    at_zero = rest.pose(clip, source, declared.zero, upright, where)
    turned = {name: axes @ world[:, joint] @ at_zero[name] for name, joint in source.items()}
    still = [name for name in skeleton.JOINTS if name not in source]
    local = np.broadcast_to(np.eye(3), (len(world), len(skeleton.JOINTS), 3, 3)).copy()
    for index, name in enumerate(skeleton.JOINTS):
        parent = skeleton.PARENT[name]
        if parent is None:
            local[:, index] = turned[name]
        elif name in source:
            local[:, index] = np.swapaxes(turned[parent], 1, 2) @ turned[name]
        else:
            turned[name] = turned[parent]
    places = world_places(clip, world)
    hips = places[source["hips"]] @ axes.T * METRES[declared.unit]
    notes = [f"joints at zero angles, as the file lacks them: {', '.join(still)}"] if still else []
    _check_unit(clip, source, declared.unit, where)
    stance = turned["chest"]
    if clip.offsets is not None:
        stance = axes @ rest.trunk_axes(np.stack(places, axis=1), source, where)
    notes += _check_stance(stance.mean(axis=0), where)
    return skeleton.motion_table(hips - hips.mean(axis=0), least_change(local), clip.fps), notes


def joint_map(names: tuple[str, ...], declared: str | dict[str, str], where: str) -> dict[str, int]:
    """Return the source's joint index of each of our joints."""
    if isinstance(declared, str):
        own = {"cospeech": {name: name for name in skeleton.JOINTS}, "smplx": SMPLX}[declared]
        mapping = {ours: theirs for ours, theirs in own.items() if theirs in names}
    else:
        mapping = declared
    for ours, theirs in mapping.items():
        if ours not in skeleton.JOINTS:
            raise UserError(f"config: corpus.motion.joints: {_unknown(ours, skeleton.JOINTS)}")
        if theirs not in names:
            raise UserError(f"{where}: {_unknown(theirs, names)}; correct corpus.motion.joints")
    for ours in NEEDED:
        if ours not in mapping:
            raise UserError(
                f"{where}: no joint is our '{ours}'; map it in corpus.motion.joints to one of {', '.join(names[:30])}"
            )
    return {ours: names.index(theirs) for ours, theirs in mapping.items()}


def _unknown(name: str, known: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(known[:30])}"
    return f"unknown joint '{name}'; {hint}"


def _check_unit(clip: Clip, source: dict[str, int], unit: str, where: str) -> None:
    if clip.offsets is None:
        return
    place = rest.places_at_rest(clip)
    arm_m = np.linalg.norm(place[source["left_forearm"]] - place[source["left_arm"]]) * METRES[unit]
    if not UPPER_ARM_M[0] <= arm_m <= UPPER_ARM_M[1]:
        raise UserError(
            f"{where}: its upper arm is {arm_m:.3g} m long if its unit is {unit}; correct corpus.motion.unit"
        )


def _check_stance(trunk: Floats, where: str) -> list[str]:
    """Refuse a trunk whose mean axes (3, 3) lie down; return a note where they face elsewhere than +z."""
    lean = np.degrees(np.arccos(np.clip(trunk[1, 1], -1, 1)))
    if lean > LEAN:
        raise UserError(
            f"{where}: the trunk leans {lean:.0f} degrees from upright on the mean; correct corpus.motion.up or zero"
        )
    heading = np.degrees(np.arctan2(trunk[0, 2], trunk[2, 2]))
    return [f"faces {heading:.0f} degrees to the left of +z"] if abs(heading) > TURNED else []


def world_rotations(clip: Clip) -> Floats:
    """Return the rotation of every joint in the world, (T, J, 3, 3)."""
    world = clip.rotations.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ clip.rotations[:, joint]
    return world


def world_places(clip: Clip, world: Floats) -> list[Floats]:
    """Return the place of every joint in the world, J arrays (T, 3), in the file's unit."""
    places: list[Floats] = []
    for joint, parent in enumerate(clip.parents):
        still = np.zeros(3) if clip.offsets is None else clip.offsets[joint]
        local = clip.places.get(joint, still)
        if parent < 0:
            places.append(np.broadcast_to(local, (len(world), 3)))
        else:
            local = np.broadcast_to(local, (len(world), 3))
            places.append(places[parent] + np.einsum("tij,tj->ti", world[:, parent], local))
    return places
