"""Triangulation of points from two or more views by minimal reprojection error, with rejection of outlier views.

Starting from the point nearest to all rays, the Gauss-Newton method minimises the weighted squared distance in
pixels, with distortion (Hartley and Zisserman, Multiple View Geometry, 12.5). If a view is farther from the point
than ``limit_px``, the largest consistent set of views is used, and among sets of equal size the one with the smallest
residual.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import NEWTON_STEPS, Camera
from cospeech.kernels.jit import njit

STEPS = 10
"""Maximum number of Gauss-Newton steps; three suffice if the views agree."""


def packed(cameras: Sequence[Camera]) -> Floats:
    """Return the parameters of the cameras, (C, 21), for compiled code: R, t, focal length, centre, lens."""
    return np.array([[*c.rotation.ravel(), *c.shift_m, *c.focal_px, *c.centre_px, *c.lens] for c in cameras])


@njit
def _distort(camera: Floats, u: float, v: float) -> tuple[float, float, float, float, float]:
    """Return the distorted normalised coordinates of ideal ones, and their derivatives uu, uv (= vu) and vv."""
    k1, k2, p1, p2, k3 = camera[16], camera[17], camera[18], camera[19], camera[20]
    square = u * u + v * v
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    bend = 2.0 * (k1 + square * (2.0 * k2 + 3.0 * square * k3))
    uu = radial + bend * u * u + 2.0 * p1 * v + 6.0 * p2 * u
    uv = bend * u * v + 2.0 * p1 * u + 2.0 * p2 * v
    vv = radial + bend * v * v + 6.0 * p1 * v + 2.0 * p2 * u
    bent_u = u * radial + 2.0 * p1 * u * v + p2 * (square + 2.0 * u * u)
    bent_v = v * radial + p1 * (square + 2.0 * v * v) + 2.0 * p2 * u * v
    return bent_u, bent_v, uu, uv, vv


@njit
def project_point(camera: Floats, point: Floats, slope: Floats) -> tuple[float, float, float]:
    """Return the pixel and the depth of a point (3,), and fill ``slope`` (2, 3) with the derivatives of the pixel.

    Parameters
    ----------
    camera : a row of ``packed``.
    point : (3,) in metres. If it is behind the camera, pixel and derivatives are NaN.
    slope : (2, 3) in pixels per metre.
    """
    x = camera[0] * point[0] + camera[1] * point[1] + camera[2] * point[2] + camera[9]
    y = camera[3] * point[0] + camera[4] * point[1] + camera[5] * point[2] + camera[10]
    z = camera[6] * point[0] + camera[7] * point[1] + camera[8] * point[2] + camera[11]
    if z < 1e-6:
        slope[:] = np.nan
        return np.nan, np.nan, z
    fx, fy, cx, cy = camera[12], camera[13], camera[14], camera[15]
    u, v = x / z, y / z
    bent_u, bent_v, uu, uv, vv = _distort(camera, u, v)
    for axis in range(3):
        du = (camera[axis] - u * camera[6 + axis]) / z
        dv = (camera[3 + axis] - v * camera[6 + axis]) / z
        slope[0, axis] = fx * (uu * du + uv * dv)
        slope[1, axis] = fy * (uv * du + vv * dv)
    return fx * bent_u + cx, fy * bent_v + cy, z


@njit
def flatten_pixel(camera: Floats, x: float, y: float) -> tuple[float, float]:
    """Return the ideal normalised coordinates of a pixel, as ``camera.flatten``, for a row of ``packed``."""
    bent_u, bent_v = (x - camera[14]) / camera[12], (y - camera[15]) / camera[13]
    u, v = bent_u, bent_v
    for _ in range(NEWTON_STEPS):
        found_u, found_v, a, b, d = _distort(camera, u, v)
        off_u, off_v = found_u - bent_u, found_v - bent_v
        step_u, step_v = (d * off_u - b * off_v) / (a * d - b * b), (a * off_v - b * off_u) / (a * d - b * b)
        u, v = u - step_u, v - step_v
        if max(abs(step_u), abs(step_v)) < 1e-13:
            return u, v
    return np.nan, np.nan


@njit
def _solve(normal: Floats, right: Floats) -> Floats:
    """Return the solution (3,) of a symmetric system (3, 3) by cofactors; NaN if it has none."""
    a, b, c = normal[0, 0], normal[0, 1], normal[0, 2]
    d, e, f = normal[1, 1], normal[1, 2], normal[2, 2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * A + b * B + c * C
    if abs(determinant) <= 1e-14 * abs(a * d * f):
        return np.full(3, np.nan)
    x = A * right[0] + B * right[1] + C * right[2]
    y = B * right[0] + (a * f - c * c) * right[1] + (b * c - a * e) * right[2]
    z = C * right[0] + (b * c - a * e) * right[1] + (a * d - b * b) * right[2]
    return np.array([x / determinant, y / determinant, z / determinant])


@njit
def _nearest(cameras: Floats, flat: Floats, chosen: npt.NDArray[np.bool_]) -> Floats:
    """Return the point (3,) nearest to the rays of normalised coordinates ``flat`` (C, 2) in the chosen views."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for view in range(len(cameras)):
        if not chosen[view]:
            continue
        rotation, shift = cameras[view, :9], cameras[view, 9:12]
        ray, place = np.empty(3), np.empty(3)
        for axis in range(3):
            ray[axis] = rotation[axis] * flat[view, 0] + rotation[3 + axis] * flat[view, 1] + rotation[6 + axis]
            place[axis] = -(rotation[axis] * shift[0] + rotation[3 + axis] * shift[1] + rotation[6 + axis] * shift[2])
        ray /= np.sqrt(np.sum(ray * ray))
        along = np.sum(ray * place)
        for row in range(3):
            right[row] += place[row] - along * ray[row]
            normal[row, row] += 1.0
            for column in range(3):
                normal[row, column] -= ray[row] * ray[column]
    return _solve(normal, right)


@njit
def _fit(
    cameras: Floats, pixels: Floats, flat: Floats, weights: Floats, chosen: npt.NDArray[np.bool_], misses: Floats
) -> Floats:
    """Return the point (3,) with the least weighted reprojection error in the chosen views.

    ``misses`` (C,) is filled with the error in each view, in pixels.
    """
    point = _nearest(cameras, flat, chosen)
    slope = np.empty((2, 3))
    for _ in range(STEPS):
        normal, right = np.zeros((3, 3)), np.zeros(3)
        for view in range(len(cameras)):
            if not chosen[view]:
                continue
            x, y, _ = project_point(cameras[view], point, slope)
            for row in range(3):
                right[row] += weights[view] * (
                    slope[0, row] * (pixels[view, 0] - x) + slope[1, row] * (pixels[view, 1] - y)
                )
                for column in range(3):
                    normal[row, column] += weights[view] * (
                        slope[0, row] * slope[0, column] + slope[1, row] * slope[1, column]
                    )
        step = _solve(normal, right)
        point = point + step
        if not np.max(np.abs(step)) > 1e-9:
            break
    for view in range(len(cameras)):
        x, y, _ = project_point(cameras[view], point, slope)
        miss = np.hypot(pixels[view, 0] - x, pixels[view, 1] - y)
        misses[view] = miss if np.isfinite(miss) else np.inf
    return point


@njit
def consistent(
    cameras: Floats, pixels: Floats, weights: Floats, limit_px: float
) -> tuple[Floats, npt.NDArray[np.bool_], float]:
    """Return a point (3,), the views (C,) that it is based on, and their RMS residual in pixels.

    Parameters
    ----------
    cameras : (C, 21) from ``packed``.
    pixels : (C, 2) pixels of the point; NaN where it is not seen.
    weights : (C,) weights of the views, inverse squared pixels up to a factor.
    limit_px : views farther than this from the point are outliers.

    If no two views agree, the point is NaN and no view is chosen.
    """
    flat = np.empty(pixels.shape)
    for view in range(len(cameras)):
        flat[view] = flatten_pixel(cameras[view], pixels[view, 0], pixels[view, 1])
    n_views = len(cameras)
    seen = np.zeros(n_views, dtype=np.bool_)
    for view in range(n_views):
        seen[view] = np.isfinite(flat[view, 0]) and weights[view] > 0.0
    misses, best = np.empty(n_views), np.full(3, np.nan)
    chosen, best_chosen, best_rms = seen.copy(), np.zeros(n_views, dtype=np.bool_), np.inf
    for size in range(int(np.sum(seen)), 1, -1):
        for subset in range(1 << n_views):
            count = 0
            for view in range(n_views):
                chosen[view] = (subset >> view) & 1 == 1
                if chosen[view]:
                    count += 1 if seen[view] else n_views
            if count != size:
                continue
            point = _fit(cameras, pixels, flat, weights, chosen, misses)
            square, worst = 0.0, 0.0
            for view in range(n_views):
                if chosen[view]:
                    square += misses[view] ** 2
                    worst = max(worst, misses[view])
            rms = np.sqrt(square / size)
            if worst <= limit_px and rms < best_rms:
                best, best_rms, best_chosen = point, rms, chosen.copy()
        if best_rms < np.inf:
            break
    return best, best_chosen, best_rms if best_rms < np.inf else np.nan


@njit
def triangulate_packed(
    cameras: Floats, pixels: Floats, weights: Floats, limits_px: Floats
) -> tuple[Floats, npt.NDArray[np.bool_], Floats]:
    """Do the same as ``triangulate`` for cameras (C, 21) from ``packed``, with a limit (N,) for each point."""
    n_points, n_views = pixels.shape[:2]
    points, residual_px = np.empty((n_points, 3)), np.empty(n_points)
    used = np.empty((n_points, n_views), dtype=np.bool_)
    for index in range(n_points):
        points[index], used[index], residual_px[index] = consistent(
            cameras, pixels[index], weights[index], limits_px[index]
        )
    return points, used, residual_px


def triangulate(
    cameras: Sequence[Camera], pixels: Floats, limit_px: float, weights: Floats | None = None
) -> tuple[Floats, npt.NDArray[np.bool_], Floats]:
    """Return points (N, 3) in metres, the views (N, C) that each is based on, and its RMS residual (N,) in pixels.

    Parameters
    ----------
    cameras : the C cameras.
    pixels : (N, C, 2) positions of N points in every view; NaN where a point is not seen.
    limit_px : views farther than this from the point are outliers and not used.
    weights : (N, C) weights of the views, by default all 1.

    A point on which no two views agree is NaN.
    """
    weights = np.ones(pixels.shape[:2]) if weights is None else np.ascontiguousarray(weights)
    limits_px = np.full(len(pixels), float(limit_px))
    return triangulate_packed(packed(cameras), np.ascontiguousarray(pixels), weights, limits_px)
