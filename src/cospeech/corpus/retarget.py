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
from cospeech.data import units
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import foreign
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.motion import skeleton
from cospeech.motion.euler import least_change

REQUIRED_JOINTS = ("hips", "chest", *skeleton.ARM_JOINTS)
"""Joints that the source must have; the angles of all other joints are zero if the source lacks them."""

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

MAX_BEND_DEG = 10.0
"""Largest angle between a limb's bone and its direction at zero angles, in the frame of the joint that moves it."""

MAX_RISE_M, MAX_TRAVEL_M, MAX_SPEED_M_S = 5.0, 50.0, 10.0
"""Largest vertical and horizontal range of the hips, and their largest median speed; beyond, the unit is wrong."""

HIPS_HEIGHT_M, MAX_HEIGHT_M = (0.3, 1.5), 10.0
"""Usual height of the hips of SMPL-X above the ground, and a height that shows that the unit is wrong."""

MAX_LEAN_DEG = 60.0
"""Largest angle between the mean trunk axis and the vertical; beyond it, the up axis must be wrong."""

MAX_HEADING_DEG = 45.0
"""Largest angle between the mean heading and +z that is not mentioned in a note."""


@dataclass(frozen=True)
class MotionConventions:
    """Conventions that a motion file does not state itself (``corpus.motion`` of the configuration)."""

    up: str
    unit: str | float
    joints: str | dict[str, str]
    zero: str


def motion_table(clip: Clip, conventions: MotionConventions, where: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the motion table of ``clip`` on our skeleton, and notes on how it was converted.

    The displacement of the hips is relative to their mean position in the clip.

    Raises
    ------
    UserError
        If a declared joint is not in the file, a required joint is not declared, a limb skips a joint that bends, the
        unit or the axes are wrong, or the rest pose cannot be read from the bone offsets.
    """
    source = joint_map(clip.names, conventions.joints, where)
    world = world_rotations(clip)
    positions = world_positions(clip, world)
    _check_limbs(clip, source, world, positions, where)
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
    hips = positions[source["hips"]] @ axes.T * units.metres_per_unit(conventions.unit)
    notes = [f"joints at zero angles, as the file lacks them: {', '.join(missing)}"] if missing else []
    _check_unit(clip, source, hips, conventions.unit, where)
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
        names = tuple(map(foreign.normalised, names))
        mapping = {ours: foreign.normalised(theirs) for ours, theirs in declared.items()}
    for ours, theirs in mapping.items():
        if ours not in skeleton.JOINTS:
            raise UserError(f"config: corpus.motion.joints: {_unknown(ours, skeleton.JOINTS)}")
        if theirs not in names:
            raise UserError(f"{where}: {_unknown(theirs, names)}; correct corpus.motion.joints")
        if names.count(theirs) > 1:
            raise UserError(f"{where}: {names.count(theirs)} joints are called '{theirs}'; give each its own name")
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


def _check_unit(clip: Clip, source: dict[str, int], hips_m: Floats, unit: str | float, where: str) -> None:
    """Raise UserError if the body or the path (T, 3) of its hips have a size that is impossible in the unit."""
    scale, name = units.metres_per_unit(unit), units.label(unit)
    impossible = _impossible_path(hips_m, clip.fps)
    if clip.offsets is not None:
        position = rest.rest_positions(clip)
        arm_m = np.linalg.norm(position[source["left_forearm"]] - position[source["left_arm"]]) * scale
        if not UPPER_ARM_M[0] <= arm_m <= UPPER_ARM_M[1]:
            raise UserError(
                f"{where}: its upper arm is {arm_m:.3g} m long if the unit is {name}; correct corpus.motion.unit"
            )
    else:
        height_m = hips_m[:, 1].mean()
        if abs(height_m) > MAX_HEIGHT_M or (scale < 0.1 and HIPS_HEIGHT_M[0] < height_m / scale < HIPS_HEIGHT_M[1]):
            impossible = f"are {height_m:.3g} m above the ground"
    if impossible:
        raise UserError(f"{where}: the hips {impossible} if the unit is {name}; correct corpus.motion.unit")


def _impossible_path(hips_m: Floats, fps: float) -> str:
    """Return what no person's hips do, or an empty string."""
    rise, *travel = np.ptp(hips_m, axis=0)[[1, 0, 2]]
    speed = float(np.median(np.linalg.norm(np.diff(hips_m, axis=0), axis=1))) * fps if len(hips_m) > 1 else 0.0
    if rise > MAX_RISE_M:
        return f"rise by {rise:.3g} m"
    if max(travel) > MAX_TRAVEL_M:
        return f"travel {max(travel):.3g} m"
    return f"move at {speed:.3g} m/s" if speed > MAX_SPEED_M_S else ""


def _check_limbs(clip: Clip, source: dict[str, int], world: Floats, positions: list[Floats], where: str) -> None:
    """Raise UserError if a limb bends between the two joints that are mapped to the ends of its bone.

    Joints along the bone that only twist it are allowed; a joint that bends it is the one that should be mapped.
    """
    ends = [(f"{side}_{part}", f"{side}_{child}") for side in ("left", "right") for part, child in rest.CHILD.items()]
    for ours, child in ends:
        if ours not in source or child not in source:
            continue
        joint, end = source[ours], source[child]
        between = _between(clip.parents, joint, end)
        if clip.offsets is not None:
            position = rest.rest_positions(clip)
            bone = np.einsum("tji,tj->ti", world[:, joint], positions[end] - positions[joint])
            bend = _largest_angle_deg(bone, position[end] - position[joint])
        elif between is None:
            bend = 180.0
        else:
            turns = [rotation.angles_deg(clip.rotations[:, skipped]).max() for skipped in between]
            bend = max(turns, default=0.0)
        if bend > MAX_BEND_DEG:
            name, end_name = clip.names[joint], clip.names[end]
            skipped = ", ".join(f"'{clip.names[other]}'" for other in between or ())
            what = f"{skipped}, which it skips, moves" if skipped else "a position channel moves"
            bends = f"{what} '{end_name}' by up to {bend:.0f} degrees"
            reason = f"does not carry '{end_name}' ({child})" if between is None else bends
            raise UserError(f"{where}: '{name}' is mapped to {ours}, but {reason}; correct corpus.motion.joints")


def _between(parents: tuple[int, ...], joint: int, end: int) -> list[int] | None:
    """Return the joints between a joint and one of its descendants; None if ``end`` is not a descendant."""
    path: list[int] = []
    above = parents[end]
    while above >= 0 and above != joint:
        path.insert(0, above)
        above = parents[above]
    return path if above == joint else None


def _largest_angle_deg(vectors: Floats, direction: Floats) -> float:
    """Return the largest angle in degrees between ``vectors`` (T, 3) and ``direction`` (3,); 0 if one is zero."""
    lengths = np.linalg.norm(vectors, axis=1) * np.linalg.norm(direction)
    cosine = (vectors @ direction)[lengths > 0] / lengths[lengths > 0]
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1).min(initial=1.0))))


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
