"""Compiled parts of blending; ``blending`` is their interface.

Notation: a body of J joints, with F feet. Rotations are unit quaternions w, x, y, z. Those that are blended are in
world space, except for joints marked in ``in_parent_space``.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit

SAME = 1e-12
"""Two unit quaternions describe the same rotation if their scalar product is closer to 1 than this."""

NEAR = 1e-9
"""A gap that exceeds the speed by less than this, in radians, is closed: they are equal but for rounding."""


@njit
def multiply(a: Floats, b: Floats, product: Floats) -> None:
    """Write the product of two quaternions to ``product``, which may be one of them."""
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
def to_blended_space(parents: Integers, in_parent_space: Flags, rotations: Floats, world: Floats) -> None:
    """Write rotations (J, 4) to ``world``, in world space except for those of ``in_parent_space``."""
    for joint in range(len(parents)):
        if parents[joint] < 0 or in_parent_space[joint]:
            world[joint] = rotations[joint]
        else:
            multiply(world[parents[joint]], rotations[joint], world[joint])


@njit
def _turn(shown: Floats, turn: Floats, angle: float) -> None:
    """Turn the quaternion ``shown`` by ``angle`` about the axis of the quaternion ``turn``, which is overwritten."""
    half = 0.5 * angle
    scale = np.sin(half) / np.sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
    turn[0] = np.cos(half)
    for axis in range(1, 4):
        turn[axis] *= scale
    multiply(shown, turn, shown)
    norm = 1.0 / np.sqrt(shown[0] ** 2 + shown[1] ** 2 + shown[2] ** 2 + shown[3] ** 2)
    for axis in range(4):
        shown[axis] *= norm


@njit
def _share(squared_speed: float, squared_gap: float) -> float:
    """Return the share of a gap that is covered in one frame, at most 1."""
    return np.sqrt(squared_speed / squared_gap) if squared_gap > squared_speed else 1.0


@njit
def place_feet(
    parents: Integers, offsets: Floats, legs: Flags, feet: Integers, rotations: Floats, places: Floats, found: Floats
) -> None:
    """Write the horizontal positions of the feet relative to the root to ``found`` (F, 2).

    Parameters
    ----------
    legs : (J,) whether a joint is a foot or above one. All of them are in world space.
    places : working memory (J, 3).
    """
    for joint in range(len(parents)):
        if not legs[joint]:
            continue
        if parents[joint] < 0:
            places[joint] = 0.0
            continue
        q, v, above = rotations[parents[joint]], offsets[joint], places[parents[joint]]
        # v + 2 w (u x v) + 2 u x (u x v) for the quaternion (w, u)
        a = q[2] * v[2] - q[3] * v[1] + q[0] * v[0]
        b = q[3] * v[0] - q[1] * v[2] + q[0] * v[1]
        c = q[1] * v[1] - q[2] * v[0] + q[0] * v[2]
        places[joint, 0] = above[0] + v[0] + 2.0 * (q[2] * c - q[3] * b)
        places[joint, 1] = above[1] + v[1] + 2.0 * (q[3] * a - q[1] * c)
        places[joint, 2] = above[2] + v[2] + 2.0 * (q[1] * b - q[2] * a)
    for foot in range(len(feet)):
        found[foot, 0], found[foot, 1] = places[feet[foot], 0], places[feet[foot], 2]


@njit
def _stand(
    parents: Integers,
    offsets: Floats,
    legs: Flags,
    feet: Integers,
    wanted: Floats,
    source: Floats,
    shown: Floats,
    desired_root: Floats,
    before_root: Floats,
    shown_root: Floats,
    stance: Floats,
    work: Floats,
    move: Floats,
) -> None:
    """Write the horizontal displacement of the body that lets its feet move as those of the recording to ``move``.

    Parameters
    ----------
    wanted, source : desired pose and the one before it in its recording.
    shown : the pose to show; ``shown_root`` is still the position of the last frame.
    stance : (F, 2) positions of the feet relative to the root in the last frame, replaced by those in this one.
    work : working memory (J + 3 F, 3).
    """
    n_feet = len(feet)
    places = work[: len(parents)]
    new = work[len(parents) : len(parents) + n_feet, :2]
    step = work[len(parents) + n_feet : len(parents) + 2 * n_feet]  # x, z, length
    old = work[len(parents) + 2 * n_feet :, :2]
    place_feet(parents, offsets, legs, feet, wanted, places, new)
    place_feet(parents, offsets, legs, feet, source, places, old)
    mean, slowest = 0.0, np.inf
    for foot in range(n_feet):
        step[foot, 0] = new[foot, 0] - old[foot, 0] + desired_root[0] - before_root[0]
        step[foot, 1] = new[foot, 1] - old[foot, 1] + desired_root[2] - before_root[2]
        step[foot, 2] = np.sqrt(step[foot, 0] ** 2 + step[foot, 1] ** 2)
        mean += step[foot, 2] / n_feet
        slowest = min(slowest, step[foot, 2])
    place_feet(parents, offsets, legs, feet, shown, places, new)
    total = 0.0
    move[0], move[1] = 0.0, 0.0
    for foot in range(n_feet):
        weight = 1.0 / (step[foot, 2] + mean + 1e-9)
        total += weight
        for axis in range(2):
            move[axis] += weight * (step[foot, axis] - new[foot, axis] + stance[foot, axis])
            stance[foot, axis] = new[foot, axis]
    x = desired_root[0] - shown_root[0] - move[0] / total
    z = desired_root[2] - shown_root[2] - move[1] / total
    gap = np.sqrt(x * x + z * z)
    share = slowest / gap if gap > slowest else 1.0
    move[0], move[1] = move[0] / total + share * x, move[1] / total + share * z


@njit
def _write(parents: Integers, in_parent_space: Flags, root: Floats, shown: Floats, out: Floats) -> None:
    """Write a pose as a frame (3 + 4 J,): root position, and the rotation of each joint in parent space."""
    for axis in range(3):
        out[axis] = root[axis]
    turn = np.empty(4)
    for joint in range(len(parents)):
        place = out[3 + 4 * joint : 7 + 4 * joint]
        if parents[joint] < 0 or in_parent_space[joint]:
            place[:] = shown[joint]
        else:
            above = shown[parents[joint]]
            turn[0], turn[1], turn[2], turn[3] = above[0], -above[1], -above[2], -above[3]
            multiply(turn, shown[joint], place)


@njit
def blend(
    parents: Integers,
    offsets: Floats,
    in_parent_space: Flags,
    legs: Flags,
    feet: Integers,
    together: Flags,
    root_weight: float,
    shown_root: Floats,
    shown: Floats,
    stance: Floats,
    work: Floats,
    places: Floats,
    desired_root: Floats,
    desired: Floats,
    before_root: Floats,
    before: Floats,
    out: Floats,
) -> None:
    """Blend one frame; see ``Blender``. ``work`` is working memory (5, J, 4), ``out`` the result (3 + 4 J,)."""
    n_joints = len(parents)
    wanted, source, turns, speed, gap = work[0], work[1], work[2], work[3, :, 0], work[4, :, 0]
    to_blended_space(parents, in_parent_space, desired, wanted)
    to_blended_space(parents, in_parent_space, before, source)
    stands = len(feet) > 0
    root_speed, root_gap = 0.0, 0.0
    for axis in range(3):
        if axis == 1 or not stands:
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
    for joint in range(n_joints):
        angle = common * gap[joint] if together[joint] else speed[joint]
        if angle >= gap[joint]:
            shown[joint] = wanted[joint]
        elif angle > 0.0:
            _turn(shown[joint], turns[joint], angle)
    if stands:
        move = np.empty(2)
        _stand(
            parents, offsets, legs, feet, wanted, source, shown, desired_root, before_root, shown_root, stance,
            places, move,
        )  # fmt: skip
        shown_root[0] += move[0]
        shown_root[2] += move[1]
    share = common if root_weight > 0.0 else _share(root_speed, root_gap)
    for axis in range(3):
        if axis == 1 or not stands:
            if share < 1.0:
                shown_root[axis] += share * (desired_root[axis] - shown_root[axis])
            else:
                shown_root[axis] = desired_root[axis]
    _write(parents, in_parent_space, shown_root, shown, out)


@njit
def _vector(turn: Floats, angle: float, vector: Floats) -> None:
    """Write the rotation vector (3,) of the quaternion ``turn`` with this angle to ``vector``."""
    sine = np.sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
    scale = angle / sine if sine > 0.0 else 2.0
    for axis in range(3):
        vector[axis] = scale * turn[axis + 1]


@njit
def _carry_over(
    shown: Floats, last: Floats, wanted: Floats, source: Floats, work: Floats, offset: Floats, rate: Floats
) -> None:
    """Write the rotation from the recording to the shown pose, and its change per frame, as vectors (3,).

    Parameters
    ----------
    shown, last : the rotation of a joint in the last frame and in the one before it.
    wanted, source : its desired rotation, and the one before it in its recording.
    work : working memory (3, 4).
    """
    turn, ahead = work[0], work[1]
    _vector(turn, _between(source, shown, turn), offset)
    _between(last, shown, turn)
    multiply(shown, turn, ahead)  # where the joint would be if it went on turning as it does
    _vector(turn, _between(wanted, ahead, turn), rate)
    # Near half a turn, the same rotation may be nearer to the offset when it is described the other way round.
    length = np.sqrt(rate[0] ** 2 + rate[1] ** 2 + rate[2] ** 2)
    other = (length - 2.0 * np.pi) / length if length > 0.0 else 1.0
    near, far = 0.0, 0.0
    for axis in range(3):
        near += (rate[axis] - offset[axis]) ** 2
        far += (other * rate[axis] - offset[axis]) ** 2
    scale = 1.0 if near <= far else other
    for axis in range(3):
        rate[axis] = scale * rate[axis] - offset[axis]


@njit
def _chase(
    shown: Floats,
    target: Floats,
    source: Floats,
    keep: float,
    joined: bool,
    arrived: bool,
    turn: Floats,
    left: Floats,
    velocity: Floats,
) -> bool:
    """Turn a joint toward ``target`` at the speed of its recording, taking over this speed smoothly.

    Parameters
    ----------
    shown : rotation of the joint in the last frame, replaced by that in this one.
    source : the desired rotation before ``target`` in its recording.
    keep : share of a difference in velocity that is left after one frame.
    joined, arrived : whether the recording is another one than in the last frame, and whether the joint was at the
        desired rotation.
    turn : working memory (4,).
    left, velocity : (3,) what is left of a difference in velocity, and the rotation in the last frame, as vectors.

    Returns
    -------
    Whether the joint is at the desired rotation, but for what is left.
    """
    speed = _between(source, target, turn)
    gap = _between(shown, target, turn)
    arrives = gap <= speed + NEAR
    step = np.empty(3)
    _vector(turn, gap if arrives else speed, step)
    changes = joined or (arrives and not arrived)
    angle = 0.0
    for axis in range(3):
        left[axis] = velocity[axis] - step[axis] if changes else keep * left[axis]
        velocity[axis] = step[axis] + left[axis]
        turn[axis + 1] = velocity[axis]
        angle += velocity[axis] ** 2
    if angle > 0.0:
        _turn(shown, turn, np.sqrt(angle))
    return arrives


@njit
def _fade(age: float, duration: float, swing: float) -> tuple[float, float]:
    """Return what is left of an initial offset of 1, and the displacement by an initial rate of 1 per frame.

    Both are polynomials of degree five of the age in frames that begin without curvature, and end without value,
    slope and curvature: the first one after ``duration``, the second one after ``swing`` frames.
    """
    s, r = min(age / duration, 1.0), min(age / swing, 1.0)
    return 1.0 - s**3 * (10.0 - s * (15.0 - 6.0 * s)), swing * r * (1.0 - r**2 * (6.0 - r * (8.0 - 3.0 * r)))


@njit
def transit(
    parents: Integers,
    offsets: Floats,
    in_parent_space: Flags,
    legs: Flags,
    feet: Integers,
    arms: Flags,
    duration: float,
    swing: float,
    keep: float,
    arm_keep: float,
    shown_root: Floats,
    shown: Floats,
    stance: Floats,
    work: Floats,
    places: Floats,
    last_root: Floats,
    last: Floats,
    wanted_root: Floats,
    wanted: Floats,
    offset: Floats,
    rate: Floats,
    age: Integers,
    drive: Floats,
    desired_root: Floats,
    desired: Floats,
    before_root: Floats,
    before: Floats,
    out: Floats,
) -> None:
    """Show one frame; see ``blending.Transitions``.

    The last row of ``offset``, ``rate`` and ``age`` is that of the root.

    Parameters
    ----------
    duration, swing : of a transition and of what is left of the movement before it, in frames.
    keep, arm_keep : share of a difference in velocity that is left after one frame, of the body and of the arms.
    arms : (J,) joints that keep the speed of the recording (see ``_chase``, also for their rows of the arrays below).
    last_root, last : what was shown in the frame before the last.
    wanted_root, wanted : the last desired pose. A joint is joined where its recording was in another pose.
    offset, rate : (J + 1, 3) difference from the recording at the last join, and its change per frame.
    age : (J + 1,) frames since then.
    drive : (2, 2) horizontal displacement in the last frame, and that which is left of the one before the join.
    """
    n_joints = len(parents)
    target, source, scratch = work[0], work[1], work[2]
    to_blended_space(parents, in_parent_space, desired, target)
    to_blended_space(parents, in_parent_space, before, source)
    stands = len(feet) > 0
    for joint in range(n_joints):
        a, b = source[joint], wanted[joint]
        joined = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]) < 1.0 - SAME
        if arms[joint]:
            arrived = _chase(
                shown[joint], target[joint], a, arm_keep, joined, age[joint] > 0, scratch[0],
                offset[joint], rate[joint],
            )  # fmt: skip
            age[joint] = 1 if arrived else 0
            continue
        if joined:
            _carry_over(shown[joint], last[joint], target[joint], a, scratch, offset[joint], rate[joint])
            age[joint] = 0
        age[joint] += 1
        last[joint] = shown[joint]
        shown[joint] = target[joint]
        if age[joint] < duration:
            fade, ahead = _fade(age[joint], duration, swing)
            angle, turn = 0.0, scratch[0]
            for axis in range(3):
                turn[axis + 1] = fade * offset[joint, axis] + ahead * rate[joint, axis]
                angle += turn[axis + 1] ** 2
            if angle > 0.0:
                _turn(shown[joint], turn, np.sqrt(angle))
    joined = False
    for axis in range(3):
        joined |= abs(before_root[axis] - wanted_root[axis]) > SAME
    if joined:
        age[n_joints] = 0
        for axis in range(3):
            offset[n_joints, axis] = shown_root[axis] - before_root[axis]
            rate[n_joints, axis] = shown_root[axis] - last_root[axis] - (desired_root[axis] - before_root[axis])
    age[n_joints] += 1
    for axis in range(3):
        last_root[axis] = shown_root[axis]
    if stands:
        move = np.empty(2)
        _stand(
            parents, offsets, legs, feet, target, source, shown, desired_root, before_root, shown_root, stance,
            places, move,
        )  # fmt: skip
        for axis in range(2):
            drive[1, axis] = drive[0, axis] - move[axis] if joined else keep * drive[1, axis]
            drive[0, axis] = move[axis] + drive[1, axis]
            shown_root[2 * axis] += drive[0, axis]
    fade, ahead = _fade(age[n_joints], duration, swing)
    for axis in range(3):
        if axis == 1 or not stands:
            left = fade * offset[n_joints, axis] + ahead * rate[n_joints, axis]
            shown_root[axis] = desired_root[axis] + left
        wanted_root[axis] = desired_root[axis]
    wanted[:] = target
    _write(parents, in_parent_space, shown_root, shown, out)
