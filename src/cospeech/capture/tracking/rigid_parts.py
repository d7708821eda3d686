"""Prediction of hidden markers on rigid body parts from the visible markers of the same part.

The pose of the part is the least-squares fit to its visible markers (Kabsch 1976).
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.geometry.rigid import align
from cospeech.motion.markers import MARKERS

FEWEST = 3
"""Minimum number of visible markers that determine the pose of a part."""

JOINTS = [marker.joint for marker in MARKERS]
PARTS = [
    np.array([joint == part for joint in JOINTS]) for part in dict.fromkeys(JOINTS) if JOINTS.count(part) > FEWEST
]
"""Masks (M,) of the parts with enough markers to predict a hidden one."""


def carried(reference_m: Floats, points_m: Floats) -> Floats:
    """Return the positions (M, 3) of hidden markers on rigid parts; NaN if visible, or if too few others are visible.

    Parameters
    ----------
    reference_m : (M, 3) the markers in a reference pose.
    points_m : (M, 3) the visible markers; NaN for hidden ones.
    """
    found = np.full(points_m.shape, np.nan)
    seen = np.isfinite(points_m[:, 0])
    for part in PARTS:
        held, hidden = part & seen, part & ~seen
        if hidden.any():
            rotations, shifts = align(reference_m[held], points_m[None, held])
            found[hidden] = reference_m[hidden] @ rotations[0].T + shifts[0]
    return found
