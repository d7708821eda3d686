"""Inverse kinematics: in each frame, the pose of the body model that best explains the markers.

Levenberg-Marquardt (Marquardt 1963; Nocedal and Wright 2006, 10.3) on

    sum_m |x_m(q) - seen_m|^2 / tolerance_m^2  +  sum_d moved_d^2 / pace_d^2,

where a step rotates a ball joint by exp(step) in its own frame, which avoids gimbal lock, and ``moved`` is the sum of
the steps since the previous frame. The second term is a prior on the motion between frames. It hardly affects what
the markers determine, and holds still what they do not: a part whose marker is lost, or the axial rotation of a
straight arm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cospeech.capture.fitting import body_model
from cospeech.capture.fitting.body_model import BALL, FREE, HINGE_X, HINGE_Z, KINDS, PARENTS, UPRIGHT, BodyModel
from cospeech.data.arrays import Floats, Integers
from cospeech.geometry.cholesky import solve_in_place
from cospeech.kernels.jit import njit

TURN_PACE, SLIDE_PACE_M = 0.35, 0.1
"""Prior standard deviation of joint rotation (radians) and of the translation of free parts (metres) per frame."""

FIRST_FRAME_FACTOR = 100.0
"""Factor on these standard deviations for the first frame, which is relative to the static pose."""

STEPS = 60
SMALL = 1e-7
"""Maximum number of steps per frame, and the step size (radians, metres) at which to stop."""


def _degrees_of_freedom() -> tuple[Integers, Integers, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return, per degree of freedom: part (D,), axis (D,), whether it is a translation (D,), moved parts (D, P)."""
    axes = {FREE: (0, 1, 2), BALL: (0, 1, 2), HINGE_X: (0,), HINGE_Z: (2,), UPRIGHT: ()}
    freedoms = [(part, axis, False) for part, kind in enumerate(KINDS) for axis in axes[kind]]
    freedoms += [(part, axis, True) for part, kind in enumerate(KINDS) if kind == FREE for axis in range(3)]
    moves = np.zeros((len(freedoms), len(KINDS)), dtype=np.bool_)
    for d, (owner, _, slides) in enumerate(freedoms):
        for part, parent in enumerate(PARENTS):
            held = not slides and KINDS[part] == UPRIGHT
            moves[d, part] = part == owner or (parent >= 0 and moves[d, parent] and not held)
    parts, chosen, sliding = zip(*freedoms, strict=True)
    return np.array(parts), np.array(chosen), np.array(sliding), moves


PART, AXIS, SLIDES, MOVES = _degrees_of_freedom()
PACE: Floats = np.where(SLIDES, SLIDE_PACE_M, TURN_PACE)


ELBOWS: Integers = np.array([p for p, kind in enumerate(KINDS) if kind == HINGE_X and KINDS[PARENTS[p]] == BALL])

MOST_BACKWARD = np.radians(5.0)
"""Largest hyperextension of an elbow. Beyond it, the solution is an arm rotated by half a turn about its axis: the
markers on trunk, elbow and hand lie in one plane either way."""


START_BEND = np.radians(-60.0)
"""Initial flexion of the elbows in the first frame; a straight arm would leave its axial rotation undetermined."""


class Poses(NamedTuple):
    """The solution for all frames.

    Attributes
    ----------
    turns : (T, P, 3, 3) orientation of each part in the world.
    places_m : (T, P, 3) position of each part in the world, metres.
    misfit_m : (T,) RMS distance of the rigid markers from their modelled positions, metres; NaN if none is seen.
    steps : (T,) number of steps taken.
    """

    turns: Floats
    places_m: Floats
    misfit_m: Floats
    steps: Integers


def solve(model: BodyModel, seen_m: Floats) -> Poses:
    """Return the poses of ``model`` for markers ``seen_m`` (T, M, 3) in metres, NaN where lost."""
    weight = 1.0 / body_model.TOLERANCES_M
    seen_m = np.where(np.isnan(model.marker_places_m), np.nan, seen_m)  # ignore markers that are not in the model
    turns, places, steps = _solve(
        model.offsets_m, model.marker_places_m, weight, np.ascontiguousarray(seen_m),
        PARENTS, KINDS, body_model.MARKER_PART, PART, AXIS, SLIDES, MOVES, PACE, ELBOWS,
    )  # fmt: skip
    part = body_model.MARKER_PART
    modelled = places[:, part] + np.einsum("tmij,mj->tmi", turns[:, part], model.marker_places_m)
    square = ((modelled - seen_m) ** 2).sum(axis=2)[:, body_model.TOLERANCES_M == body_model.RIGID_M]
    count = (~np.isnan(square)).sum(axis=1)
    misfit = np.sqrt(np.nansum(square, axis=1) / np.where(count > 0, count, np.nan))
    return Poses(turns, places, misfit, steps)


@njit
def _place(turn, slide, offsets, parents, kinds, turns, places):  # type: ignore[no-untyped-def]
    """Forward kinematics: fill ``turns`` (P, 3, 3) and ``places`` (P, 3) in the world from the local joint states."""
    for part in range(len(parents)):
        parent = parents[part]
        if parent < 0:
            turns[part] = turn[part]
            places[part] = slide[part]
            continue
        for i in range(3):
            total = places[parent, i]
            for k in range(3):
                if kinds[part] == UPRIGHT:
                    turns[part, i, k] = 1.0 if i == k else 0.0
                else:
                    total += turns[parent, i, k] * offsets[part, k]
                    value = 0.0
                    for j in range(3):
                        value += turns[parent, i, j] * turn[part, j, k]
                    turns[part, i, k] = value
            places[part, i] = total + offsets[part, i] if kinds[part] == UPRIGHT else total


@njit
def _turn_by(turn, step):  # type: ignore[no-untyped-def]
    """Replace ``turn`` (3, 3) by turn exp(step), step (3,) in radians (Rodrigues)."""
    x, y, z = step
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return
    x, y, z = x / angle, y / angle, z / angle
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    for i in range(3):
        a, b, d = turn[i, 0], turn[i, 1], turn[i, 2]
        turn[i, 0] = a * (c + x * x * v) + b * (y * x * v + z * s) + d * (z * x * v - y * s)
        turn[i, 1] = a * (x * y * v - z * s) + b * (c + y * y * v) + d * (z * y * v + x * s)
        turn[i, 2] = a * (x * z * v + y * s) + b * (y * z * v - x * s) + d * (c + z * z * v)


@njit
def _step(turn, slide, step, part, axis, slides):  # type: ignore[no-untyped-def]
    """Move the joints by ``step`` (D,)."""
    rotation = np.zeros((len(turn), 3))
    for d in range(len(step)):
        if slides[d]:
            slide[part[d], axis[d]] += step[d]
        else:
            rotation[part[d], axis[d]] = step[d]
    for p in range(len(turn)):
        _turn_by(turn[p], rotation[p])


@njit
def _residuals(turns, places, marker_part, marker_place, weight, seen, residual):  # type: ignore[no-untyped-def]
    """Fill the weighted ``residual`` (M, 3), zero for lost markers; return its sum of squares."""
    total = 0.0
    for m in range(len(marker_part)):
        p = marker_part[m]
        for i in range(3):
            if np.isnan(seen[m, 0]):
                residual[m, i] = 0.0
                continue
            value = places[p, i] - seen[m, i]
            for k in range(3):
                value += turns[p, i, k] * marker_place[m, k]
            residual[m, i] = value * weight[m]
            total += residual[m, i] ** 2
    return total


@njit
def _jacobian(turns, places, marker_part, marker_place, weight, seen, part, axis, slides, moves, jacobian):  # type: ignore[no-untyped-def]
    """Fill ``jacobian`` (M, 3, D), the derivative of each weighted residual by each degree of freedom."""
    jacobian[:] = 0.0
    for m in range(len(marker_part)):
        if np.isnan(seen[m, 0]):
            continue
        p, w = marker_part[m], weight[m]
        x, y, z = places[p]
        for k in range(3):
            x += turns[p, 0, k] * marker_place[m, k]
            y += turns[p, 1, k] * marker_place[m, k]
            z += turns[p, 2, k] * marker_place[m, k]
        for d in range(len(part)):
            if not moves[d, p]:
                continue
            owner, a = part[d], axis[d]
            if slides[d]:
                jacobian[m, a, d] = w
                continue
            u, v, t = turns[owner, 0, a], turns[owner, 1, a], turns[owner, 2, a]
            rx, ry, rz = x - places[owner, 0], y - places[owner, 1], z - places[owner, 2]
            jacobian[m, 0, d] = w * (v * rz - t * ry)
            jacobian[m, 1, d] = w * (t * rx - u * rz)
            jacobian[m, 2, d] = w * (u * ry - v * rx)


@njit
def _normal(jacobian, residual, moves, marker_part, square, gradient):  # type: ignore[no-untyped-def]
    """Fill the lower triangle of ``square`` (D, D) with J^T J, and ``gradient`` (D,) with J^T r."""
    n = len(gradient)
    square[:] = 0.0
    gradient[:] = 0.0
    for m in range(len(marker_part)):
        p = marker_part[m]
        for d in range(n):
            if not moves[d, p]:
                continue
            a, b, c = jacobian[m, 0, d], jacobian[m, 1, d], jacobian[m, 2, d]
            gradient[d] += a * residual[m, 0] + b * residual[m, 1] + c * residual[m, 2]
            for e in range(d + 1):
                if moves[e, p]:
                    square[d, e] += a * jacobian[m, 0, e] + b * jacobian[m, 1, e] + c * jacobian[m, 2, e]


@njit
def _minimise(  # type: ignore[no-untyped-def]
    turn, slide, hold, seen, offsets, marker_place, weight, parents, kinds, marker_part, part, axis, slides, moves
):
    """Minimise the cost over the joint states ``turn`` (P, 3, 3) and ``slide`` (P, 3); return the number of steps."""
    n = len(part)
    turns, places = np.empty((len(parents), 3, 3)), np.empty((len(parents), 3))
    residual, jacobian = np.empty((len(marker_part), 3)), np.empty((len(marker_part), 3, n))
    square, damped = np.empty((n, n)), np.empty((n, n))
    gradient, step, moved = np.empty(n), np.empty(n), np.zeros(n)
    _place(turn, slide, offsets, parents, kinds, turns, places)
    cost = _residuals(turns, places, marker_part, marker_place, weight, seen, residual)
    damping, better = 1e-6, True
    count = 0
    while count < STEPS:
        count += 1
        if better:
            _jacobian(turns, places, marker_part, marker_place, weight, seen, part, axis, slides, moves, jacobian)
            _normal(jacobian, residual, moves, marker_part, square, gradient)
            for d in range(n):
                square[d, d] += hold[d]
                gradient[d] += hold[d] * moved[d]
        damped[:] = square
        for d in range(n):
            damped[d, d] += damping * square[d, d]
        step[:] = -gradient
        solve_in_place(damped, step.reshape(n, 1))
        tried_turn, tried_slide = turn.copy(), slide.copy()
        _step(tried_turn, tried_slide, step, part, axis, slides)
        _place(tried_turn, tried_slide, offsets, parents, kinds, turns, places)
        tried = _residuals(turns, places, marker_part, marker_place, weight, seen, residual)
        tried += (hold * (moved + step) ** 2).sum()
        better = tried <= cost
        if better:
            turn[:], slide[:], cost = tried_turn, tried_slide, tried
            moved += step
            damping *= 0.1
        else:
            damping = max(damping, 1e-9) * 10.0
        if np.abs(step).max() < SMALL:
            break
    return count


@njit
def _flip_backward_elbows(turn, elbows, parents):  # type: ignore[no-untyped-def]
    """Rotate each arm with a hyperextended elbow by half a turn and flex it forward; return whether there was any."""
    flipped = False
    for p in elbows:
        bend = np.arctan2(turn[p, 2, 1], turn[p, 1, 1])
        if bend > MOST_BACKWARD:
            _turn_by(turn[parents[p]], np.array([0.0, np.pi, 0.0]))
            _turn_by(turn[p], np.array([-2.0 * bend, 0.0, 0.0]))
            flipped = True
    return flipped


@njit
def _solve(  # type: ignore[no-untyped-def]
    offsets, marker_place, weight, seen, parents, kinds, marker_part, part, axis, slides, moves, pace, elbows
):
    """Return orientations (T, P, 3, 3), positions (T, P, 3) and numbers of steps (T,) for all frames."""
    n_parts = len(parents)
    turn, slide = np.zeros((n_parts, 3, 3)), offsets.copy()
    for p in range(n_parts):
        for i in range(3):
            turn[p, i, i] = 1.0
    for p in elbows:
        _turn_by(turn[p], np.array([START_BEND, 0.0, 0.0]))
    turns, places = np.empty((len(seen), n_parts, 3, 3)), np.empty((len(seen), n_parts, 3))
    counts = np.zeros(len(seen), dtype=np.int64)
    for t in range(len(seen)):
        hold = 1.0 / (pace * (FIRST_FRAME_FACTOR if t == 0 else 1.0)) ** 2
        for again in range(2):
            if again and not _flip_backward_elbows(turn, elbows, parents):
                break
            counts[t] += _minimise(
                turn, slide, hold, seen[t], offsets, marker_place, weight, parents, kinds, marker_part, part, axis,
                slides, moves,
            )  # fmt: skip
        _place(turn, slide, offsets, parents, kinds, turns[t], places[t])
    return turns, places, counts
