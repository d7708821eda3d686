"""Robust triangulation by consensus: each pair of views proposes a point, and all views of the point vote on it.

A point from two views carries the noise of both. The proposal with the most votes is therefore refined on all views
that voted for it before the votes are counted for the last time.
"""

from __future__ import annotations

import numpy as np

from cospeech.capture.calibration import bundle_adjustment
from cospeech.data.arrays import Flags, Floats
from cospeech.geometry.camera import Camera, flatten
from cospeech.kernels.jit import njit

LOOSE = 2.0
"""Distance from a proposal, in multiples of the threshold, up to which a view votes for it."""
STEPS = 2
"""Gauss-Newton steps to refine the chosen proposal."""


@njit
def _vote(
    rig: tuple[Floats, Floats, Floats], point: Floats, pixels: Floats, limit: float, near: Flags
) -> tuple[float, Floats, Floats]:
    """Fill ``near`` (C,): which views see the point within the squared distance ``limit``.

    Returns the cost over these views and its normal equations.
    """
    inner, rotations, shifts = rig
    pixel, by_camera, by_point = np.empty(2), np.empty((2, 15)), np.empty((2, 3))
    cost, square, pull = 0.0, np.zeros((3, 3)), np.zeros(3)
    for c in range(len(inner)):
        near[c] = False
        if np.isnan(pixels[c, 0]):
            continue
        if bundle_adjustment.observe(inner[c], rotations[c], shifts[c], point, pixel, by_camera, by_point):
            miss = pixel - pixels[c]
            near[c] = miss @ miss < limit
            if near[c]:
                cost += miss @ miss
                square += by_point.T @ by_point
                pull += by_point.T @ miss
    return cost, square, pull


@njit
def _meet(a: Floats, b: Floats, between: Floats) -> tuple[bool, Floats]:
    """Return whether rays ``a`` and ``b`` (3,) intersect, and the midpoint of their closest approach.

    The midpoint is relative to the origin of the first ray; ``between`` leads from there to that of the second.
    """
    aa, ab, bb = a @ a, a @ b, b @ b
    determinant = aa * bb - ab * ab
    if determinant < 1e-9 * aa * bb:
        return False, a
    along_a = (bb * (a @ between) - ab * (b @ between)) / determinant
    along_b = (ab * (a @ between) - aa * (b @ between)) / determinant
    return True, 0.5 * (along_a * a + between + along_b * b)


@njit
def _consensus(
    rig: tuple[Floats, Floats, Floats], flat: Floats, observations: Floats, threshold: float
) -> tuple[Floats, Flags]:
    _, rotations, shifts = rig
    n_views, n_points = observations.shape[:2]
    points = np.full((n_points, 3), np.nan)
    agreeing = np.zeros((n_views, n_points), dtype=np.bool_)
    places = np.empty((n_views, 3))
    for c in range(n_views):
        places[c] = -rotations[c].T @ shifts[c]
    rays, near = np.empty((n_views, 3)), np.zeros(n_views, dtype=np.bool_)
    loose = (LOOSE * threshold) ** 2
    for n in range(n_points):
        pixels = observations[:, n]
        for c in range(n_views):
            rays[c] = rotations[c].T @ np.array([flat[c, n, 0], flat[c, n, 1], 1.0])
        most, least, best = 1, np.inf, np.zeros(3)
        for i in range(n_views):
            for j in range(i + 1, n_views):
                if np.isnan(rays[i, 0]) or np.isnan(rays[j, 0]):
                    continue
                met, middle = _meet(rays[i], rays[j], places[j] - places[i])
                if not met:
                    continue
                cost, _, _ = _vote(rig, places[i] + middle, pixels, loose, near)
                count = near.sum()
                if count > most or (count == most and count > 1 and cost < least):
                    most, least, best = count, cost, places[i] + middle
        if most < 2:
            continue
        for _ in range(STEPS):
            _, square, pull = _vote(rig, best, pixels, loose, near)
            if near.sum() < 2 or abs(np.linalg.det(square)) < 1e-12:
                break
            best = best - np.linalg.solve(square, pull)
        _vote(rig, best, pixels, threshold**2, near)
        if near.sum() >= 2:
            points[n] = best
            agreeing[:, n] = near
    return points, agreeing


def triangulate(cameras: list[Camera], observations: Floats, threshold_px: float) -> tuple[Floats, Flags]:
    """Return the points (N, 3) on which the most views agree within ``threshold_px``, and the mask (C, N) of inliers.

    Points on which no two views agree are NaN.
    """
    rig = bundle_adjustment.from_cameras(cameras)
    with np.errstate(all="ignore"):  # an intermediate distortion may not be invertible: NaN, as if not observed
        flat = np.array([flatten(camera, pixels) for camera, pixels in zip(cameras, observations, strict=True)])
    return _consensus((rig.inner, rig.rotations, rig.shifts), flat, observations, threshold_px)
