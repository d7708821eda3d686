"""Joining recorded motion to a stream of motion: velocity-preserving blending, and smooth transitions.

When another recording takes over, the body is not yet in its pose. Both classes here take one frame of the desired
motion at a time and return the frame to show; they differ in how they cover the gap.

``Blender`` is the velocity-preserving blending of Levine 2009, 5.5. Each joint turns toward the desired rotation d_t
by the angle that the recording itself turns in that frame, so that the movement keeps its speed,

    r_t = slerp(r_{t-1}, d_t; angle(d_t d_{t-1}^-1) / angle(d_t r_{t-1}^-1))

and the angle between r_t and d_t never grows. The printed formula leaves some things open. The share is limited to 1,
where the desired rotation is reached. Angles are at most half a turn: of the two quaternions of a rotation, the
nearer one is interpolated. The derivative of the desired motion is that within its recording, so at the first frame
of a segment, d_{t-1} is the frame before the segment. Joints are blended in world space, which keeps the direction of
a gesture whatever the pose it starts from; the hands are blended in parent space, where they stay within their
anatomical limits.

``Transitions`` are smooth. A controller (Levine et al. 2010) leaves a segment at its end or at an interruption frame
and starts another one at its first frame or, for a keyword, within it (7.1 and 8.1). The paper does not say how the
poses are joined. Here, the difference between shown and desired pose decays within a fixed time: the rotation from
the desired to the shown pose and its rate of change at the join are continued by polynomials of degree five that
end at zero without speed and acceleration (*inertialization*: D. Bollo, Game Developers Conference, 2018), and the
motion of the recording is added to it. The arms are an exception, since the sum of a difference and a movement may
lie inside the trunk: they keep the speed of the recording as above, but take it over within a few frames.

The ``Blender`` changes the direction of a movement at once, and accelerations at joins are larger than in recorded
motion. The shares of joins without such accelerations (``joins_within`` in the table ``motion_quality``) and the mean
speeds of feet on the floor, with the arm subunits of one actor in random order, are

    recording        as printed         Blender            Transitions        recorded
    demo, ada        78 %,   9 mm/s     82 %,   4 mm/s     91 %,   5 mm/s       4 mm/s
    demo, deniz      45 %,   9 mm/s     93 %,   3 mm/s     93 %,   4 mm/s       3 mm/s
    BEAT2, scott      7 %, 198 mm/s      5 %, 123 mm/s     49 %, 144 mm/s      31 mm/s

The actors of the demo stand still. The one of BEAT2 steps and turns, and only steps could join such segments without
sliding. On motion whose frames have independent noise, as the virtual studio makes it without film, transitions carry
the noise on: there, the ``Blender`` is better.

Two things keep the feet from sliding, which neither paper mentions. First, all joints of the lower body cover the
same share of their gaps, since feet that stand at the same place in two poses would move in between if hips, thighs
and shins had speeds of their own. For the ``Blender``, this share is that of the formula with the root of the sum of
their squared angles in place of each angle. Second, the horizontal position of the body follows from its feet: they
move over the floor as the feet of the recording do, wherever in the room that was recorded. The slower foot counts
more. The body returns to the place of the recording no faster than the slower foot moves there. The root of a body
without such feet follows its recorded position in the same way as its rotation.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.motion import blending_kernels
from cospeech.motion.body import Body
from cospeech.motion.library import Poses

PARENT_SPACE = ("left_hand", "right_hand")
"""Joints that are blended in parent space, on bodies that have them."""

ARMS = tuple(f"{side}_{part}" for side in ("left", "right") for part in ("arm", "forearm", "hand"))
"""Joints that keep the speed of their recording in ``Transitions``, too, on bodies that have them."""

LOWER_BODY = ("hips", *(f"{side}_{part}" for side in ("left", "right") for part in ("thigh", "shin", "foot")))
"""Joints that cover the same share of their gaps, on bodies that have them."""

FEET = ("left_foot", "right_foot")
"""Joints that stand on the floor, on bodies that have all of them."""

TRANSITION_S = 1.0
"""Duration of transitions."""

SWING_S = 0.4
"""Time within which a joint comes to rest relative to the new recording. Its rate at the join is that of a single
frame; if it went on for longer, the noise of a recording would be carried far, and feet and arms with it."""

CATCH_UP_S = 0.1
"""Time constant with which the body as a whole takes over the speed of another recording."""

ARM_CATCH_UP_S = 0.05
"""The same for the arms. If it is longer, arms that come down are carried into the trunk."""


class Stepper(ABC):
    """A body that follows desired motion, frame by frame.

    Attributes
    ----------
    pose : (3 + 4 J,) the frame shown last: root position in metres, and the rotation w, x, y, z of each joint in
        parent space.
    """

    def __init__(self, body: Body, in_parent_space: Sequence[str], feet: Sequence[str]) -> None:
        n_joints = len(body.joints)
        local = np.zeros(n_joints, dtype=bool)
        for joint, parent in enumerate(body.parents):
            local[joint] = body.joints[joint] in in_parent_space or (parent >= 0 and local[parent])
        stands = all(name in body.joints for name in feet)
        standing = np.array([body.joints.index(name) for name in feet] if stands else [], dtype=np.int64)
        legs = np.zeros(n_joints, dtype=bool)
        legs[standing] = True
        for joint in range(n_joints - 1, 0, -1):
            legs[body.parents[joint]] |= legs[joint]
        if (legs & local).any():
            raise ValueError("feet and all joints above them must be blended in world space")
        self._body = (body.parents, body.offsets_m, local, legs, standing)
        self._root, self._shown = np.zeros(3), np.zeros((n_joints, 4))
        self._stance = np.zeros((len(standing), 2))
        self._work = np.empty((5, n_joints, 4)), np.empty((n_joints + 3 * len(standing), 3))
        self._started = False
        self.pose = np.zeros(3 + 4 * n_joints)

    def start(self, root_m: Floats, rotations: Floats) -> None:
        """Show a pose at once: root position (3,) in metres, and rotations (J, 4) in parent space."""
        parents, offsets, local, legs, feet = self._body
        self._root[:] = root_m
        blending_kernels.to_blended_space(parents, local, rotations, self._shown)
        blending_kernels.place_feet(parents, offsets, legs, feet, self._shown, self._work[1], self._stance)
        self._started = True
        self.pose = np.append(root_m, rotations)

    @abstractmethod
    def _advance(
        self, root_m: Floats, rotations: Floats, before_root_m: Floats, before_rotations: Floats, out: Floats
    ) -> None:
        """Write the next frame to ``out`` (3 + 4 J,)."""

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
            return self.pose
        out = np.empty(len(self.pose))
        self._advance(root_m, rotations, before_root_m, before_rotations, out)
        self.pose = out
        return out

    def steps(self, desired: Poses, before: Poses) -> Poses:
        """Return the frames of all steps through T desired poses, as ``step`` does for each of them."""
        frames = [
            self.step(*frame)
            for frame in zip(desired.root_m, desired.rotations, before.root_m, before.rotations, strict=True)
        ]
        return Poses.from_frames(np.array(frames).reshape(-1, len(self.pose)))


class Blender(Stepper):
    """A body that follows desired motion at the speed of its recording (Levine 2009, 5.5).

    Parameters
    ----------
    body : the body that moves.
    in_parent_space : joints that are blended in parent space, with all joints below them; names that the body does
        not have are ignored. All others are blended in world space.
    together : joints that cover the same share of their gaps, and the height of the root with them; names that the
        body does not have are ignored. If empty, every joint follows the printed formula by itself.
    feet : joints that stand on the floor; if the body does not have all of them, or if empty, the position of the
        root is blended like its height.
    """

    def __init__(
        self,
        body: Body,
        in_parent_space: Sequence[str] = PARENT_SPACE,
        together: Sequence[str] = LOWER_BODY,
        feet: Sequence[str] = FEET,
    ) -> None:
        super().__init__(body, in_parent_space, feet)
        reach = np.zeros(len(body.joints))
        for joint, parent in enumerate(body.parents):
            reach[joint] = reach[parent] + np.linalg.norm(body.offsets_m[joint]) if parent >= 0 else 0.0
        group = np.array([name in together for name in body.joints]) & ~self._body[2]
        longest = float(reach[group].max(initial=0.0))
        # A distance of the root counts as the angle that moves the end of the longest limb by it.
        self._group = (group, 1.0 / longest if longest > 0.0 else 0.0)

    def _advance(
        self, root_m: Floats, rotations: Floats, before_root_m: Floats, before_rotations: Floats, out: Floats
    ) -> None:
        blending_kernels.blend(
            *self._body, *self._group, self._root, self._shown, self._stance, *self._work,
            root_m, rotations, before_root_m, before_rotations, out,
        )  # fmt: skip


class Transitions(Stepper):
    """A body that follows desired motion, with smooth transitions where a recording takes over.

    Parameters
    ----------
    body : the body that moves.
    fps : frames per second.
    duration_s : duration of a transition.
    in_parent_space, feet : see ``Blender``.
    arms : joints that keep the speed of the recording instead; names that the body does not have are ignored.
    """

    def __init__(
        self,
        body: Body,
        fps: float,
        duration_s: float = TRANSITION_S,
        in_parent_space: Sequence[str] = PARENT_SPACE,
        feet: Sequence[str] = FEET,
        arms: Sequence[str] = ARMS,
    ) -> None:
        super().__init__(body, in_parent_space, feet)
        self._arms = np.array([name in arms for name in body.joints])
        n_joints = len(body.joints)
        keep = (float(np.exp(-1.0 / (constant_s * fps))) for constant_s in (CATCH_UP_S, ARM_CATCH_UP_S))
        self._pace = (max(duration_s * fps, 1.0), max(min(duration_s, SWING_S) * fps, 1.0), *keep)
        self._last = np.zeros(3), np.zeros((n_joints, 4))
        self._wanted = np.zeros(3), np.zeros((n_joints, 4))
        self._gap = np.zeros((n_joints + 1, 3)), np.zeros((n_joints + 1, 3)), np.zeros(n_joints + 1, dtype=np.int64)
        self._drive = np.zeros((2, 2))

    def start(self, root_m: Floats, rotations: Floats) -> None:
        """Show a pose at once: root position (3,) in metres, and rotations (J, 4) in parent space."""
        super().start(root_m, rotations)
        for known in (self._last, self._wanted):
            known[0][:], known[1][:] = self._root, self._shown
        for one in (*self._gap, self._drive):
            one[:] = 0
        self._gap[2][:] = 1

    def _advance(
        self, root_m: Floats, rotations: Floats, before_root_m: Floats, before_rotations: Floats, out: Floats
    ) -> None:
        blending_kernels.transit(
            *self._body, self._arms, *self._pace, self._root, self._shown, self._stance, *self._work, *self._last,
            *self._wanted, *self._gap, self._drive, root_m, rotations, before_root_m, before_rotations, out,
        )  # fmt: skip
