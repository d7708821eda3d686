"""Which of the many triples of Euler angles stands for a rotation, so that a joint's angles run on without jumps.

Every rotation has two triples, (x, z, y) and (x + 180, 180 - z, y + 180), and each angle may be off by full turns.
One fixed choice jumps where the joint passes the pose in which the order locks (an arm straight out to the side);
following the previous frame alone can leave a record a turn away from the next one, and then one pose has two names.
So each angle lies within half a turn of the middle of what the joint can do, and between the two triples the path of
least change is taken, with a small charge for every frame far from the middle that brings it back.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.motion import skeleton

MIDDLE_X = {"left_arm": -60.0, "right_arm": -60.0, "left_forearm": -60.0, "right_forearm": -60.0}
"""Middle of the range of x in degrees where it is not 0: arms and forearms are lifted forward, seldom back."""

AWAY = 0.01
"""Charge of a frame's squared distance from the middle, beside the squared change to the next frame at 1."""


def least_change(matrices: Floats) -> Floats:
    """Return the Euler angles x, y, z in degrees, (T, J, 3), of the rotations (T, J, 3, 3) of ``skeleton.JOINTS``."""
    middle = np.array([[MIDDLE_X.get(joint, 0.0), 0.0, 0.0] for joint in skeleton.JOINTS])
    first = skeleton.euler(matrices)
    second = np.stack([first[..., 0] + 180, first[..., 1] + 180, 180 - first[..., 2]], axis=-1)
    both = np.stack([first, second], axis=2)
    both -= middle[:, None]
    both = (both + 180) % 360 - 180  # from here on as distance from the middle
    chosen = _cheapest_path(both)
    return np.take_along_axis(both, chosen[:, :, None, None], axis=2)[:, :, 0] + middle


def _cheapest_path(both: Floats) -> npt.NDArray[np.int64]:
    """Return which triple of ``both`` (T, J, 2, 3) to take, (T, J): Viterbi over two states for every joint."""
    change = ((both[1:, :, None, :, :] - both[:-1, :, :, None, :]) ** 2).sum(axis=-1)  # (T - 1, J, from, to)
    away = AWAY * (both**2).sum(axis=-1)
    cost = away[0]
    origin = np.zeros(both.shape[:3], dtype=np.int64)
    for t in range(1, len(both)):
        total = cost[:, :, None] + change[t - 1]
        origin[t] = total.argmin(axis=1)
        cost = total.min(axis=1) + away[t]
    path = np.zeros(both.shape[:2], dtype=np.int64)
    path[-1] = cost.argmin(axis=1)
    joints = np.arange(both.shape[1])
    for t in range(len(both) - 1, 0, -1):
        path[t - 1] = origin[t, joints, path[t]]
    return path
