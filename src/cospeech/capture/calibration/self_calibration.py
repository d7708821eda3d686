"""Self-calibration of a rig from points that its cameras see at the same time, such as a moving laser spot.

Follows T. Svoboda, D. Martinec and T. Pajdla, A convenient multicamera self-calibration for virtual environments,
Presence 2005: outlier rejection by pairwise epipolar geometry, projective factorisation with missing data, metric
upgrade, and robust bundle adjustment including lens distortion.
"""

from __future__ import annotations

import numpy as np

from cospeech.capture.calibration import bundle_adjustment, consensus, epipolar, factorisation, quality, robust_bundle
from cospeech.capture.calibration.metric_upgrade import upgrade
from cospeech.data.arrays import Flags, Floats
from cospeech.geometry.camera import Camera

WIDE = 0.005
"""Initial outlier threshold, relative to the image diagonal; wide, because lens distortion is still unknown."""
FOCAL_GUESSES = (1.0, 0.6, 1.7, 3.0)
"""Initial focal lengths to try for the metric upgrade, relative to the longer side of the image."""
STARTS = 6
"""Number of start sets to try."""
ENOUGH = 0.9
"""Fraction of the trusted observations that must agree for a start to be accepted without trying others."""


def calibrate(
    names: list[str], observations: Floats, sizes_px: list[tuple[int, int]], seed: int = 0
) -> tuple[list[Camera], Floats, Flags]:
    """Return the cameras, the points (N, 3) and the mask (C, N) of the observations that were used.

    The frame is that of the first camera, and the unit is its mean distance from the other cameras; ``world_frame``
    gives metres and axes.

    Parameters
    ----------
    names, sizes_px : names and image sizes of the C cameras.
    observations : pixels (C, N, 2) of N points, NaN where not observed.

    Raises
    ------
    UserError : if the observations do not determine the rig.
    """
    quality.require_common_points(names, observations)
    rng = np.random.default_rng(seed)
    diagonal = float(np.hypot(*np.max(sizes_px, axis=0)))
    pairs, trusted = epipolar.vote(observations, WIDE * diagonal, rng)
    quality.require_linked(names, trusted)
    cameras = _start(names, observations, sizes_px, pairs, trusted, rng)
    cameras, points, used = robust_bundle.adjust(cameras, observations, WIDE * diagonal)
    quality.require_determined(cameras, points, used, observations)
    return cameras, points, used


def _start(
    names: list[str],
    observations: Floats,
    sizes_px: list[tuple[int, int]],
    pairs: dict[tuple[int, int], Floats],
    trusted: Flags,
    rng: np.random.Generator,
) -> list[Camera]:
    """Return the initial cameras, before robust adjustment, with which the most trusted observations agree."""
    unit = float(np.max(sizes_px))
    middles = (np.array(sizes_px, dtype=float) - 1.0) / 2.0
    flat = (observations - middles[:, None]) / unit
    to_pixels = np.array([[[unit, 0.0, x], [0.0, unit, y], [0.0, 0.0, 1.0]] for x, y in middles])
    flat_pairs = {(i, j): to_pixels[j].T @ f @ to_pixels[i] for (i, j), f in pairs.items()}
    seen = np.where(trusted[..., None], observations, np.nan)
    threshold = WIDE * float(np.hypot(*np.max(sizes_px, axis=0)))
    best, most = None, -1
    for projective, points in factorisation.factorisations(flat, trusted, flat_pairs, rng, STARTS):
        for guess in FOCAL_GUESSES:
            found = upgrade(projective, points[~np.isnan(points[:, 0])], guess)
            if found is None:
                continue
            focals, rotations, shifts, _ = found
            rig = _normal(focals * unit, middles, rotations, shifts)
            blank = [Camera(n, s, (1.0, 1.0), (0.0, 0.0)) for n, s in zip(names, sizes_px, strict=True)]
            cameras = bundle_adjustment.to_cameras(rig, blank)
            for wide in (4.0, 2.0):
                cameras, _, _ = robust_bundle.adjust_once(cameras, seen, wide * threshold, iterations=15)
            _, used = consensus.triangulate(cameras, seen, threshold)
            if used.sum() > most:
                best, most = cameras, int(used.sum())
            if most >= ENOUGH * trusted.sum():
                return cameras
    if best is None:
        raise quality.undetermined("no subset of the cameras leads to an initial estimate of all of them")
    return best


def _normal(focals: Floats, middles: Floats, rotations: Floats, shifts: Floats) -> bundle_adjustment.Rig:
    """Return the rig in the frame of its first camera, with the others at a mean distance of one."""
    inner = np.zeros((len(focals), bundle_adjustment.N_INNER))
    inner[:, 0], inner[:, 1], inner[:, 2:4] = focals, 1.0, middles
    turned = rotations @ rotations[0].T
    shifted = shifts - turned @ shifts[0]
    return bundle_adjustment.Rig(inner, turned, shifted / np.linalg.norm(shifted[1:], axis=1).mean())
