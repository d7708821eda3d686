"""How good a calibration is, and the refusal of what cannot determine a rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.capture.calibration import bundle_adjustment
from cospeech.data.arrays import Flags, Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera

LEAST_POINTS = 60
"""Points seen by two or more views."""
LEAST_OF_A_CAMERA = 20
"""Points that a camera shares with others."""
LEAST_COVERAGE = 0.08
"""Share of a picture's 8 x 6 fields in which points were seen."""
LEAST_DEPTH = 0.03
"""Smallest over largest extent of the cloud of points: below it, the points are as good as in one plane."""
LEAST_KEPT = 0.25
"""Share of a camera's observations that must agree; with 30 % outliers and few views many find no partner."""
FIELDS = (8, 6)

ADVICE = "film the spot again, roaming through the whole stage at all heights"


def undetermined(reason: str) -> UserError:
    """Return the refusal of a calibration for ``reason``."""
    return UserError(f"calibration: {reason}; {ADVICE}")


def require_common_points(names: Sequence[str], observations: Floats) -> None:
    """Raise UserError where too few points (C, N, 2) are seen by two or more views."""
    seen = ~np.isnan(observations[..., 0])
    shared = seen & (seen.sum(axis=0) >= 2)
    if len(names) < 3:
        raise undetermined(f"{len(names)} cameras, and only three or more determine each other without a board")
    n_common = int(shared.any(axis=0).sum())
    if n_common < LEAST_POINTS:
        raise undetermined(f"{n_common} points are seen by two or more cameras, at least {LEAST_POINTS} are needed")
    for name, own in zip(names, shared.sum(axis=1), strict=True):
        if own < LEAST_OF_A_CAMERA:
            raise undetermined(
                f"camera {name} shares {own} points with others, at least {LEAST_OF_A_CAMERA} are needed"
            )


def require_linked(names: Sequence[str], trusted: Flags) -> None:
    """Raise UserError where the pairs of views trust too few observations (C, N) of a camera."""
    for name, own in zip(names, trusted.sum(axis=1), strict=True):
        if own < LEAST_OF_A_CAMERA:
            raise undetermined(f"only {own} of the points of camera {name} agree with any other camera")


def require_spread(names: Sequence[str], sizes_px: Sequence[tuple[int, int]], pixels: Floats) -> None:
    """Raise UserError where the observations (C, N, 2) cover too little of a camera's picture."""
    for name, size, own in zip(names, sizes_px, pixels, strict=True):
        covered = coverage(own, size)
        if covered < LEAST_COVERAGE:
            raise undetermined(f"the points cover {covered:.0%} of the picture of camera {name}")


def require_determined(cameras: Sequence[Camera], points: Floats, used: Flags, observations: Floats) -> None:
    """Raise UserError where the solution rests on too little: few points, one plane, one camera astray."""
    names, sizes = [camera.name for camera in cameras], [camera.size_px for camera in cameras]
    seen = ~np.isnan(observations[..., 0])
    several = seen & (seen.sum(axis=0) >= 2)
    for name, kept, own in zip(names, used.sum(axis=1), several.sum(axis=1), strict=True):
        if kept < max(LEAST_OF_A_CAMERA, LEAST_KEPT * own):
            raise undetermined(f"only {kept} of {own} points of camera {name} agree with the other cameras")
    extents = np.linalg.svd(points[used.any(axis=0)] - points[used.any(axis=0)].mean(axis=0), compute_uv=False)
    if extents[2] < LEAST_DEPTH * extents[0]:
        raise undetermined("all points lie in one plane")
    require_spread(names, sizes, np.where(used[..., None], observations, np.nan))


def coverage(pixels: Floats, size_px: tuple[int, int]) -> float:
    """Return the share of a picture's fields in which at least one of the pixels (n, 2) lies."""
    seen = pixels[~np.isnan(pixels[:, 0])]
    fields = np.clip((seen + 0.5) / size_px * FIELDS, 0, np.array(FIELDS) - 1).astype(int)
    return len(np.unique(fields, axis=0)) / (FIELDS[0] * FIELDS[1])


def unknown(cameras: Sequence[Camera]) -> pd.DataFrame:
    """Return the table of cameras that were calibrated elsewhere: nothing is known but their names."""
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
