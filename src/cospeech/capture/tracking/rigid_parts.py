"""Markers on one rigid part of the body: a hidden one stands where the others carry it.

The part is turned and moved by the least-squares fit of its visible markers (Kabsch 1976).
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.geometry.rigid import align
from cospeech.motion.markers import MARKERS

FEWEST = 3
"""Markers that fix a rigid part."""

JOINTS = [marker.joint for marker in MARKERS]
PARTS = [
    np.array([joint == part for joint in JOINTS]) for part in dict.fromkeys(JOINTS) if JOINTS.count(part) > FEWEST
]
"""The parts (M,) that can carry a hidden marker."""


def carried(reference_m: Floats, points_m: Floats) -> Floats:
    """Return where the hidden markers of rigid parts are, (M, 3); NaN for visible ones and where too few are visible.

    Parameters
    ----------
    reference_m : (M, 3) all markers in one pose.
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
