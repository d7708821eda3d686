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
import numpy.typing as npt
import pandas as pd
from scipy.spatial.transform import Rotation

from cospeech import skeleton
from cospeech.bvh import Clip
from cospeech.corpus.euler import least_change
from cospeech.errors import UserError

Floats = npt.NDArray[np.float64]

NEEDED = ("hips", "chest", *skeleton.ARM_JOINTS)
"""Joints without which there is no gesture; the others stay at zero angles where the source lacks them."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}

AXES = {"y": np.eye(3), "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])}
"""From the file's axes to ours: y up, facing +z; or z up, facing -y."""

T_POSE = {"left": Rotation.from_euler("z", 90, degrees=True), "right": Rotation.from_euler("z", -90, degrees=True)}
"""From hanging arms to arms straight out to the sides, palms down."""

CHILD = {"arm": "forearm", "forearm": "hand", "thigh": "shin", "shin": "foot"}
"""The body part that a limb's bone leads to."""

WIDEST = 150.0
"""Angle in degrees to our rest pose beyond which an offset does not tell how its bone is turned about itself."""


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
    rest = rest_pose(clip, source, declared, where)
    axes = AXES[declared.up]
    turned = {name: axes @ world[:, joint] @ rest[name] for name, joint in source.items()}
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
    hips = world_places(clip, world)[source["hips"]] @ axes.T * METRES[declared.unit]
    notes = [f"joints at zero angles, as the file lacks them: {', '.join(still)}"] if still else []
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


def rest_pose(clip: Clip, source: dict[str, int], declared: Declaration, where: str) -> dict[str, Floats]:
    """Return C_j of our joints: from our rest pose to the source's pose at zero angles, in the file's axes."""
    # SMPL-X bodies stand y up in their own axes, whatever is up in the world they were put into.
    upright = np.eye(3) if declared.joints == "smplx" else AXES[declared.up].T
    if declared.zero == "offsets":
        return _from_offsets(clip, source, where)
    rest = dict.fromkeys(source, upright)
    if declared.zero == "t_pose":
        for name in source:
            side, _, part = name.partition("_")
            if part in ("arm", "forearm", "hand"):
                rest[name] = upright @ T_POSE[side].as_matrix()
    return rest


def _from_offsets(clip: Clip, source: dict[str, int], where: str) -> dict[str, Floats]:
    """Read the rest pose from the offsets: the trunk by its two axes, each limb by the least turn to its bone."""
    if clip.offsets is None:
        raise UserError(f"{where}: has no bone offsets; declare corpus.motion.zero as t_pose or hanging")
    place = _rest_places(clip)
    trunk = _trunk(place, source, where)
    rest = dict.fromkeys(source, trunk)
    for name in skeleton.JOINTS:  # parents first, so that a hand without a tip follows its forearm
        side, _, part = name.partition("_")
        if name not in source or not part:
            continue
        bone = _bone(clip, source, place, name, f"{side}_{CHILD.get(part, '')}")
        if part == "foot":
            continue  # stands flat at rest, whichever way its bone points
        if bone is None:
            rest[name] = rest.get(str(skeleton.PARENT[name]), trunk)
            continue
        ours, theirs = np.array([0.0, -1.0, 0.0]), trunk.T @ bone
        angle = np.degrees(np.arccos(np.clip(ours @ theirs, -1, 1)))
        if angle > WIDEST:
            raise UserError(
                f"{where}: at zero angles '{clip.names[source[name]]}' points up, so its offset does not tell how it "
                "is turned; declare corpus.motion.zero as t_pose or hanging, or export it with a T-pose at zero"
            )
        rest[name] = trunk @ _least_turn(ours, theirs)
    return rest


def _rest_places(clip: Clip) -> Floats:
    assert clip.offsets is not None
    place = clip.offsets.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            place[joint] = place[parent] + clip.offsets[joint]
    return place


def _trunk(place: Floats, source: dict[str, int], where: str) -> Floats:
    """Return the rotation from our axes to the source's trunk at rest: left by the shoulders, up by the spine."""
    left = place[source["left_arm"]] - place[source["right_arm"]]
    up = (place[source["left_arm"]] + place[source["right_arm"]]) / 2 - place[source["hips"]]
    forward = np.cross(left, up)
    if np.linalg.norm(forward) <= 1e-6 * np.linalg.norm(left) * np.linalg.norm(up):
        raise UserError(f"{where}: its offsets span no trunk; declare corpus.motion.zero as t_pose or hanging")
    left, forward = left / np.linalg.norm(left), forward / np.linalg.norm(forward)
    return np.column_stack([left, np.cross(forward, left), forward])


def _bone(clip: Clip, source: dict[str, int], place: Floats, name: str, child: str) -> Floats | None:
    """Return the unit direction of a limb's bone at rest, or None where the file does not say where it ends."""
    joint = source[name]
    if child in source:
        bone = place[source[child]] - place[joint]
    elif joint in clip.tips:
        bone = clip.tips[joint]
    else:
        return None
    length = float(np.linalg.norm(bone))
    return bone / length if length > 0 else None


def _least_turn(start: Floats, end: Floats) -> Floats:
    """Return the rotation of least angle that turns one unit vector onto another that is not its opposite."""
    axis, cosine = np.cross(start, end), float(start @ end)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + cosine)


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
