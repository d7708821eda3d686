"""The pose of the head: least-squares fit to what both cameras see, and consensus of random samples.

A pose takes the points of the reference frame to those of the current one (4.2). Where the depth of a point comes
from disparity it is ten times less accurate than its position in the image. A fit in the image weighs both as they
deserve, and needs no disparity of every point; the fit in space of Sargin 2006 does not, but is linear.

Reference: M. A. Fischler and R. C. Bolles, Random sample consensus, Communications of the ACM 24, 1981.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.data.rng import random_source
from cospeech.geometry import newton_rotation, rigid
from cospeech.geometry.cholesky import solve_in_place
from cospeech.kernels.jit import njit

DISPARITY_WEIGHT = 0.5
"""Weight of a disparity relative to a position in the image, whose standard deviation is about half as large."""

SAMPLES, SAMPLE_SIZE = 64, 4
SAMPLE_STEPS, FIT_STEPS = 5, 6
"""Number of random samples and of the points in each; Gauss-Newton steps for a sample and for all inliers."""

ROUNDS = 3
"""Number of times that the inliers are chosen again, each time by the fit to the previous ones."""


class RigidFit(Enum):
    """How the pose follows from the points that agree.

    ``REPROJECTION`` fits their positions in the images; the others fit the points in space: ``SVD`` in closed form,
    ``NEWTON`` and ``NEWTON_PRINTED`` by appendix B of Sargin 2006, corrected and as printed.
    """

    REPROJECTION = "reprojection"
    SVD = "svd"
    NEWTON = "newton"
    NEWTON_PRINTED = "newton_printed"


@dataclass(frozen=True)
class Pose:
    """A rigid motion that takes a point P to R P + t.

    Attributes
    ----------
    rotation : R, (3, 3). shift_m : t, (3,).
    """

    rotation: Floats
    shift_m: Floats

    def points(self, points_m: Floats) -> Floats:
        """Return points (..., 3) after the motion."""
        return points_m @ self.rotation.T + self.shift_m

    def after(self, first: Pose) -> Pose:
        """Return the motion that does ``first`` and then this one."""
        return Pose(self.rotation @ first.rotation, self.rotation @ first.shift_m + self.shift_m)


STILL = Pose(np.eye(3), np.zeros(3))


def fit_in_space(source_m: Floats, target_m: Floats, method: RigidFit) -> Pose:
    """Return the pose that takes points (n, 3) to others with the least sum of squared distances.

    The printed translation (B.2) lacks the rotation of the mean and is not used, as it would put the head metres off.
    """
    if method is RigidFit.SVD:
        rotation = rigid.align(source_m, target_m[None])[0][0]
    else:
        variant = newton_rotation.Variant("printed" if method is RigidFit.NEWTON_PRINTED else "corrected")
        rotation = newton_rotation.newton_rotation(source_m, target_m, variant).rotation
    return Pose(rotation, target_m.mean(axis=0) - rotation @ source_m.mean(axis=0))


def consensus(
    points_m: Floats, seen: Floats, optics: Floats, expected: Pose, threshold_px: float
) -> tuple[Pose, Flags]:
    """Return the pose that most points agree on, fitted in the image, and which (n,) they are.

    Parameters
    ----------
    points_m : (n, 3) points of the reference frame, n at least ``SAMPLE_SIZE``.
    seen : (n, 3) where they are now: x, y and disparity, in pixels; the disparity may be NaN.
    optics : (6,) numbers of the optics.
    expected : where the search starts, such as the pose of the previous frame.
    threshold_px : largest distance between where a point is and where the pose puts it.
    """
    middle = points_m.mean(axis=0)
    centred = points_m - middle
    start = np.ascontiguousarray(expected.rotation), expected.points(middle)
    chosen = np.floor(_draws() * len(points_m)).astype(np.int64)
    rotation, place = _best_sample(centred, seen, optics, *start, chosen, SAMPLE_STEPS, threshold_px)
    agreeing = _agreeing(centred, seen, optics, rotation, place, threshold_px)
    for _ in range(ROUNDS):
        if agreeing.sum() < SAMPLE_SIZE:
            break
        rotation, place = _fit(centred[agreeing], seen[agreeing], optics, rotation, place, FIT_STEPS)
        before, agreeing = agreeing, _agreeing(centred, seen, optics, rotation, place, threshold_px)
        if (agreeing == before).all():
            break
    return Pose(rotation, place - rotation @ middle), agreeing


_DRAWN: list[Floats] = []


def _draws() -> Floats:
    """Return the random numbers (samples, points) that select the points of the samples, the same in every frame."""
    if not _DRAWN:
        _DRAWN.append(random_source(0, "head", "consensus").random((SAMPLES, SAMPLE_SIZE)))
    return _DRAWN[0]


@njit
def _best_sample(
    points: Floats, seen: Floats, optics: Floats, rotation: Floats, place: Floats, chosen: Integers, steps: int,
    threshold: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the fit to one of the samples ``chosen`` (samples, points) that most points agree with.

    The number of steps is an argument because ``_fit`` would be compiled once more for a constant.
    """
    best_rotation, best_place = rotation, place
    best = int(_agreeing(points, seen, optics, rotation, place, threshold).sum())
    for sample in range(len(chosen)):
        own = chosen[sample]
        tried_rotation, tried_place = _fit(points[own], seen[own], optics, rotation, place, steps)
        count = int(_agreeing(points, seen, optics, tried_rotation, tried_place, threshold).sum())
        if count > best:
            best, best_rotation, best_place = count, tried_rotation, tried_place
    return best_rotation, best_place


@njit
def _project(point: Floats, optics: Floats) -> tuple[float, float, float]:
    """Return x, y and disparity of a point, in pixels."""
    depth = max(-point[2], 1e-6)
    x = optics[2] + optics[0] * point[0] / depth
    y = optics[3] - optics[1] * point[1] / depth
    return x, y, optics[0] * optics[4] / depth + optics[5]


@njit
def _agreeing(
    points: Floats, seen: Floats, optics: Floats, rotation: Floats, place: Floats, threshold: float
) -> Flags:
    """Return which points (n,) are where the pose puts them."""
    agree = np.zeros(len(points), dtype=np.bool_)
    for n in range(len(points)):
        x, y, disparity = _project(rotation @ points[n] + place, optics)
        square = (x - seen[n, 0]) ** 2 + (y - seen[n, 1]) ** 2
        if np.isfinite(seen[n, 2]):
            square += (DISPARITY_WEIGHT * (disparity - seen[n, 2])) ** 2
        agree[n] = square <= threshold * threshold
    return agree


@njit
def _fit(
    points: Floats, seen: Floats, optics: Floats, rotation: Floats, place: Floats, steps: int
) -> tuple[Floats, Floats]:
    """Return rotation (3, 3) and place (3,) of the mean after ``steps`` Gauss-Newton steps on the weighted squares.

    A step turns the points about the mean by a small vector and shifts them, six unknowns.
    """
    slopes = np.zeros((3, 6))
    for _ in range(steps):
        matrix, vector = 1e-9 * np.eye(6), np.zeros((6, 1))
        for n in range(len(points)):
            arm = rotation @ points[n]
            point = arm + place
            depth = max(-point[2], 1e-6)
            x, y, disparity = _project(point, optics)
            fx, fy = optics[0] / depth, -optics[1] / depth
            # With depth = -z, d (x / depth) / d z = x / depth^2.
            slopes[0, 3], slopes[0, 4], slopes[0, 5] = fx, 0.0, fx * point[0] / depth
            slopes[1, 3], slopes[1, 4], slopes[1, 5] = 0.0, fy, fy * point[1] / depth
            slopes[2, 3], slopes[2, 4], slopes[2, 5] = 0.0, 0.0, fx * optics[4] / depth
            for row in range(3):
                a, b, c = slopes[row, 3], slopes[row, 4], slopes[row, 5]
                slopes[row, 0] = c * arm[1] - b * arm[2]
                slopes[row, 1] = a * arm[2] - c * arm[0]
                slopes[row, 2] = b * arm[0] - a * arm[1]
            for row in range(3):
                if row == 0:
                    off, weight = seen[n, 0] - x, 1.0
                elif row == 1:
                    off, weight = seen[n, 1] - y, 1.0
                else:
                    off, weight = seen[n, 2] - disparity, DISPARITY_WEIGHT * DISPARITY_WEIGHT
                if not np.isfinite(off):
                    continue
                for i in range(6):
                    vector[i, 0] += weight * slopes[row, i] * off
                    for j in range(6):
                        matrix[i, j] += weight * slopes[row, i] * slopes[row, j]
        for i in range(6):
            matrix[i, i] *= 1.0 + 1e-6
        solve_in_place(matrix, vector)
        step = vector[:, 0].copy()
        length = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        if length > 0.5:
            step *= 0.5 / length
        rotation = _turn(step[:3]) @ rotation
        place = place + step[3:]
    return rotation, place


@njit
def _turn(vector: Floats) -> Floats:
    """Return the matrix of a rotation vector (Rodrigues' formula)."""
    angle = np.sqrt((vector * vector).sum())
    cross = np.array([[0.0, -vector[2], vector[1]], [vector[2], 0.0, -vector[0]], [-vector[1], vector[0], 0.0]])
    if angle < 1e-9:
        return np.eye(3) + cross
    return np.eye(3) + np.sin(angle) / angle * cross + (1.0 - np.cos(angle)) / (angle * angle) * (cross @ cross)
