"""Skeletons of other proportions, with other rest poses, units and axes, and motion to move onto them."""

import numpy as np

from cospeech.corpus import onto, retarget
from cospeech.formats import bvh
from cospeech.geometry import rotation
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD

ARM_DEG = {"hanging": 0.0, "A": 45.0, "T": 90.0}


def other_offsets(pose, rng):
    """Offsets (J, 3) of a body with our joints and other proportions, whose arms are raised in the rest pose."""
    offsets = STANDARD.offsets_m * rng.uniform(0.7, 1.4, (len(STANDARD.joints), 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        raised = rotation.from_euler("Z", np.array([sign * ARM_DEG[pose]]))
        for part in ("forearm", "hand"):
            joint = STANDARD.joints.index(f"{side}_{part}")
            offsets[joint] = raised @ offsets[joint]
    for part in ("thigh", "shin", "foot"):
        left, right = (STANDARD.joints.index(f"{side}_{part}") for side in ("left", "right"))
        offsets[right] = offsets[left] * [-1, 1, 1]
    return offsets


def target(pose, up, seed, turned=False):
    """A skeleton; its joints have local axes of their own if it is ``turned``, as in GLB files."""
    rng = np.random.default_rng(seed)
    n_joints = len(STANDARD.joints)
    offsets = 100.0 * other_offsets(pose, rng) @ retarget.AXES[up]
    own = rotation.from_vectors(rng.normal(0, 1.0, (n_joints, 3))) if turned else np.tile(np.eye(3), (n_joints, 1, 1))
    local, placed = own.copy(), offsets.copy()
    for joint, parent in enumerate(STANDARD.parents[1:].tolist(), start=1):
        local[joint] = own[parent].T @ own[joint]
        placed[joint] = own[parent].T @ offsets[joint]
    tips = {
        STANDARD.joints.index(name): 100.0 * own[STANDARD.joints.index(name)].T @ (np.array(tip) @ retarget.AXES[up])
        for name, tip in skeleton.TIPS_M.items()
        if "hand" not in name
    }
    return onto.Target(STANDARD.joints, tuple(STANDARD.parents.tolist()), placed, local, tips, up, "theirs")


def motion_of(path):
    """The poses of our skeleton in a BVH file that cospeech wrote."""
    conventions = retarget.MotionConventions("y", "m", "cospeech", "hanging")
    return library.from_motion(retarget.motion_table(bvh.read(path), conventions, str(path))[0])
