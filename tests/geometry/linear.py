"""Linear triangulation with confidences, and the choice of one person among several, as Pose2Sim does both.

The keypoints of a pose detector come with confidences and, where several people are in view, without names. This is
the method behind the points that Pose2Sim publishes (Pagnon et al. 2021, Sensors 21, 6530, 2.1.2): a weighted direct
linear transform, cameras left out until the mean reprojection error is small, lens not undone. The points of
``triangulate`` minimise the error in pixels instead, which counts where few good views meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from cospeech.geometry.camera import Camera

Floats = npt.NDArray[np.float64]


def direct(cameras: Sequence[Camera], pixels: Floats, confidence: Floats) -> tuple[Floats, float]:
    """Return the point (3,) of pixels (C, 2) with confidences (C,), and its mean reprojection error in pixels."""
    projections = np.stack([camera.intrinsic @ camera.pose for camera in cameras])
    rows = confidence[:, None, None] * (projections[:, :2] - pixels[..., None] * projections[:, 2:])
    point = np.linalg.svd(rows.reshape(-1, 4))[2][-1]
    point = point / point[3]
    seen = projections @ point
    miss = np.linalg.norm(seen[:, :2] / seen[:, 2:] - pixels, axis=1)
    return point[:3], float(miss.mean())


def agreeing(
    cameras: Sequence[Camera], pixels: Floats, confidence: Floats, limit_px: float, least_confidence: float
) -> Floats:
    """Return the point (3,) of the largest set of views with a mean reprojection error up to ``limit_px``, or NaN."""
    sure = np.flatnonzero(confidence >= least_confidence)
    for size in range(len(sure), 1, -1):
        fits = []
        for subset in combinations(sure, size):
            views = [int(view) for view in subset]
            fits.append(direct([cameras[view] for view in views], pixels[views], confidence[views]))
        point, miss = min(fits, key=lambda fit: fit[1])
        if miss <= limit_px:
            return point
    return np.full(3, np.nan)


def same_person(cameras: Sequence[Camera], people: Sequence[Floats]) -> tuple[int, ...]:
    """Return which person of each view is the same: of all combinations, that whose keypoint misses least.

    ``people`` has for each view one keypoint (P, 3) of its P people: x, y and confidence.
    """

    def miss(chosen: tuple[int, ...]) -> float:
        keypoint = np.stack([view[person] for view, person in zip(people, chosen, strict=True)])
        return direct(cameras, keypoint[:, :2], keypoint[:, 2])[1]

    return min(product(*(range(len(view)) for view in people)), key=miss)
