"""Robust bundle adjustment: rounds of inlier selection and adjustment with a shrinking outlier threshold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cospeech.capture.calibration import bundle_adjustment, consensus
from cospeech.data.arrays import Flags, Floats
from cospeech.geometry.camera import Camera

CENTRE_DOUBT = 0.015
"""Prior standard deviation of the principal point from the image centre, relative to the longer side."""

LENS_DOUBT = 0.3
"""Prior standard deviation of k1 and k2."""

FINEST_PX = 0.005
"""Lower bound on the estimated noise: no real image is measured more precisely."""

ROUNDS = 6

MEDIAN = 1.1774
"""Median length of a two-dimensional standard normal vector."""

OUTLYING = 3.7
"""Outlier threshold in standard deviations of the noise; one inlier in a thousand exceeds it."""


def adjust_once(
    cameras: list[Camera],
    observations: Floats,
    threshold_px: float,
    *,
    free: Sequence[str] = bundle_adjustment.SELF,
    iterations: int = 50,
) -> tuple[list[Camera], Floats, Flags]:
    """Return cameras adjusted to the inliers within ``threshold_px``, their points, and the inlier mask (C, N)."""
    points, used = consensus.triangulate(cameras, observations, threshold_px)
    cameras, points = adjust_inliers(
        cameras, points, observations, used, noise_px=threshold_px / OUTLYING, free=free, iterations=iterations
    )
    return cameras, points, used


def adjust_inliers(
    cameras: Sequence[Camera],
    points: Floats,
    observations: Floats,
    used: Flags,
    *,
    noise_px: float,
    free: Sequence[str] = bundle_adjustment.SELF,
    iterations: int = 50,
) -> tuple[list[Camera], Floats]:
    """Return cameras and points (N, 3) fitted to the used observations (C, N), with the prior scaled by the noise."""
    rig, points = bundle_adjustment.adjust(
        bundle_adjustment.from_cameras(cameras),
        points,
        observations,
        used,
        free=free,
        prior=_prior(cameras, noise_px),
        iterations=iterations,
    )
    return bundle_adjustment.to_cameras(rig, cameras), points


def _prior(cameras: Sequence[Camera], noise_px: float) -> tuple[Floats, Floats]:
    """Return the weak prior for ``bundle_adjustment.adjust``.

    It is scaled by the noise because the cost is in squared pixels, not in standard deviations.
    """
    values = np.zeros((len(cameras), bundle_adjustment.N_INNER))
    weights = np.zeros_like(values)
    for row, camera in enumerate(cameras):
        values[row, 2:4] = (np.array(camera.size_px) - 1.0) / 2.0
        weights[row, 2:4] = (noise_px / (CENTRE_DOUBT * max(camera.size_px))) ** 2
        weights[row, 4:6] = (noise_px / LENS_DOUBT) ** 2
    return values, weights


def adjust(
    cameras: list[Camera], observations: Floats, threshold_px: float, *, free: Sequence[str] = bundle_adjustment.SELF
) -> tuple[list[Camera], Floats, Flags]:
    """Return cameras, points and used observations after rounds of adjustment with a shrinking outlier threshold.

    The threshold starts at ``threshold_px`` and then follows the estimated noise.
    """
    for _ in range(ROUNDS):
        cameras, points, used = adjust_once(cameras, observations, threshold_px, free=free)
        distances = bundle_adjustment.residuals(bundle_adjustment.from_cameras(cameras), points, observations)
        n_parameters = 3 * int(used.any(axis=0).sum()) + (len(free) + len(bundle_adjustment.POSE)) * len(cameras)
        threshold_px = min(threshold_px, OUTLYING * noise_sd(distances[used], n_parameters))
    return adjust_once(cameras, observations, threshold_px, free=free)


def noise_sd(distances: Floats, n_parameters: int) -> float:
    """Return the standard deviation of the pixel noise per axis, from the median of the reprojection errors (n,).

    The estimate is at least ``FINEST_PX``, and corrected for the degrees of freedom taken by ``n_parameters`` fitted
    parameters.
    """
    n_values = 2 * len(distances)
    return max(
        float(np.median(distances)) / MEDIAN * np.sqrt(n_values / max(n_values - n_parameters, 0.05 * n_values)),
        FINEST_PX,
    )
