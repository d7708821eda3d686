"""Velocity-preserving blending of recorded motion into a stream of motion (Levine 2009, 5.5).

When another recording takes over, the body is not yet in its pose. Each joint then turns toward the desired rotation
d_t by the angle that the recording itself turns in that frame, so that the movement keeps its speed,

    r_t = slerp(r_{t-1}, d_t; angle(d_t d_{t-1}^-1) / angle(d_t r_{t-1}^-1))

and arrives sooner or later: the angle between r_t and d_t never grows. The printed formula leaves some things open.
The share is limited to 1, where the desired rotation is reached. Angles are at most half a turn: of the two
quaternions of a rotation, the nearer one is interpolated. The derivative of the desired motion is that within its
recording, so at the first frame of a segment, d_{t-1} is the frame before the segment. The position of the root
follows the same rule, with distances in place of angles.

Joints are blended in world space, which keeps the direction of a gesture whatever the pose it starts from; the hands
are blended in parent space, where they stay within their anatomical limits.

Gesture controllers (Levine et al. 2010) leave a segment at its end or at an interruption frame and start another one
at its first frame, or within a gesture that a keyword asked for (7.1 and 8.1). The paper does not describe how the
poses are joined; the rule above, by the same author, applies to all of these transitions, since the frame to continue
from may be any frame.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.motion.body import Body
from cospeech.motion.library import Poses

PARENT_SPACE = ("left_hand", "right_hand")
"""Joints that are blended in parent space, on bodies that have them."""


@njit
def _multiply(a: Floats, b: Floats, product: Floats) -> None:
    """Write the product of two quaternions to ``product``, which must not be ``b``."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    product[0], product[1], product[2], product[3] = w, x, y, z


@njit
def _between(a: Floats, b: Floats, turn: Floats) -> float:
    """Write the quaternion a^-1 b with w >= 0 to ``turn`` and return its angle, from 0 to pi."""
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]
    y = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    turn[0], turn[1], turn[2], turn[3] = w, x, y, z
    return 2.0 * np.arctan2(np.sqrt(x * x + y * y + z * z), w)


@njit
def _to_blended_space(parents: Integers, in_parent_space: Flags, rotations: Floats, world: Floats) -> None:
    """Write rotations (J, 4) to ``world``, in world space except for those of ``in_parent_space``."""
    for joint in range(len(parents)):
        if parents[joint] < 0 or in_parent_space[joint]:
            world[joint] = rotations[joint]
        else:
            _multiply(world[parents[joint]], rotations[joint], world[joint])


@njit
def _follow(shown: Floats, desired: Floats, step: float, gap: float) -> None:
    """Move the position ``shown`` toward ``desired``, which is ``gap`` away, by ``step`` or until it is reached."""
    share = step / gap if gap > step else 1.0
    for axis in range(3):
        shown[axis] = shown[axis] + share * (desired[axis] - shown[axis]) if share < 1.0 else desired[axis]


@njit
def _advance(
    parents: Integers,
    in_parent_space: Flags,
    shown_root: Floats,
    shown: Floats,
    work: Floats,
    desired_root: Floats,
    desired: Floats,
    before_root: Floats,
    before: Floats,
    out: Floats,
) -> None:
    """Blend one frame; see ``Blender.step``. ``work`` is working memory (3, J, 4), ``out`` the result (3 + 4 J,)."""
    wanted, source, turn = work[0], work[1], work[2, 0]
    _to_blended_space(parents, in_parent_space, desired, wanted)
    _to_blended_space(parents, in_parent_space, before, source)
    step, gap = 0.0, 0.0
    for axis in range(3):
        step += (desired_root[axis] - before_root[axis]) ** 2
        gap += (desired_root[axis] - shown_root[axis]) ** 2
    _follow(shown_root, desired_root, np.sqrt(step), np.sqrt(gap))
    for axis in range(3):
        out[axis] = shown_root[axis]
    for joint in range(len(parents)):
        speed = _between(source[joint], wanted[joint], turn)
        angle = _between(shown[joint], wanted[joint], turn)
        if angle <= speed:
            shown[joint] = wanted[joint]
        elif speed > 0.0:
            half = 0.5 * speed
            scale = np.sin(half) / np.sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
            turn[0] = np.cos(half)
            for axis in range(1, 4):
                turn[axis] *= scale
            _multiply(shown[joint], turn, shown[joint])
            q = shown[joint]
            norm = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
            for axis in range(4):
                q[axis] *= norm
        place = out[3 + 4 * joint : 7 + 4 * joint]
        if parents[joint] < 0 or in_parent_space[joint]:
            place[:] = shown[joint]
        else:
            above = shown[parents[joint]]
            turn[0], turn[1], turn[2], turn[3] = above[0], -above[1], -above[2], -above[3]
            _multiply(turn, shown[joint], place)


@njit
def _advance_all(
    parents: Integers,
    in_parent_space: Flags,
    shown_root: Floats,
    shown: Floats,
    work: Floats,
    desired_root: Floats,
    desired: Floats,
    before_root: Floats,
    before: Floats,
    out: Floats,
) -> None:
    """Blend frames one after another; the last five arrays have one row per frame."""
    for frame in range(len(out)):
        _advance(
            parents, in_parent_space, shown_root, shown, work,
            desired_root[frame], desired[frame], before_root[frame], before[frame], out[frame],
        )  # fmt: skip


class Blender:
    """A body that follows desired motion, frame by frame.

    Parameters
    ----------
    body : the body that moves.
    in_parent_space : joints that are blended in parent space, with all joints below them; names that the body does
        not have are ignored. All others are blended in world space.

    Attributes
    ----------
    pose : (3 + 4 J,) the frame shown last: root position in metres, and the rotation w, x, y, z of each joint in
        parent space.
    """

    def __init__(self, body: Body, in_parent_space: Sequence[str] = PARENT_SPACE) -> None:
        n_joints = len(body.joints)
        local = np.zeros(n_joints, dtype=bool)
        for joint, parent in enumerate(body.parents):
            local[joint] = body.joints[joint] in in_parent_space or (parent >= 0 and local[parent])
        self._parents, self._local = body.parents, local
        self._root, self._shown = np.zeros(3), np.zeros((n_joints, 4))
        self._work = np.empty((3, n_joints, 4))
        self._started = False
        self.pose = np.zeros(3 + 4 * n_joints)

    def start(self, root_m: Floats, rotations: Floats) -> None:
        """Show a pose at once: root position (3,) in metres, and rotations (J, 4) in parent space."""
        self._root[:] = root_m
        _to_blended_space(self._parents, self._local, rotations, self._shown)
        self._started = True
        self.pose = np.append(root_m, rotations)

    def step(self, root_m: Floats, rotations: Floats, before_root_m: Floats, before_rotations: Floats) -> Floats:
        """Return the next frame, (3 + 4 J,): root position, and the rotation of each joint in parent space.

        The first frame, if nothing was shown before, is the desired pose.

        Parameters
        ----------
        root_m, rotations : (3,) in metres and (J, 4) in parent space, the desired pose.
        before_root_m, before_rotations : the pose one frame earlier in the recording of the desired one, from which
            the speed is taken; ``Library.before`` says where it is.
        """
        if not self._started:
            self.start(root_m, rotations)
        out = np.empty(len(self.pose))
        _advance(
            self._parents, self._local, self._root, self._shown, self._work,
            root_m, rotations, before_root_m, before_rotations, out,
        )  # fmt: skip
        self.pose = out
        return out

    def steps(self, desired: Poses, before: Poses) -> Poses:
        """Return the frames of all steps through T desired poses, as ``step`` does for each of them."""
        if not self._started:
            self.start(desired.root_m[0], desired.rotations[0])
        out = np.empty((len(desired.root_m), len(self.pose)))
        _advance_all(
            self._parents, self._local, self._root, self._shown, self._work,
            desired.root_m, desired.rotations, before.root_m, before.rotations, out,
        )  # fmt: skip
        self.pose = out[-1].copy()
        return Poses.from_frames(out)
