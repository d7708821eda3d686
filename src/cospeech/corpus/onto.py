"""Move motion of our skeleton onto another one: the inverse of ``retarget``.

Limbs and trunk keep their directions in the world, whatever the proportions, the rest pose and the local axes of the
other skeleton. Let V_j be the rotation of our joint j in the world, A the rotation from the file's axes to ours, C_j
the rotation from our rest pose to that of the file (see ``rest``), and W0_j the rotation of the file's joint in its
rest pose. The joint then has the rotation A^T V_j C_j^T W0_j in the world of the file. Joints that our skeleton lacks
keep their rotation relative to their parent.

The displacement of the hips is scaled by the length of the legs, and the body is raised or lowered in each frame so
that the lower foot is at the height that it has in our motion, scaled likewise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cospeech.corpus import rest, retarget
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.bvh import Clip
from cospeech.motion import skeleton
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses

LEGS = tuple(f"{side}_{part}" for side in ("left", "right") for part in ("thigh", "shin", "foot"))

LIMBS = tuple(
    (f"{side}_{upper}", f"{side}_{lower}")
    for side in ("left", "right")
    for upper, lower in (("arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))
)
"""The bones of the limbs: the joint that turns each, and the joint at its end."""

MIXAMO = {
    "hips": "Hips", "spine": "Spine", "chest": "Spine2", "neck": "Neck", "head": "Head",
    **{
        f"{side.lower()}_{ours}": f"{side}{theirs}"
        for side in ("Left", "Right")
        for ours, theirs in {
            "arm": "Arm", "forearm": "ForeArm", "hand": "Hand", "thigh": "UpLeg", "shin": "Leg", "foot": "Foot",
        }.items()
    },
}  # fmt: skip
"""The names of Mixamo, which many avatars share; they may have a prefix that ends with a colon."""

PRESETS: Mapping[str, Mapping[str, str]] = {
    "cospeech": {name: name for name in skeleton.JOINTS},
    "mixamo": MIXAMO,
    "mixamo, chest Spine1": MIXAMO | {"chest": "Spine1"},
    "smplx": retarget.SMPLX,
}
"""Names of the joints in skeletons that are common, by name of our joint."""


@dataclass(frozen=True)
class Target:
    """A skeleton to move motion onto, in its rest pose.

    Attributes
    ----------
    names, parents : (J,) joints, parents first, and their parents; -1 for the root, which is the first.
    offsets : (J, 3) position of each joint: the root in the world, all others in the frame of the parent.
    rotations : (J, 3, 3) rotations in the frame of the parent.
    tips : by index of a joint, the end (3,) of a bone that has no further joint.
    up : the axis that points up, y or z.
    where : the file, for messages.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats
    rotations: Floats
    tips: Mapping[int, Floats]
    up: str
    where: str

    def world(self, root: Floats, rotations: Floats) -> tuple[Floats, Floats]:
        """Return rotations (T, J, 3, 3) and positions (T, J, 3) of the joints in the world of the file.

        Parameters
        ----------
        root : (T, 3) position of the root.
        rotations : (T, J, 3, 3) rotations in the frame of the parent.
        """
        turned, placed = rotations.copy(), np.empty((*rotations.shape[:2], 3))
        placed[:, 0] = root
        for joint, parent in enumerate(self.parents[1:], start=1):
            turned[:, joint] = turned[:, parent] @ rotations[:, joint]
            placed[:, joint] = placed[:, parent] + turned[:, parent] @ self.offsets[joint]
        return turned, placed


def joint_map(names: tuple[str, ...], declared: Mapping[str, str] | None, where: str) -> dict[str, int]:
    """Return the index of each of our joints in a skeleton.

    Parameters
    ----------
    names : the joints of the skeleton.
    declared : their names by name of our joint; None tries ``PRESETS``.

    Raises
    ------
    UserError : if a declared joint is unknown, or no preset fits.
    """
    if declared is not None:
        return retarget.joint_map(names, dict(declared), where)
    short = [name.rpartition(":")[2].lower() for name in names]
    needed = (*retarget.REQUIRED_JOINTS, *LEGS)
    for preset in PRESETS.values():
        found = {ours: short.index(theirs.lower()) for ours, theirs in preset.items() if theirs.lower() in short}
        if all(name in found for name in needed):
            return found
    raise UserError(
        f"{where}: its joints have unknown names ({', '.join(names[:12])}, ...); name them with --joints FILE, a "
        f"YAML file with lines such as 'hips: {names[0]}', for {', '.join(needed)}"
    )


def check_joints(source: Mapping[str, int], where: str) -> None:
    """Raise UserError if a joint is missing without which feet cannot stay on the floor."""
    missing = [name for name in LEGS if name not in source]
    if missing:
        raise UserError(f"{where}: no joint is mapped to '{missing[0]}'; add it to --joints")


def retargeted(poses: Poses, target: Target, source: Mapping[str, int]) -> tuple[Floats, Floats]:
    """Return root positions (T, 3), in the world of the file, and rotations (T, J, 3, 3) in the frame of the parent.

    Parameters
    ----------
    poses : motion of ``STANDARD``.
    target : the other skeleton.
    source : index in it of each of our joints that it has (see ``joint_map``).

    Raises
    ------
    UserError : if the rest pose cannot be read from the skeleton.
    """
    axes = retarget.AXES[target.up]
    at_rest, placed = target.world(target.offsets[:1], target.rotations[None])
    at_rest = at_rest[0]
    turned, own = STANDARD.world(poses.root_m, poses.rotations)
    to_rest = rest.rest_rotations(_upright(target, at_rest), dict(source), "offsets", axes.T, target.where)
    ours = {joint: name for name, joint in source.items()}
    world = np.empty((len(turned), len(target.names), 3, 3))
    for joint, parent in enumerate(target.parents):
        if joint in ours:
            name = ours[joint]
            world[:, joint] = axes.T @ turned[:, STANDARD.joints.index(name)] @ to_rest[name].T @ at_rest[joint]
        else:
            above = np.eye(3) if parent < 0 else world[:, parent]
            world[:, joint] = above @ target.rotations[joint]
    local = np.stack(
        [
            world[:, joint] if parent < 0 else np.swapaxes(world[:, parent], 1, 2) @ world[:, joint]
            for joint, parent in enumerate(target.parents)
        ],
        axis=1,
    )
    scale = _leg_length(placed[0], source) / _leg_length(standard_rest(), _standard())
    root = target.offsets[0] + scale * poses.root_m @ axes
    return root + _raised(target, source, root, local, placed[0], scale * _foot_heights(own)), local


def limb_errors_deg(poses: Poses, target: Target, source: Mapping[str, int], local: Floats) -> Floats:
    """Return the angles (T, n) between our limbs and those of the other skeleton, by forward kinematics of both.

    Parameters
    ----------
    local : (T, J, 3, 3) rotations, as ``retargeted`` returns them.
    """
    axes = retarget.AXES[target.up]
    own = STANDARD.world(poses.root_m, poses.rotations)[1]
    theirs = target.world(np.zeros((len(local), 3)), local)[1] @ axes.T
    errors = []
    for start, end in LIMBS:
        if start in source and end in source:
            a = own[:, STANDARD.joints.index(end)] - own[:, STANDARD.joints.index(start)]
            b = theirs[:, source[end]] - theirs[:, source[start]]
            errors.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))))
    return np.stack(errors, axis=1)


def _upright(target: Target, at_rest: Floats) -> Clip:
    """Return the rest pose of a skeleton as a clip whose joints all have the axes of the file's world."""
    parents = np.array(target.parents)
    offsets = target.offsets.copy()
    offsets[1:] = np.einsum("jab,jb->ja", at_rest[parents[1:]], target.offsets[1:])
    tips = {joint: at_rest[joint] @ tip for joint, tip in target.tips.items()}
    still = np.tile(np.eye(3), (1, len(target.names), 1, 1))
    return Clip(target.names, target.parents, still, {0: offsets[:1]}, 1.0, offsets, tips)


def _standard() -> dict[str, int]:
    return {name: index for index, name in enumerate(STANDARD.joints)}


def standard_rest() -> Floats:
    """Return the positions (J, 3) of our joints in the rest pose."""
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(STANDARD.joints), 1))
    return STANDARD.world(np.zeros((1, 3)), still)[1][0]


def _leg_length(places: Floats, source: Mapping[str, int]) -> float:
    """Return the mean length of the legs, from hip to ankle, of joints at ``places`` (J, 3)."""
    bones = [
        np.linalg.norm(places[source[f"{side}_{upper}"]] - places[source[f"{side}_{lower}"]])
        for side in ("left", "right")
        for upper, lower in (("thigh", "shin"), ("shin", "foot"))
    ]
    return float(sum(bones)) / 2


def _foot_heights(own: Floats) -> Floats:
    """Return how much higher our lower ankle is than in the rest pose, (T,) in metres."""
    rest_places = standard_rest()
    feet = [STANDARD.joints.index(f"{side}_foot") for side in ("left", "right")]
    return np.asarray((own[:, feet, 1] - rest_places[feet, 1]).min(axis=1))


def _raised(
    target: Target, source: Mapping[str, int], root: Floats, local: Floats, placed: Floats, heights: Floats
) -> Floats:
    """Return the vertical displacement (T, 3) that puts the lower ankle ``heights`` (T,) above its rest height."""
    vertical = "xyz".index(target.up)
    feet = [source[f"{side}_foot"] for side in ("left", "right")]
    now = (target.world(root, local)[1][:, feet, vertical] - placed[feet, vertical]).min(axis=1)
    moved = np.zeros((len(root), 3))
    moved[:, vertical] = heights - now
    return moved
