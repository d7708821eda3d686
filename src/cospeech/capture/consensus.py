"""Points from the views that agree: every pair of a point's views proposes, all of its views vote."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from cospeech.capture import bundle
from cospeech.capture.bundle import Rig
from cospeech.capture.camera import Camera, flatten

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@njit(cache=True)
def _consensus(
    inner: Floats, rotations: Floats, shifts: Floats, flat: Floats, observations: Floats, limit: float
) -> tuple[Floats, Mask]:
    n_views, n_points = observations.shape[:2]
    points = np.full((n_points, 3), np.nan)
    agreeing = np.zeros((n_views, n_points), dtype=np.bool_)
    pixel, by_camera, by_point = np.empty(2), np.empty((2, 15)), np.empty((2, 3))
    places = np.empty((n_views, 3))
    for c in range(n_views):
        places[c] = -rotations[c].T @ shifts[c]
    near = np.zeros(n_views, dtype=np.bool_)
    for n in range(n_points):
        most, least = 1, np.inf
        for i in range(n_views):
            for j in range(i + 1, n_views):
                if np.isnan(flat[i, n, 0]) or np.isnan(flat[j, n, 0]):
                    continue
                a = rotations[i].T @ np.array([flat[i, n, 0], flat[i, n, 1], 1.0])
                b = rotations[j].T @ np.array([flat[j, n, 0], flat[j, n, 1], 1.0])
                between = places[j] - places[i]
                aa, ab, bb = a @ a, a @ b, b @ b
                determinant = aa * bb - ab * ab
                if determinant < 1e-9 * aa * bb:
                    continue
                along_a = (bb * (a @ between) - ab * (b @ between)) / determinant
                along_b = (ab * (a @ between) - aa * (b @ between)) / determinant
                point = 0.5 * (places[i] + along_a * a + places[j] + along_b * b)
                count, cost = 0, 0.0
                for c in range(n_views):
                    near[c] = False
                    if np.isnan(observations[c, n, 0]):
                        continue
                    if bundle.observe(inner[c], rotations[c], shifts[c], point, pixel, by_camera, by_point):
                        apart = (pixel[0] - observations[c, n, 0]) ** 2 + (pixel[1] - observations[c, n, 1]) ** 2
                        near[c] = apart < limit
                        if near[c]:
                            count += 1
                            cost += apart
                if count > most or (count == most and count > 1 and cost < least):
                    most, least = count, cost
                    points[n] = point
                    agreeing[:, n] = near
    return points, agreeing


def agree(cameras: list[Camera], observations: Floats, threshold_px: float) -> tuple[Floats, Mask]:
    """Return the points (N, 3) on which most views agree within ``threshold_px``, and which observations (C, N) do.

    Points on which no two views agree are NaN.
    """
    rig: Rig = bundle.from_cameras(cameras)
    with np.errstate(all="ignore"):  # a lens on its way to the solution may fold the picture: NaN, not seen
        flat = np.array([flatten(camera, pixels) for camera, pixels in zip(cameras, observations, strict=True)])
    return _consensus(rig.inner, rig.rotations, rig.shifts, flat, observations, threshold_px**2)
