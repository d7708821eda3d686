"""Which of the equivalent triples of Euler angles describes a rotation, so that joint angles are continuous in time.

Every rotation has two triples, (x, z, y) and (x + 180, 180 - z, y + 180), and each angle is defined up to full turns.
A fixed choice jumps where the joint passes through the gimbal lock (an arm straight out to the side).
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.motion import skeleton

MIDDLE_X = {"left_arm": -60.0, "right_arm": -60.0, "left_forearm": -60.0, "right_forearm": -60.0}
"""Middle of the range of x in degrees where it is not 0: arms and forearms are lifted forward, seldom backward."""

AWAY = 0.01
"""Weight of the squared distance from the middle of the range; the squared change between frames has weight 1."""


def _other_triple(angles_deg: Floats) -> Floats:
    """Return the second triple x, y, z, (..., 3) in degrees, for the rotations of angles (..., 3)."""
    return np.stack([angles_deg[..., 0] + 180, angles_deg[..., 1] + 180, 180 - angles_deg[..., 2]], axis=-1)


def follow(angles_deg: Floats) -> Floats:
    """Return Euler angles (T, J, 3) of the same rotations, chosen in every frame to change least from the last frame.

    The first frame keeps its angles. The result is unbounded: unlike ``least_change`` it follows any number of turns,
    as filters need, but a pose may come with different angles at different times.

    Parameters
    ----------
    angles_deg : (T, J, 3) angles x, y, z in degrees.
    """
    result = angles_deg.copy()
    other = _other_triple(angles_deg)
    for frame in range(1, len(result)):
        last = result[frame - 1]
        near = angles_deg[frame] - 360 * np.round((angles_deg[frame] - last) / 360)
        far = other[frame] - 360 * np.round((other[frame] - last) / 360)
        nearer = np.abs(near - last).sum(axis=-1) <= np.abs(far - last).sum(axis=-1)
        result[frame] = np.where(nearer[:, None], near, far)
    return result


def least_change(matrices: Floats) -> Floats:
    """Return the Euler angles x, y, z in degrees, (T, J, 3), of the rotations (T, J, 3, 3) of ``skeleton.JOINTS``.

    Following the previous frame alone may leave a record one turn away from the next, so that the same pose has
    different angles. Here each angle lies within half a turn of the middle of its range. Between the two triples,
    the path with the least total squared change is chosen for each joint; a small cost of every frame that is far
    from the middle of the range brings the path back to it.
    """
    middle = np.array([[MIDDLE_X.get(joint, 0.0), 0.0, 0.0] for joint in skeleton.JOINTS])
    first = skeleton.euler(matrices)
    both = np.stack([first, _other_triple(first)], axis=2)
    both -= middle[:, None]
    both = (both + 180) % 360 - 180  # from here on, distances from the middle
    chosen = _cheapest_path(both)
    return np.take_along_axis(both, chosen[:, :, None, None], axis=2)[:, :, 0] + middle


def _cheapest_path(both: Floats) -> Integers:
    """Return which triple of ``both`` (T, J, 2, 3) to take, (T, J), by a two-state Viterbi search per joint."""
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
