"""A head that moves alone, for outputs that show a body: VMC and the page."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit
from cospeech.live.outputs import Output
from cospeech.motion.body import STANDARD
from cospeech.motion.head import JOINTS

PLACES = np.array([3 + 4 * STANDARD.joints.index(joint) for joint in JOINTS])
"""Where the rotations of neck and head are in a frame of the body."""


@njit
def _turn(angles_deg: Floats, places: Floats, pose: Floats) -> None:
    """Write one half of the rotation Rx Ry Rz to each of some joints of a pose, as ``motion.head.moved`` does."""
    sx, sy, sz = np.sin(np.radians(0.5 * angles_deg))
    cx, cy, cz = np.cos(np.radians(0.5 * angles_deg))
    w, x = cx * cy * cz - sx * sy * sz, sx * cy * cz + cx * sy * sz
    y, z = cx * sy * cz - sx * cy * sz, cx * cy * sz + sx * sy * cz
    sign = 1.0 if w >= 0.0 else -1.0  # of the two halves, the shorter one
    half = np.array([sign * w + 1.0, sign * x, sign * y, sign * z])
    half /= np.sqrt((half * half).sum())
    for place in places:
        pose[place : place + 4] = half


class OnBody:
    """Shows a head on a standing body, of which neck and head take one half of each rotation.

    Parameters
    ----------
    output : shows the body.
    """

    def __init__(self, output: Output) -> None:
        self._output, self.in_real_time, self.close = output, output.in_real_time, output.close
        self._pose = np.zeros(3 + 4 * len(STANDARD.joints))
        self._pose[3::4] = 1.0
        _turn(np.zeros(3), PLACES, self._pose)  # loads the kernel

    def show(self, frame: int, time_s: float, pose: Floats) -> None:
        """Take the next angles of the head, x, y and z in degrees; see ``outputs.Output``."""
        _turn(pose, PLACES, self._pose)
        self._output.show(frame, time_s, self._pose)
