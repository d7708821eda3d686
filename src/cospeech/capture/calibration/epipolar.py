"""Pairwise epipolar geometry, and a vote of all pairs of views on which observations to trust.

The fundamental matrix of two views is estimated by the normalised eight-point algorithm (R. Hartley, In defense of
the eight-point algorithm, PAMI 1997) within RANSAC, with the truncated Sampson distance as its cost (MSAC; P. Torr
and A. Zisserman, MLESAC, CVIU 2000; Hartley and Zisserman, Multiple View Geometry, 2nd ed., eq. 11.9).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Flags, Floats
from cospeech.kernels.jit import njit

LEAST_COMMON = 12
"""Minimum number of points shared by two views whose geometry is estimated; eight points always fit exactly."""

SAMPLES = 4000
SURE = 0.9999
"""Maximum number of RANSAC samples per pair, and the probability of an outlier-free sample at which to stop."""

POLISHES = 4


@njit
def _eight_point(a: Floats, b: Floats) -> Floats:
    """Return F (3, 3) of rank 2 with b^T F a = 0, given at least eight points (n, 2) in two views."""
    n = len(a)
    frames = np.zeros((2, 3, 3))
    moved = np.empty((2, n, 2))
    for side in range(2):
        points = a if side == 0 else b
        x, y = points[:, 0].mean(), points[:, 1].mean()
        scale = np.sqrt(2.0) / (np.sqrt((points[:, 0] - x) ** 2 + (points[:, 1] - y) ** 2).mean() + 1e-12)
        frames[side] = np.array([[scale, 0.0, -scale * x], [0.0, scale, -scale * y], [0.0, 0.0, 1.0]])
        moved[side, :, 0] = (points[:, 0] - x) * scale
        moved[side, :, 1] = (points[:, 1] - y) * scale
    rows = np.ones((n, 9))
    for i in range(n):
        for j in range(3):
            for k in range(3):
                left = moved[1, i, j] if j < 2 else 1.0
                right = moved[0, i, k] if k < 2 else 1.0
                rows[i, 3 * j + k] = left * right
    _, vectors = np.linalg.eigh(rows.T @ rows)
    u, s, vt = np.linalg.svd(np.ascontiguousarray(vectors[:, 0]).reshape(3, 3))
    s[2] = 0.0
    found = frames[1].T @ ((u * s) @ vt) @ frames[0]
    return found / np.sqrt((found**2).sum())


@njit
def sampson(f: Floats, a: Floats, b: Floats) -> Floats:
    """Return the squared Sampson distances (n,) of points ``a`` and ``b`` (n, 2) for the fundamental matrix ``f``."""
    distances = np.empty(len(a))
    for i in range(len(a)):
        x, y, u, v = a[i, 0], a[i, 1], b[i, 0], b[i, 1]
        p = f[0, 0] * x + f[0, 1] * y + f[0, 2]
        q = f[1, 0] * x + f[1, 1] * y + f[1, 2]
        r = f[2, 0] * x + f[2, 1] * y + f[2, 2]
        back_p = f[0, 0] * u + f[1, 0] * v + f[2, 0]
        back_q = f[0, 1] * u + f[1, 1] * v + f[2, 1]
        error = u * p + v * q + r
        distances[i] = error * error / (p * p + q * q + back_p * back_p + back_q * back_q + 1e-300)
    return distances


@njit
def _consensus(a: Floats, b: Floats, samples: npt.NDArray[np.int64], limit: float) -> Floats:
    best, best_cost, needed = np.zeros((3, 3)), np.inf, len(samples)
    for trial in range(len(samples)):
        if trial >= needed:
            break
        found = _eight_point(a[samples[trial]], b[samples[trial]])
        cost = np.minimum(sampson(found, a, b), limit).sum()
        if cost >= best_cost:
            continue
        for _ in range(POLISHES):
            near = np.flatnonzero(sampson(found, a, b) < limit)
            if len(near) < 8:
                break
            found = _eight_point(a[near], b[near])
            polished = np.minimum(sampson(found, a, b), limit).sum()
            if polished >= cost:
                break
            cost = polished
        if cost < best_cost:
            best, best_cost = found, cost
            share = (sampson(found, a, b) < limit).mean()
            if share >= 1.0:
                break
            needed = int(np.log(1.0 - SURE) / np.log(1.0 - share**8 + 1e-12)) + 1
    return best


def fundamental(a: Floats, b: Floats, threshold_px: float, rng: np.random.Generator) -> tuple[Floats, Flags]:
    """Return F (3, 3) with b^T F a = 0, and which of the points (n, 2), n >= 8, are inliers at ``threshold_px``."""
    samples = np.argpartition(rng.random((SAMPLES, len(a))), 7, axis=1)[:, :8]
    found = _consensus(np.ascontiguousarray(a), np.ascontiguousarray(b), samples, threshold_px**2)
    near = sampson(found, a, b) < threshold_px**2
    return found, near


def vote(
    observations: Floats, threshold_px: float, rng: np.random.Generator
) -> tuple[dict[tuple[int, int], Floats], Flags]:
    """Return the fundamental matrices of pairs of views, and the observations that at least half of the pairs accept.

    Parameters
    ----------
    observations : pixels (C, N, 2) of N points in C views, NaN where not observed.
    threshold_px : largest Sampson distance of an inlier; wide, because lens distortion is not yet modelled.

    Returns
    -------
    F by (i, j), i < j, with x_j^T F x_i = 0, for pairs that share ``LEAST_COMMON`` points; and the mask (C, N).
    """
    seen = ~np.isnan(observations[..., 0])
    asked = np.zeros(seen.shape, dtype=int)
    agreed = np.zeros(seen.shape, dtype=int)
    pairs = {}
    for i in range(len(seen)):
        for j in range(i + 1, len(seen)):
            common = np.flatnonzero(seen[i] & seen[j])
            if len(common) < LEAST_COMMON:
                continue
            pairs[i, j], near = fundamental(observations[i, common], observations[j, common], threshold_px, rng)
            for view in (i, j):
                asked[view, common] += 1
                agreed[view, common[near]] += 1
    return pairs, seen & (asked > 0) & (2 * agreed >= asked)
