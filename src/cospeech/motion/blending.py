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

The lower body is an exception, since feet must not slide. If hips, thighs and shins approach a pose at different
speeds, feet that stand at the same place in both poses move in between. Hips, legs and root position therefore cover
the same share of their gaps: that of the formula with the root of the sum of their squared angles in place of each
angle. A distance of the root counts as an angle by the length of the legs.

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

LOWER_BODY = ("hips", *(f"{side}_{part}" for side in ("left", "right") for part in ("thigh", "shin", "foot")))
"""Joints that are blended together with the position of the root, on bodies that have them."""


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
def _turn(shown: Floats, turn: Floats, angle: float) -> None:
    """Turn the quaternion ``shown`` by ``angle`` about the axis of the quaternion ``turn``, which is overwritten."""
    half = 0.5 * angle
    scale = np.sin(half) / np.sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
    turn[0] = np.cos(half)
    for axis in range(1, 4):
        turn[axis] *= scale
    _multiply(shown, turn, shown)
    norm = 1.0 / np.sqrt(shown[0] ** 2 + shown[1] ** 2 + shown[2] ** 2 + shown[3] ** 2)
    for axis in range(4):
        shown[axis] *= norm


@njit
def _share(squared_speed: float, squared_gap: float) -> float:
    """Return the share of a gap that is covered in one frame, at most 1."""
    return np.sqrt(squared_speed / squared_gap) if squared_gap > squared_speed else 1.0


@njit
def _advance(
    parents: Integers,
    in_parent_space: Flags,
    together: Flags,
    root_weight: float,
    shown_root: Floats,
    shown: Floats,
    work: Floats,
    desired_root: Floats,
    desired: Floats,
    before_root: Floats,
    before: Floats,
    out: Floats,
) -> None:
    """Blend one frame; see ``Blender.step``. ``work`` is working memory (5, J, 4), ``out`` the result (3 + 4 J,)."""
    n_joints = len(parents)
    wanted, source, turns, speed, gap = work[0], work[1], work[2], work[3, :, 0], work[4, :, 0]
    _to_blended_space(parents, in_parent_space, desired, wanted)
    _to_blended_space(parents, in_parent_space, before, source)
    root_speed, root_gap = 0.0, 0.0
    for axis in range(3):
        root_speed += (desired_root[axis] - before_root[axis]) ** 2
        root_gap += (desired_root[axis] - shown_root[axis]) ** 2
    common_speed, common_gap = root_weight**2 * root_speed, root_weight**2 * root_gap
    for joint in range(n_joints):
        speed[joint] = _between(source[joint], wanted[joint], turns[joint])
        gap[joint] = _between(shown[joint], wanted[joint], turns[joint])
        if together[joint]:
            common_speed += speed[joint] ** 2
            common_gap += gap[joint] ** 2
    common = _share(common_speed, common_gap)
    share = common if root_weight > 0.0 else _share(root_speed, root_gap)
    for axis in range(3):
        if share < 1.0:
            shown_root[axis] += share * (desired_root[axis] - shown_root[axis])
        else:
            shown_root[axis] = desired_root[axis]
        out[axis] = shown_root[axis]
    for joint in range(n_joints):
        angle = common * gap[joint] if together[joint] else speed[joint]
        if angle >= gap[joint]:
            shown[joint] = wanted[joint]
        elif angle > 0.0:
            _turn(shown[joint], turns[joint], angle)
        place = out[3 + 4 * joint : 7 + 4 * joint]
        if parents[joint] < 0 or in_parent_space[joint]:
            place[:] = shown[joint]
        else:
            above, turn = shown[parents[joint]], turns[joint]
            turn[0], turn[1], turn[2], turn[3] = above[0], -above[1], -above[2], -above[3]
            _multiply(turn, shown[joint], place)


@njit
def _advance_all(
    parents: Integers,
    in_parent_space: Flags,
    together: Flags,
    root_weight: float,
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
            parents, in_parent_space, together, root_weight, shown_root, shown, work,
            desired_root[frame], desired[frame], before_root[frame], before[frame], out[frame],
        )  # fmt: skip


class Blender:
    """A body that follows desired motion, frame by frame.

    Parameters
    ----------
    body : the body that moves.
    in_parent_space : joints that are blended in parent space, with all joints below them; names that the body does
        not have are ignored. All others are blended in world space.
    together : joints that cover the same share of their gaps, and the root position with them; names that the body
        does not have are ignored. If empty, every joint follows the printed formula by itself.

    Attributes
    ----------
    pose : (3 + 4 J,) the frame shown last: root position in metres, and the rotation w, x, y, z of each joint in
        parent space.
    """

    def __init__(
        self, body: Body, in_parent_space: Sequence[str] = PARENT_SPACE, together: Sequence[str] = LOWER_BODY
    ) -> None:
        n_joints = len(body.joints)
        local = np.zeros(n_joints, dtype=bool)
        reach = np.zeros(n_joints)
        for joint, parent in enumerate(body.parents):
            local[joint] = body.joints[joint] in in_parent_space or (parent >= 0 and local[parent])
            reach[joint] = reach[parent] + np.linalg.norm(body.offsets_m[joint]) if parent >= 0 else 0.0
        group = np.array([name in together for name in body.joints]) & ~local
        longest = reach[group].max(initial=0.0)
        self._fixed = (body.parents, local, group, 1.0 / longest if longest > 0.0 else 0.0)
        self._root, self._shown = np.zeros(3), np.zeros((n_joints, 4))
        self._work = np.empty((5, n_joints, 4))
        self._started = False
        self.pose = np.zeros(3 + 4 * n_joints)

    def start(self, root_m: Floats, rotations: Floats) -> None:
        """Show a pose at once: root position (3,) in metres, and rotations (J, 4) in parent space."""
        self._root[:] = root_m
        _to_blended_space(*self._fixed[:2], rotations, self._shown)
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
            *self._fixed, self._root, self._shown, self._work,
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
            *self._fixed, self._root, self._shown, self._work,
            desired.root_m, desired.rotations, before.root_m, before.rotations, out,
        )  # fmt: skip
        self.pose = out[-1].copy()
        return Poses.from_frames(out)
