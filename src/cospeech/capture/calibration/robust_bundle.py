"""Bundle adjustment in rounds: what agrees is adjusted, and the better the cameras, the less may disagree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cospeech.capture.calibration import bundle_adjustment, consensus
from cospeech.data.arrays import Flags, Floats
from cospeech.geometry.camera import Camera

CENTRE_DOUBT = 0.015
"""Standard deviation of the principal point from the middle, relative to the longer side."""

LENS_DOUBT = 0.3
"""Standard deviation of k1 and k2."""

FINEST_PX = 0.005
"""Least noise: no real picture is measured better."""

ROUNDS = 6

MEDIAN = 1.1774
"""Median length of a vector of two normal numbers, in their standard deviations."""

OUTLYING = 3.7
"""Distances above this many standard deviations are outliers: one in a thousand of those that are not."""


def adjust(
    cameras: list[Camera],
    observations: Floats,
    threshold_px: float,
    *,
    free: Sequence[str] = bundle_adjustment.SELF,
    iterations: int = 50,
) -> tuple[list[Camera], Floats, Flags]:
    """Return the cameras adjusted to what agrees on them within ``threshold_px``, its points, and what agreed."""
    points, used = consensus.agree(cameras, observations, threshold_px)
    cameras, points = fitted(
        cameras, points, observations, used, noise_px=threshold_px / OUTLYING, free=free, iterations=iterations
    )
    return cameras, points, used


def fitted(
    cameras: Sequence[Camera],
    points: Floats,
    observations: Floats,
    used: Flags,
    *,
    noise_px: float,
    free: Sequence[str] = bundle_adjustment.SELF,
    iterations: int = 50,
) -> tuple[list[Camera], Floats]:
    """Return cameras and points (N, 3) fitted to the used observations (C, N), under the prior of that noise."""
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
    """Return the weak prior of ``bundle.adjust``, scaled by the noise, as squared pixels are not standardised."""
    values = np.zeros((len(cameras), bundle_adjustment.N_INNER))
    weights = np.zeros_like(values)
    for row, camera in enumerate(cameras):
        values[row, 2:4] = (np.array(camera.size_px) - 1.0) / 2.0
        weights[row, 2:4] = (noise_px / (CENTRE_DOUBT * max(camera.size_px))) ** 2
        weights[row, 4:6] = (noise_px / LENS_DOUBT) ** 2
    return values, weights


def rounds(
    cameras: list[Camera], observations: Floats, threshold_px: float, *, free: Sequence[str] = bundle_adjustment.SELF
) -> tuple[list[Camera], Floats, Flags]:
    """Return cameras, points and used observations after rounds of adjustment with a shrinking outlier threshold.

    The threshold starts at ``threshold_px`` and follows the ``noise``.
    """
    for _ in range(ROUNDS):
        cameras, points, used = adjust(cameras, observations, threshold_px, free=free)
        distances = bundle_adjustment.residuals(bundle_adjustment.from_cameras(cameras), points, observations)
        taken = 3 * int(used.any(axis=0).sum()) + (len(free) + len(bundle_adjustment.POSE)) * len(cameras)
        threshold_px = min(threshold_px, OUTLYING * noise(distances[used], taken))
    return adjust(cameras, observations, threshold_px, free=free)


def noise(distances: Floats, taken: int) -> float:
    """Return the noise in pixels on an axis that the median of distances (n,) tells, and ``FINEST_PX`` at least.

    ``taken`` is how many numbers were fitted, which take some of the noise away.
    """
    told = 2 * len(distances)
    return max(float(np.median(distances)) / MEDIAN * np.sqrt(told / max(told - taken, 0.05 * told)), FINEST_PX)
