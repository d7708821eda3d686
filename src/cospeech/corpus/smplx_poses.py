"""Our motion as that of SMPL-X: the inverse of reading it, by ``onto``."""

from __future__ import annotations

import numpy as np

from cospeech.corpus import rest
from cospeech.corpus.retarget import SMPLX
from cospeech.data.arrays import Floats
from cospeech.formats import smplx
from cospeech.geometry import rotation
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses

PELVIS_M = np.array([0.003, -0.351, 0.012])
"""Position of the pelvis of the neutral SMPL-X body while its displacement is zero, in metres, rounded."""


def from_poses(poses: Poses) -> tuple[Floats, Floats]:
    """Return rotation vectors (T, 22, 3) in radians and the displacement (T, 3) in metres of poses of ``STANDARD``.

    Joints of SMPL-X that our skeleton lacks do not turn. The displacement puts the pelvis where our hips are.
    """
    turned, placed = STANDARD.world(poses.root_m, poses.rotations)
    theirs = {name: joint for joint, name in SMPLX.items()}
    world = np.empty((len(turned), len(smplx.NAMES), 3, 3))
    local = np.empty_like(world)
    for index, (name, parent) in enumerate(zip(smplx.NAMES, smplx.PARENTS, strict=True)):
        above = np.eye(3) if parent < 0 else world[:, parent]
        if name in theirs:
            ours = theirs[name]
            side, _, part = ours.partition("_")
            to_rest = rest.T_POSE[side] if part in ("arm", "forearm", "hand") else np.eye(3)
            world[:, index] = turned[:, STANDARD.joints.index(ours)] @ np.swapaxes(to_rest, -1, -2)
        else:
            world[:, index] = above
        local[:, index] = np.swapaxes(np.broadcast_to(above, world[:, index].shape), 1, 2) @ world[:, index]
    return rotation.to_vectors(local), placed[:, 0] - PELVIS_M
