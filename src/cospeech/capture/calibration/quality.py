"""Quality of a calibration, and checks that the observations determine the rig at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.capture.calibration import bundle_adjustment
from cospeech.data.arrays import Flags, Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera

LEAST_POINTS = 60
"""Minimum number of points seen by two or more views."""
LEAST_OF_A_CAMERA = 20
"""Minimum number of points that a camera shares with others."""
LEAST_COVERAGE = 0.08
"""Minimum fraction of the 8 x 6 fields of an image that contain points."""
LEAST_DEPTH = 0.03
"""Minimum ratio of smallest to largest extent of the point cloud; below it, the points are nearly coplanar."""
LEAST_KEPT = 0.25
"""Minimum fraction of inliers per camera; low, as with 30 % outliers and few views many points have no partner."""
FIELDS = (8, 6)

ADVICE = "film the laser spot again, moving it through the whole stage at all heights"


def undetermined(reason: str) -> UserError:
    """Return the error for a rig that cannot be determined, with the ``reason`` and what to do."""
    return UserError(f"calibration: {reason}; {ADVICE}")


def require_common_points(names: Sequence[str], observations: Floats) -> None:
    """Raise UserError if too few points (C, N, 2) are seen by two or more views."""
    seen = ~np.isnan(observations[..., 0])
    shared = seen & (seen.sum(axis=0) >= 2)
    if len(names) < 3:
        raise undetermined(f"{len(names)} cameras, but calibration without a board needs three or more")
    n_common = int(shared.any(axis=0).sum())
    if n_common < LEAST_POINTS:
        raise undetermined(
            f"{n_common} points are seen by two or more cameras, but at least {LEAST_POINTS} are needed"
        )
    for name, own in zip(names, shared.sum(axis=1), strict=True):
        if own < LEAST_OF_A_CAMERA:
            raise undetermined(
                f"camera {name} shares {own} points with other cameras, but at least {LEAST_OF_A_CAMERA} are needed"
            )


def require_linked(names: Sequence[str], trusted: Flags) -> None:
    """Raise UserError if too few observations (C, N) of a camera are trusted by the pairwise epipolar geometry."""
    for name, own in zip(names, trusted.sum(axis=1), strict=True):
        if own < LEAST_OF_A_CAMERA:
            raise undetermined(f"only {own} points of camera {name} agree with any other camera")


def require_spread(names: Sequence[str], sizes_px: Sequence[tuple[int, int]], pixels: Floats) -> None:
    """Raise UserError if the observations (C, N, 2) cover too little of the image of a camera."""
    for name, size, own in zip(names, sizes_px, pixels, strict=True):
        covered = coverage(own, size)
        if covered < LEAST_COVERAGE:
            raise undetermined(f"the points cover only {covered:.0%} of the image of camera {name}")


def require_determined(cameras: Sequence[Camera], points: Floats, used: Flags, observations: Floats) -> None:
    """Raise UserError if the solution is poorly determined: few inliers, a planar cloud, or little coverage."""
    names, sizes = [camera.name for camera in cameras], [camera.size_px for camera in cameras]
    seen = ~np.isnan(observations[..., 0])
    several = seen & (seen.sum(axis=0) >= 2)
    for name, kept, own in zip(names, used.sum(axis=1), several.sum(axis=1), strict=True):
        if kept < max(LEAST_OF_A_CAMERA, LEAST_KEPT * own):
            raise undetermined(f"only {kept} of the {own} points of camera {name} agree with the other cameras")
    extents = np.linalg.svd(points[used.any(axis=0)] - points[used.any(axis=0)].mean(axis=0), compute_uv=False)
    if extents[2] < LEAST_DEPTH * extents[0]:
        raise undetermined("all points lie nearly in one plane")
    require_spread(names, sizes, np.where(used[..., None], observations, np.nan))


def coverage(pixels: Floats, size_px: tuple[int, int]) -> float:
    """Return the fraction of the 8 x 6 fields of an image that contain at least one of the pixels (n, 2)."""
    seen = pixels[~np.isnan(pixels[:, 0])]
    fields = np.clip((seen + 0.5) / size_px * FIELDS, 0, np.array(FIELDS) - 1).astype(int)
    return len(np.unique(fields, axis=0)) / (FIELDS[0] * FIELDS[1])


def unknown(cameras: Sequence[Camera]) -> pd.DataFrame:
    """Return the quality table for cameras from a camera file, with everything but their names missing."""
    return pd.DataFrame({"camera": [camera.name for camera in cameras]}).assign(
        rms_px=np.nan, n_points=None, n_outliers=None, coverage=np.nan
    )


def table(cameras: Sequence[Camera], points: Floats, used: Flags, observations: Floats) -> pd.DataFrame:
    """Return one row per camera: camera, rms_px, n_points, n_outliers, coverage."""
    distances = bundle_adjustment.residuals(bundle_adjustment.from_cameras(cameras), points, observations)
    several = (~np.isnan(observations[..., 0])).sum(axis=0) >= 2
    rows = []
    for camera, apart, kept, pixels in zip(cameras, distances, used, observations, strict=True):
        n_outliers = int((~kept & several & ~np.isnan(pixels[:, 0])).sum())
        rms = float(np.sqrt(np.mean(apart[kept] ** 2)))
        rows.append((camera.name, rms, int(kept.sum()), n_outliers, coverage(pixels[kept], camera.size_px)))
    return pd.DataFrame(rows, columns=["camera", "rms_px", "n_points", "n_outliers", "coverage"])
