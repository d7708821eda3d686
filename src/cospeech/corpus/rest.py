"""The pose of another skeleton at zero angles, beside ours: upright with hanging arms."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.motion import skeleton

T_POSE = {side: rotation.from_euler("Z", np.array([turn])) for side, turn in (("left", 90.0), ("right", -90.0))}
"""From hanging arms to arms straight out to the sides, palms down."""

HANGING = np.array([0.0, -1.0, 0.0])
"""Direction of our arms and legs at rest."""

CHILD = {"arm": "forearm", "forearm": "hand", "thigh": "shin", "shin": "foot"}
"""The body part that a limb's bone leads to."""

STANDS = 30.0
"""Angle in degrees to upright up to which a trunk at rest is upright, and its spine bent."""

AGREE = 60.0
"""Angle in degrees by which an arm's bone may be off the declared pose at zero angles."""

WIDEST = 150.0
"""Angle in degrees to our rest pose beyond which an offset does not tell how its bone is turned about itself."""


def pose(clip: Clip, source: dict[str, int], zero: str, upright: Floats, where: str) -> dict[str, Floats]:
    """Return C_j of our joints: from our rest pose to the source's pose at zero angles, in the file's axes."""
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
    """Refuse a body that stands at zero angles but has its left arm on the right."""
    stands = upright.T @ trunk_axes(places_at_rest(clip), source, where)
    if stands[1, 1] > np.cos(np.radians(STANDS)) and stands[0, 0] < 0:
        raise UserError(
            f"{where}: at zero angles '{clip.names[source['left_arm']]}' is on the actor's right; exchange left and "
            "right in corpus.motion.joints, or turn the body to face +z (up y) or -y (up z)"
        )


def _check_arms(clip: Clip, source: dict[str, int], rest: dict[str, Floats], zero: str, where: str) -> None:
    """Refuse a declared pose that the offsets, which are the pose at zero angles, contradict."""
    place = places_at_rest(clip)
    for name in skeleton.ARM_JOINTS:
        side, _, part = name.partition("_")
        bone = _bone(clip, source, place, name, f"{side}_{CHILD[part]}")
        if bone is not None and np.degrees(np.arccos(np.clip(bone @ rest[name] @ HANGING, -1, 1))) > AGREE:
            raise UserError(
                f"{where}: at zero angles '{clip.names[source[name]]}' points elsewhere than in {zero}; "
                "correct corpus.motion.zero (offsets reads the pose from the file) or corpus.motion.up"
            )


def _from_offsets(clip: Clip, source: dict[str, int], upright: Floats, where: str) -> dict[str, Floats]:
    """Read the rest pose from the offsets: each limb by the least turn to its bone, the trunk as ``upright`` is.

    A trunk that is far from upright at rest, as its file stands it up by rotations alone, has the axes of its own.
    """
    if clip.offsets is None:
        raise UserError(f"{where}: has no bone offsets to read a pose from; set corpus.motion.zero to t_pose")
    place = places_at_rest(clip)
    trunk = trunk_axes(place, source, where)
    if rotation.angles_deg(upright.T @ trunk) < STANDS:
        trunk = upright
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
        bone = trunk.T @ bone
        if np.degrees(np.arccos(np.clip(HANGING @ bone, -1, 1))) > WIDEST:
            raise UserError(
                f"{where}: at zero angles '{clip.names[source[name]]}' points up, so its offset does not tell how it "
                "is turned about itself; export the file with a T-pose at zero angles"
            )
        rest[name] = trunk @ _least_turn(HANGING, bone)
    return rest


def places_at_rest(clip: Clip) -> Floats:
    """Return the place of every joint at zero angles, (J, 3), in the file's unit and axes."""
    assert clip.offsets is not None
    place = clip.offsets.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            place[joint] = place[parent] + clip.offsets[joint]
    return place


def trunk_axes(place: Floats, source: dict[str, int], where: str) -> Floats:
    """Return left, up and forward of the trunk as columns (..., 3, 3), from the places of the joints (..., J, 3)."""
    shoulders = (place[..., source["left_arm"], :], place[..., source["right_arm"], :])
    left = shoulders[0] - shoulders[1]
    up = (shoulders[0] + shoulders[1]) / 2 - place[..., source["hips"], :]
    forward = np.cross(left, up)
    lengths = [np.linalg.norm(axis, axis=-1, keepdims=True) for axis in (left, up, forward)]
    if (lengths[2] <= 1e-6 * lengths[0] * lengths[1]).any():
        raise UserError(
            f"{where}: hips and shoulders span no trunk; correct corpus.motion.joints, or export it again"
        )
    left, forward = left / lengths[0], forward / lengths[2]
    return np.stack([left, np.cross(forward, left), forward], axis=-1)


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
