"""Bundle adjustment: the cameras and points that minimise the reprojection error.

Levenberg-Marquardt on the sum of squared pixel distances, with the points eliminated from the normal equations by the
Schur complement (B. Triggs et al., Bundle adjustment: a modern synthesis, 1999, section 6.1). A camera consists of a
row of intrinsic parameters (``INNER``), a rotation and a translation; rotations are updated by a small rotation from
the left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import from_vectors, to_vectors
from cospeech.kernels.jit import njit

Linear = tuple[Floats, Floats, Floats]
"""Residuals (M, 2) and their derivatives with respect to camera (M, 2, 15) and point or body (M, 2, B)."""

INNER = ("focal", "aspect", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Intrinsic parameters: fx, fy / fx, principal point and distortion coefficients."""
POSE = ("turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z")
N_INNER = len(INNER)
N_ALL = N_INNER + len(POSE)

SELF = ("focal", "cx", "cy", "k1", "k2")
"""The intrinsic parameters that a cloud of points determines, as in self-calibration."""


@dataclass(frozen=True)
class Rig:
    """Cameras as arrays: intrinsics ``inner`` (C, 9); ``rotations`` (C, 3, 3), ``shifts`` (C, 3), world to camera."""

    inner: Floats
    rotations: Floats
    shifts: Floats


def from_cameras(cameras: Sequence[Camera]) -> Rig:
    """Return the cameras as arrays."""
    inner = [(c.focal_px[0], c.focal_px[1] / c.focal_px[0], *c.centre_px, *c.lens) for c in cameras]
    return Rig(
        np.array(inner),
        np.array([c.rotation for c in cameras]),
        np.array([c.shift_m for c in cameras], dtype=float),
    )


def to_cameras(rig: Rig, like: Sequence[Camera]) -> list[Camera]:
    """Return the arrays as cameras with the names and image sizes of ``like``."""
    cameras = []
    for camera, inner, rotation, shift in zip(like, rig.inner, rig.rotations, rig.shifts, strict=True):
        focal, aspect, cx, cy, k1, k2, p1, p2, k3 = inner.tolist()
        turn = to_vectors(rotation).tolist()
        cameras.append(
            replace(
                camera, focal_px=(focal, focal * aspect), centre_px=(cx, cy), lens=(k1, k2, p1, p2, k3),
                turn=tuple(turn), shift_m=tuple(shift.tolist()),
            )
        )  # fmt: skip
    return cameras


@njit
def observe(
    inner: Floats, rotation: Floats, shift: Floats, point: Floats, pixel: Floats, by_camera: Floats, by_point: Floats
) -> bool:
    """Project a point (3,) and write its pixel (2,) and derivatives with respect to camera (2, 15) and point (2, 3).

    Returns whether the point lies in front of the camera; if it does not, nothing is written.
    """
    turned = rotation @ point
    place = turned + shift
    if place[2] < 1e-6:
        return False
    focal, aspect, cx, cy, k1, k2, p1, p2, k3 = inner
    x, y, depth = place[0] / place[2], place[1] / place[2], place[2]
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    slope = 2.0 * (k1 + square * (2.0 * k2 + 3.0 * square * k3))
    bent = np.array(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    )
    scale = np.array([focal, focal * aspect])
    pixel[0], pixel[1] = scale[0] * bent[0] + cx, scale[1] * bent[1] + cy
    cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    by_flat = np.array(
        [
            [radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, cross],
            [cross, radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x],
        ]
    )
    by_camera[0, 0], by_camera[1, 0] = bent[0], aspect * bent[1]
    by_camera[0, 1], by_camera[1, 1] = 0.0, focal * bent[1]
    by_camera[0, 2], by_camera[1, 2] = 1.0, 0.0
    by_camera[0, 3], by_camera[1, 3] = 0.0, 1.0
    lens = np.array(
        [
            [x * square, x * square**2, 2.0 * x * y, square + 2.0 * x * x, x * square**3],
            [y * square, y * square**2, square + 2.0 * y * y, 2.0 * x * y, y * square**3],
        ]
    )
    for k in range(2):
        for m in range(5):
            by_camera[k, 4 + m] = scale[k] * lens[k, m]
        a, b = scale[k] * by_flat[k, 0] / depth, scale[k] * by_flat[k, 1] / depth
        c = -a * x - b * y
        by_camera[k, 9] = c * turned[1] - b * turned[2]
        by_camera[k, 10] = a * turned[2] - c * turned[0]
        by_camera[k, 11] = b * turned[0] - a * turned[1]
        by_camera[k, 12], by_camera[k, 13], by_camera[k, 14] = a, b, c
        for m in range(3):
            by_point[k, m] = a * rotation[0, m] + b * rotation[1, m] + c * rotation[2, m]
    return True


@njit
def _linearise(
    inner: Floats,
    rotations: Floats,
    shifts: Floats,
    points: Floats,
    views: Integers,
    owners: Integers,
    pixels: Floats,
) -> tuple[Floats, Floats, Floats]:
    """Return residuals (M, 2), infinite for points behind the camera, and derivatives (M, 2, 15) and (M, 2, 3)."""
    residuals = np.empty((len(views), 2))
    by_camera = np.zeros((len(views), 2, N_ALL))
    by_point = np.zeros((len(views), 2, 3))
    pixel = np.empty(2)
    for m in range(len(views)):
        c = views[m]
        if observe(inner[c], rotations[c], shifts[c], points[owners[m]], pixel, by_camera[m], by_point[m]):
            residuals[m] = pixel - pixels[m]
        else:
            residuals[m] = np.inf
    return residuals, by_camera, by_point


@njit
def _eliminate(
    residuals: Floats,
    by_camera: Floats,
    by_point: Floats,
    views: Integers,
    starts: Integers,
    n_views: int,
    damping: float,
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the reduced normal equations of the cameras, and what back-substitution of the points needs.

    ``by_camera`` (M, 2, F) holds the free parameters only; the observations of point n are ``starts[n]:starts[n+1]``.
    A point has B = 3 parameters; rigid bodies with B = 6 parameters may take the place of points.
    """
    n_free, n_own = by_camera.shape[2], by_point.shape[2]
    n_points = len(starts) - 1
    matrix = np.zeros((n_views, n_free, n_views, n_free))
    diagonal = np.zeros((n_views, n_free))
    right = np.zeros((n_views, n_free))
    inverses = np.empty((n_points, n_own, n_own))
    gradients = np.zeros((n_points, n_own))
    for n in range(n_points):
        block = np.zeros((n_own, n_own))
        mixed, seen = np.zeros((n_views, n_free, n_own)), np.zeros(n_views, dtype=np.bool_)
        for m in range(starts[n], starts[n + 1]):
            block += by_point[m].T @ by_point[m]
            gradients[n] += by_point[m].T @ residuals[m]
            mixed[views[m]] += by_camera[m].T @ by_point[m]
            seen[views[m]] = True
        for k in range(n_own):
            block[k, k] *= 1.0 + damping
            block[k, k] += 1e-12
        inverses[n] = np.linalg.inv(block)
        for m in range(starts[n], starts[n + 1]):
            c = views[m]
            own = by_camera[m].T @ by_camera[m]
            matrix[c, :, c, :] += own
            diagonal[c] += np.diag(own)
            right[c] += by_camera[m].T @ residuals[m]
        for c in np.flatnonzero(seen):
            weighted = mixed[c] @ inverses[n]
            right[c] -= weighted @ gradients[n]
            for other in np.flatnonzero(seen):
                matrix[c, :, other, :] -= weighted @ mixed[other].T
    size = n_views * n_free
    return matrix.reshape(size, size), diagonal.reshape(size), right.reshape(size), inverses, gradients


@njit
def _point_steps(
    steps: Floats,
    mixed_by_camera: Floats,
    by_point: Floats,
    views: Integers,
    starts: Integers,
    inverses: Floats,
    gradients: Floats,
) -> Floats:
    """Return the steps (N, B) of the points that correspond to the ``steps`` (C, F) of the cameras."""
    moved = np.empty((len(starts) - 1, by_point.shape[2]))
    for n in range(len(moved)):
        pull = gradients[n].copy()
        for m in range(starts[n], starts[n + 1]):
            pull += by_point[m].T @ (mixed_by_camera[m] @ steps[views[m]])
        moved[n] = -inverses[n] @ pull
    return moved


def adjust(
    rig: Rig,
    points: Floats,
    observations: Floats,
    used: Flags,
    *,
    free: Sequence[str] = SELF,
    prior: tuple[Floats, Floats] | None = None,
    iterations: int = 50,
) -> tuple[Rig, Floats]:
    """Return the rig and the points (N, 3) that fit the used observations best.

    Parameters
    ----------
    rig, points : initial estimate; NaN for points without used observations.
    observations : pixels (C, N, 2).
    used : mask (C, N) of the observations to fit; a point has at least two of them, or none.
    free : the parameters of ``INNER`` to optimise; poses are always optimised.
    prior : values and weights (px^2 per unit^2), each (C, 9): adds the sum of weight * (inner - value)^2 to the cost.
    """
    owners, views = np.nonzero(used.T)
    kept, owners = np.unique(owners, return_inverse=True)
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=0)[kept])])
    pixels = np.ascontiguousarray(observations[:, kept][views, owners])

    def linearise(rig: Rig, places: Floats) -> Linear:
        return _linearise(rig.inner, rig.rotations, rig.shifts, places, views, owners, pixels)

    start = np.ascontiguousarray(points[kept])
    rig, places = _minimise(rig, start, linearise, np.add, views, starts, free, prior, iterations)
    adjusted = np.full_like(points, np.nan)
    adjusted[kept] = places
    return rig, adjusted


def adjust_bodies(
    rig: Rig,
    poses: Floats,
    shape: Floats,
    observations: Floats,
    used: Flags,
    *,
    free: Sequence[str] = SELF,
    prior: tuple[Floats, Floats] | None = None,
    iterations: int = 50,
) -> tuple[Rig, Floats]:
    """Return the rig and the poses (T, 3, 4) of a rigid body that fit the used observations of its points best.

    Parameters
    ----------
    rig, poses : initial estimate, [R | t] from body to world; NaN for poses without used observations.
    shape : the points (K, 3) of the body.
    observations : pixels (C, T, K, 2).
    used : mask (C, T, K) of the observations to fit; a pose has at least three points in one view, or none.
    free, prior, iterations : as in ``adjust``.
    """
    owners, views, parts = np.nonzero(np.moveaxis(used, 0, 1))
    kept, owners = np.unique(owners, return_inverse=True)
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=(0, 2))[kept])])
    pixels = np.ascontiguousarray(observations[:, kept][views, owners, parts])
    each = np.arange(len(views))

    def linearise(rig: Rig, poses: Floats) -> Linear:
        turned = (poses[owners, :, :3] @ shape[parts][:, :, None])[:, :, 0]
        places = turned + poses[owners, :, 3]
        residuals, by_camera, by_point = _linearise(rig.inner, rig.rotations, rig.shifts, places, views, each, pixels)
        by_turn = np.cross(turned[:, None], by_point)  # a small rotation w from the left moves a point by w x turned
        return residuals, by_camera, np.concatenate([by_turn, by_point], axis=2)

    def moved(poses: Floats, steps: Floats) -> Floats:
        turns = from_vectors(steps[:, :3])
        return np.concatenate([turns @ poses[:, :, :3], poses[:, :, 3:] + steps[:, 3:, None]], axis=2)

    rig, fitted = _minimise(rig, poses[kept], linearise, moved, views, starts, free, prior, iterations)
    adjusted = np.full_like(poses, np.nan)
    adjusted[kept] = fitted
    return rig, adjusted


def _minimise(
    rig: Rig,
    state: Floats,
    linearise: Callable[[Rig, Floats], Linear],
    moved: Callable[[Floats, Floats], Floats],
    views: Integers,
    starts: Integers,
    free: Sequence[str],
    prior: tuple[Floats, Floats] | None,
    iterations: int,
) -> tuple[Rig, Floats]:
    """Return the rig and the state (N points or bodies) with the least sum of squares.

    ``linearise`` returns the residuals and derivatives at a rig and state; ``moved`` applies steps (N, B) to a state.
    """
    values, weights = prior if prior is not None else (rig.inner, np.zeros_like(rig.inner))
    columns = np.array([INNER.index(name) for name in free] + list(range(N_INNER, N_ALL)))
    inside = columns[: len(free)]

    def measure(rig: Rig, state: Floats) -> tuple[float, Linear]:
        linear = linearise(rig, state)
        pull = weights[:, inside] * (rig.inner - values)[:, inside] ** 2
        return float((linear[0] ** 2).sum() + pull.sum()), linear

    cost, (residuals, by_camera, by_point) = measure(rig, state)
    damping = 1e-3
    for _ in range(iterations):
        chosen = np.ascontiguousarray(by_camera[:, :, columns])
        matrix, diagonal, right, inverses, gradients = _eliminate(
            residuals, chosen, by_point, views, starts, len(rig.inner), damping
        )
        pulls = np.zeros((len(rig.inner), len(columns)))
        pulls[:, : len(free)] = weights[:, inside]
        right = right.reshape(pulls.shape).copy()
        right[:, : len(free)] += pulls[:, : len(free)] * (rig.inner - values)[:, inside]
        np.fill_diagonal(matrix, matrix.diagonal() + pulls.ravel() + damping * (diagonal + pulls.ravel()) + 1e-12)
        steps = -np.asarray(np.linalg.solve(matrix, right.ravel()), dtype=np.float64).reshape(pulls.shape)
        tried = _moved(rig, steps, inside)
        tried_state = moved(state, _point_steps(steps, chosen, by_point, views, starts, inverses, gradients))
        tried_cost, linear = measure(tried, tried_state)
        if not tried_cost < cost:
            damping *= 10.0
            if damping > 1e8:
                break
            continue
        settled = cost - tried_cost < 1e-9 * cost
        rig, state, cost = tried, tried_state, tried_cost
        residuals, by_camera, by_point = linear
        damping = max(damping / 10.0, 1e-9)
        if settled:
            break
    return rig, state


def _moved(rig: Rig, steps: Floats, inside: Integers) -> Rig:
    inner = rig.inner.copy()
    inner[:, inside] += steps[:, : len(inside)]
    turns = from_vectors(steps[:, len(inside) : len(inside) + 3])
    return Rig(inner, turns @ rig.rotations, rig.shifts + steps[:, len(inside) + 3 :])


def residuals(rig: Rig, points: Floats, observations: Floats) -> Floats:
    """Return the reprojection errors (C, N) in pixels of points (N, 3); NaN where point or observation is missing."""
    seen = ~np.isnan(observations[..., 0]) & ~np.isnan(points[:, 0])
    owners, views = np.nonzero(seen.T)
    pixels = np.ascontiguousarray(observations[views, owners])
    apart, _, _ = _linearise(
        rig.inner, rig.rotations, rig.shifts, np.ascontiguousarray(points), views, owners, pixels
    )
    distances = np.full(seen.shape, np.nan)
    distances[views, owners] = np.hypot(apart[:, 0], apart[:, 1])
    return distances
