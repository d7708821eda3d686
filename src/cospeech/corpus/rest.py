"""Rest pose (all joint angles zero) of another skeleton relative to ours, which is upright with hanging arms."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.motion import skeleton

T_POSE = {side: rotation.from_euler("Z", np.array([turn])) for side, turn in (("left", 90.0), ("right", -90.0))}
"""Rotation of each arm from hanging down to stretched out to the side, palm down."""

HANGING = np.array([0.0, -1.0, 0.0])
"""Direction of the arms and legs in our rest pose."""

CHILD = {"arm": "forearm", "forearm": "hand", "thigh": "shin", "shin": "foot"}
"""The body part at the far end of each limb's bone."""

MAX_TILT_DEG = 30.0
"""Largest tilt at which the trunk counts as upright in the rest pose; a smaller tilt is attributed to the spine."""

MAX_DEVIATION_DEG = 60.0
"""Largest angle between an arm's bone and its direction in the declared rest pose."""

MAX_TURN_DEG = 150.0
"""Largest angle between a bone and our rest pose at which its offset still determines its axial rotation."""


def rest_rotations(clip: Clip, source: dict[str, int], zero: str, upright: Floats, where: str) -> dict[str, Floats]:
    """Return the rotation C_j of each of our joints from our rest pose to that of the clip, in the file's axes.

    Parameters
    ----------
    clip : the motion clip.
    source : index in the clip of each of our joints.
    zero : the clip's pose at zero angles: hanging, t_pose, or offsets (read it from the bone offsets).
    upright : (3, 3) rotation from our axes to the file's.
    where : name of the file for error messages.
    """
    if clip.offsets is not None:
        _check_sides(clip, source, upright, where)
    if zero == "offsets":
        return _from_offsets(clip, source, upright, where)
    rest = dict.fromkeys(source, upright)
    if zero == "t_pose":
        for name in source:
            side, _, part = name.partition("_")
            if part in ("arm", "forearm", "hand"):
                rest[name] = upright @ T_POSE[side]
    if clip.offsets is not None:
        _check_arms(clip, source, rest, zero, where)
    return rest


def _check_sides(clip: Clip, source: dict[str, int], upright: Floats, where: str) -> None:
    """Raise UserError if the body is upright in its rest pose but its left arm is on the right."""
    trunk = upright.T @ trunk_axes(rest_positions(clip), source, where)
    if trunk[1, 1] > np.cos(np.radians(MAX_TILT_DEG)) and trunk[0, 0] < 0:
        raise UserError(
            f"{where}: at zero angles '{clip.names[source['left_arm']]}' is on the actor's right; swap left and "
            "right in corpus.motion.joints, or turn the body to face +z (up y) or -y (up z)"
        )


def _check_arms(clip: Clip, source: dict[str, int], rest: dict[str, Floats], zero: str, where: str) -> None:
    """Raise UserError if the bone offsets, which show the rest pose, contradict the declared rest pose."""
    position = rest_positions(clip)
    for name in skeleton.ARM_JOINTS:
        side, _, part = name.partition("_")
        bone = _bone(clip, source, position, name, f"{side}_{CHILD[part]}")
        if bone is None:
            continue
        if np.degrees(np.arccos(np.clip(bone @ rest[name] @ HANGING, -1, 1))) > MAX_DEVIATION_DEG:
            raise UserError(
                f"{where}: at zero angles '{clip.names[source[name]]}' does not point as in {zero}; "
                "correct corpus.motion.zero ('offsets' reads the pose from the file) or corpus.motion.up"
            )


def _from_offsets(clip: Clip, source: dict[str, int], upright: Floats, where: str) -> dict[str, Floats]:
    """Read the rest pose from the bone offsets, in the file's axes.

    Each limb is rotated by the smallest angle that aligns it with its bone, and the trunk has the axes ``upright``.
    If the trunk is far from upright in the rest pose (only the rotations make it upright), its own axes are used.
    """
    if clip.offsets is None:
        raise UserError(f"{where}: has no bone offsets to read the rest pose from; set corpus.motion.zero to t_pose")
    position = rest_positions(clip)
    trunk = trunk_axes(position, source, where)
    if rotation.angles_deg(upright.T @ trunk) < MAX_TILT_DEG:
        trunk = upright
    rest = dict.fromkeys(source, trunk)
    for name in skeleton.JOINTS:  # parents come first, so that a hand without an end site can follow its forearm
        side, _, part = name.partition("_")
        if name not in source or not part:
            continue
        bone = _bone(clip, source, position, name, f"{side}_{CHILD.get(part, '')}")
        if part == "foot":
            continue  # a foot is flat on the floor in the rest pose, whatever the direction of its bone
        if bone is None:
            rest[name] = rest.get(str(skeleton.PARENT[name]), trunk)
            continue
        bone = trunk.T @ bone
        if np.degrees(np.arccos(np.clip(HANGING @ bone, -1, 1))) > MAX_TURN_DEG:
            raise UserError(
                f"{where}: at zero angles '{clip.names[source[name]]}' points up, so its offset does not "
                "determine its axial rotation; export the file with a T-pose at zero angles"
            )
        rest[name] = trunk @ rotation.between(HANGING, bone)
    return rest


def rest_positions(clip: Clip) -> Floats:
    """Return the positions of all joints in the rest pose, (J, 3), in the file's unit and axes."""
    assert clip.offsets is not None
    position = clip.offsets.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            position[joint] = position[parent] + clip.offsets[joint]
    return position


def trunk_axes(position: Floats, source: dict[str, int], where: str) -> Floats:
    """Return left, up and forward axes of the trunk as columns (..., 3, 3) from joint positions (..., J, 3)."""
    shoulders = (position[..., source["left_arm"], :], position[..., source["right_arm"], :])
    left = shoulders[0] - shoulders[1]
    up = (shoulders[0] + shoulders[1]) / 2 - position[..., source["hips"], :]
    forward = np.cross(left, up)
    lengths = [np.linalg.norm(axis, axis=-1, keepdims=True) for axis in (left, up, forward)]
    if (lengths[2] <= 1e-6 * lengths[0] * lengths[1]).any():
        raise UserError(
            f"{where}: hips and shoulders do not span a plane; correct corpus.motion.joints, or export it again"
        )
    left, forward = left / lengths[0], forward / lengths[2]
    return np.stack([left, np.cross(forward, left), forward], axis=-1)


def _bone(clip: Clip, source: dict[str, int], position: Floats, name: str, child: str) -> Floats | None:
    """Return the unit direction of a limb's bone in the rest pose, or None if the file does not define its end."""
    joint = source[name]
    if child in source:
        bone = position[source[child]] - position[joint]
    elif joint in clip.tips:
        bone = clip.tips[joint]
    else:
        return None
    length = float(np.linalg.norm(bone))
    return bone / length if length > 0 else None
