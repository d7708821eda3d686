"""Two-bone inverse kinematics: the joint angles that place the end of an arm or leg at a target."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cospeech.data.arrays import Floats

STRETCH = 0.995
"""Maximum reach as a fraction of the length of the limb, which is never quite straight."""

TIGHTEST_DEG = 140.0
"""Maximum flexion of a limb."""


def reach(
    target_m: Floats, pole: Floats, upper_m: float, lower_m: float, bends: Literal["forward", "backward"]
) -> tuple[Floats, Floats]:
    """Return the rotation of the upper bone (T, 3, 3) and the hinge angle about x of the lower one (T,) in degrees.

    Both bones hang along -y at zero angles. The hinge bends only its natural way: an elbow ``forward`` with a
    negative angle, a knee ``backward`` with a positive one.

    Parameters
    ----------
    target_m : (T, 3) position of the end of the limb relative to its root, in the frame of the root's parent. A
        target that is out of reach, or too close, is moved along the line from the root.
    pole : (T, 3) direction in which the middle joint points away from the line between root and target.
    """
    distance = np.linalg.norm(target_m, axis=1)
    line = target_m / distance[:, None]
    nearest = np.sqrt(upper_m**2 + lower_m**2 + 2.0 * upper_m * lower_m * np.cos(np.radians(TIGHTEST_DEG)))
    distance = np.clip(distance, nearest, STRETCH * (upper_m + lower_m))
    off = pole - np.sum(pole * line, axis=1, keepdims=True) * line
    off /= np.linalg.norm(off, axis=1, keepdims=True)
    cosine = (upper_m**2 + distance**2 - lower_m**2) / (2.0 * upper_m * distance)
    sine = np.sqrt(1.0 - np.clip(cosine, -1.0, 1.0) ** 2)
    bone = cosine[:, None] * line + sine[:, None] * off
    inward = sine[:, None] * line - cosine[:, None] * off
    opening = (upper_m**2 + lower_m**2 - distance**2) / (2.0 * upper_m * lower_m)
    bend = 180.0 - np.degrees(np.arccos(np.clip(opening, -1.0, 1.0)))
    sign = 1.0 if bends == "forward" else -1.0
    up, front = -bone, sign * inward
    return np.stack([np.cross(up, front), up, front], axis=-1), -sign * bend
