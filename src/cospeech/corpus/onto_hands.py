"""Keep the relation of the hands to the body when motion is moved onto a skeleton of other proportions.

Where limbs keep their directions, hands that meet on one body miss each other on a body with longer arms or narrower
shoulders (see ``onto``). Here each wrist gets a place that depends on its place on our body alone, so that hands that
meet there meet on the other body as well; the elbow follows by inverse kinematics of the two bones of the arm.

Let x (to the left), y and z (to the front) be the place of a wrist of ours relative to the middle between the
shoulders, in the frame of the chest, w half the distance between the shoulders, and s the ratio of the lengths of the
arms. The place on the other body, with half the distance w' between its shoulders, is

    x' = sign(x) (min(|x|, w) w' / w + s max(|x| - w, 0)),    y' = s y,    z' = s z.

Arms that hang, or are stretched to the front or the side, remain so. The elbow stays on that side of the line from
shoulder to wrist on which it is if limbs keep their directions, and hands keep their orientation in the world. If a
place is out of reach, the straight arm points to it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cospeech.corpus import onto, retarget
from cospeech.corpus.onto import Target
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses

SIDES = ("left", "right")

BACKWARD = 1e-3
"""How much the elbow of a straight arm tends backward, relative to the length of the upper arm."""


def check_joints(source: Mapping[str, int], where: str) -> None:
    """Raise UserError if a hand has no counterpart."""
    missing = [f"{side}_hand" for side in SIDES if f"{side}_hand" not in source]
    if missing:
        raise UserError(f"{where}: no joint is mapped to '{missing[0]}', needed by --keep hands; add it to --joints")


def places(poses: Poses, target: Target, source: Mapping[str, int], root: Floats, local: Floats) -> Floats:
    """Return where the wrists belong on the other skeleton, (T, 2, 3) in the world of its file.

    Parameters
    ----------
    poses, target, source : as for ``onto.retargeted``, which returned ``root`` and ``local``.
    """
    ours = {name: joint for joint, name in enumerate(STANDARD.joints)}
    axes = retarget.AXES[target.up]
    turned, placed = STANDARD.world(poses.root_m, poses.rotations)
    chest = turned[:, ours["chest"]]
    wrists = placed[:, [ours[f"{side}_hand"] for side in SIDES]] - _middle(placed, ours)[:, None]
    x, y, z = np.moveaxis(np.einsum("tba,tsb->tsa", chest, wrists), -1, 0)
    own_rest, their_rest = onto.standard_rest(), target.world(target.offsets[:1], target.rotations[None])[1][0]
    wide, their_wide = _half_width(own_rest, ours), _half_width(their_rest, source)
    scale = _arm_length(their_rest, source) / _arm_length(own_rest, ours)
    between, beyond = np.minimum(np.abs(x), wide), np.maximum(np.abs(x) - wide, 0.0)
    moved = np.stack([np.sign(x) * (between * their_wide / wide + scale * beyond), scale * y, scale * z], axis=-1)
    theirs = target.world(root, local)[1]
    return _middle(theirs, source)[:, None] + np.einsum("ab,tbc,tsc->tsa", axes.T, chest, moved)


def kept(
    poses: Poses, target: Target, source: Mapping[str, int], root: Floats, local: Floats
) -> tuple[Floats, Floats]:
    """Return rotations (T, J, 3, 3) that bring the wrists to their places, and how far these are out of reach (T, 2).

    The distances are relative to the length of the arm.

    Parameters
    ----------
    poses, target, source : as for ``onto.retargeted``, which returned ``root`` and ``local``.
    """
    goals = places(poses, target, source, root, local)
    turned, placed = target.world(root, local)
    chest = STANDARD.world(poses.root_m, poses.rotations)[0][:, STANDARD.joints.index("chest")]
    backward = -(retarget.AXES[target.up].T @ chest)[..., 2]
    bent, missed = local.copy(), np.empty(goals.shape[:2])
    for number, side in enumerate(SIDES):
        joints = [source[f"{side}_{part}"] for part in ("arm", "forearm", "hand")]
        shoulder, elbow, wrist = (placed[:, joint] for joint in joints)
        new_elbow, new_wrist = _bent(shoulder, elbow, wrist, goals[:, number], backward)
        length = np.linalg.norm(elbow - shoulder, axis=1) + np.linalg.norm(wrist - elbow, axis=1)
        missed[:, number] = np.linalg.norm(goals[:, number] - new_wrist, axis=1) / length
        upper = rotation.between(elbow - shoulder, new_elbow - shoulder)
        lower = rotation.between(wrist - elbow, new_wrist - new_elbow)
        still = np.broadcast_to(np.eye(3), upper.shape)
        for joint, above, own in zip(joints, (still, upper, lower), (upper, lower, still), strict=True):
            parent = turned[:, target.parents[joint]]
            bent[:, joint] = np.swapaxes(above @ parent, 1, 2) @ own @ turned[:, joint]
    return bent, missed


def _bent(shoulder: Floats, elbow: Floats, wrist: Floats, goal: Floats, backward: Floats) -> tuple[Floats, Floats]:
    """Return the elbow and the wrist (T, 3) of an arm that reaches for a goal (T, 3)."""
    upper, lower = np.linalg.norm(elbow - shoulder, axis=1), np.linalg.norm(wrist - elbow, axis=1)
    along = goal - shoulder
    wanted = np.linalg.norm(along, axis=1)
    reach = np.clip(wanted, np.abs(upper - lower), upper + lower)
    along = along / wanted[:, None]
    foot = (upper**2 - lower**2 + reach**2) / (2 * reach)  # of the perpendicular from the elbow on the line
    height = np.sqrt(np.maximum(upper**2 - foot**2, 0.0))
    old = (wrist - shoulder) / np.linalg.norm(wrist - shoulder, axis=1, keepdims=True)
    aside = _across(elbow - shoulder, old) + BACKWARD * upper[:, None] * backward
    aside = _across(np.einsum("tab,tb->ta", rotation.between(old, along), aside), along)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    return shoulder + foot[:, None] * along + height[:, None] * aside, shoulder + reach[:, None] * along


def _across(vectors: Floats, along: Floats) -> Floats:
    """Return the part of vectors (T, 3) that is perpendicular to unit vectors (T, 3)."""
    return vectors - (vectors * along).sum(axis=1, keepdims=True) * along


def _middle(placed: Floats, joints: Mapping[str, int]) -> Floats:
    """Return the middle (T, 3) between the shoulders of joints at ``placed`` (T, J, 3)."""
    return np.asarray(placed[:, [joints["left_arm"], joints["right_arm"]]].mean(axis=1))


def _half_width(rest: Floats, joints: Mapping[str, int]) -> float:
    return float(np.linalg.norm(rest[joints["left_arm"]] - rest[joints["right_arm"]])) / 2


def _arm_length(rest: Floats, joints: Mapping[str, int]) -> float:
    """Return the mean length of the arms, from shoulder to wrist, of joints at ``rest`` (J, 3)."""
    bones = [
        np.linalg.norm(rest[joints[f"{side}_{upper}"]] - rest[joints[f"{side}_{lower}"]])
        for side in SIDES
        for upper, lower in (("arm", "forearm"), ("forearm", "hand"))
    ]
    return float(sum(bones)) / 2
