"""Projective structure and motion: cameras and points up to a projective transformation.

The measurement matrix of a start set of views, scaled by the projective depths, has rank four (P. Sturm and B.
Triggs, A factorization based algorithm for multi-image projective structure and motion, ECCV 1996). Depths are
initialised from the epipolar geometry and refined by alternation. The remaining views and points are added one by
one: points are triangulated from the known cameras, and cameras are resected from the known points. Where few points
are seen by many views at once, the start set is a pair of views, and the rest is chained to it through overlapping
subsets.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from cospeech.data.arrays import Flags, Floats

Pairs = dict[tuple[int, int], Floats]

LEAST_COMMON = 12
"""Minimum number of points that all views of a start set share."""
LEAST_RESECTED = 7
"""Minimum number of known points to resect a camera; six are enough to solve, but leave nothing to check."""
ALTERNATIONS = 30
RESECTIONS = 200
"""Number of six-point samples among which the best resection is chosen."""


def starts(used: Flags, pairs: Pairs) -> list[tuple[int, ...]]:
    """Return the candidate start sets of views, best covered first, given the mask ``used`` (C, N)."""
    found = []
    for size in range(2, len(used) + 1):
        for views in combinations(range(len(used)), size):
            common = int(used[list(views)].all(axis=0).sum())
            linked = all((min(views[0], v), max(views[0], v)) in pairs for v in views[1:])
            if common >= LEAST_COMMON and linked:
                found.append((common * (size - 1), views))
    return [views for _, views in sorted(found, key=lambda item: (-item[0], item[1]))]


def factorise(
    flat: Floats, used: Flags, pairs: Pairs, start: tuple[int, ...], rng: np.random.Generator
) -> tuple[Floats, Floats] | None:
    """Return projective cameras (C, 3, 4) and points (N, 4), NaN for points seen by fewer than two views.

    Returns None if a camera shares too few points with the others.

    Parameters
    ----------
    flat : observations (C, N, 2), scaled to the order of one.
    used : mask (C, N) of the observations to use.
    pairs : F by (i, j), i < j, in the same units.
    start : the views to factorise first.
    """
    cameras = np.full((len(flat), 3, 4), np.nan)
    common = used[list(start)].all(axis=0)
    cameras[list(start)] = _rank_four(flat[list(start)][:, common], start, pairs)
    while np.isnan(cameras).any():
        known = ~np.isnan(cameras[:, 0, 0])
        points = triangulate(cameras, flat, used & known[:, None])
        shared = (used & ~np.isnan(points[:, 0])).sum(axis=1)
        shared[known] = -1
        joined = int(np.argmax(shared))
        if shared[joined] < LEAST_RESECTED:
            return None
        at = used[joined] & ~np.isnan(points[:, 0])
        cameras[joined] = _resect_robustly(points[at], flat[joined, at], rng)
    for _ in range(5):
        points = triangulate(cameras, flat, used)
        at = used & ~np.isnan(points[:, 0])
        cameras = np.array([_resect(points[m], x[m], camera) for x, m, camera in zip(flat, at, cameras, strict=True)])
    return cameras, triangulate(cameras, flat, used)


def _rank_four(flat: Floats, views: tuple[int, ...], pairs: Pairs) -> Floats:
    """Return the cameras (m, 3, 4) of complete observations (m, n, 2), with depths initialised relative to view 0."""
    rays = np.concatenate([flat, np.ones_like(flat[..., :1])], axis=-1)
    depths = np.ones(rays.shape[:2])
    for k, view in enumerate(views[1:], start=1):
        f = pairs[views[0], view] if views[0] < view else pairs[view, views[0]].T
        epipole = np.linalg.svd(f.T)[2][-1]  # image of the first camera in this view: F^T e = 0
        across = np.cross(epipole, rays[k])
        depths[k] = (across * (rays[0] @ f.T)).sum(axis=1) / (across**2).sum(axis=1)
    for _ in range(ALTERNATIONS):
        for _ in range(2):
            depths /= np.sqrt((depths**2).mean(axis=0, keepdims=True))
            depths /= np.sqrt((depths**2).mean(axis=1, keepdims=True))
        scaled = (rays * depths[..., None]).transpose(0, 2, 1).reshape(-1, rays.shape[1])
        u, s, vt = np.linalg.svd(scaled, full_matrices=False)
        cameras = (u[:, :4] * s[:4]).reshape(-1, 3, 4)
        seen = np.einsum("mij,jn->mni", cameras, vt[:4])
        depths = (seen * rays).sum(axis=-1) / (rays**2).sum(axis=-1)
    return cameras * np.sqrt(rays.shape[1])


def triangulate(cameras: Floats, flat: Floats, used: Flags) -> Floats:
    """Return the unit-length points (N, 4) triangulated from the used observations, NaN with fewer than two."""
    rows = flat[..., None] * cameras[:, None, 2:, :] - cameras[:, None, :2, :]
    rows /= np.linalg.norm(rows, axis=-1, keepdims=True)
    rows = np.where(used[..., None, None], rows, 0.0)
    square = np.einsum("cnij,cnik->njk", rows, rows)
    points = np.linalg.eigh(square)[1][..., 0]
    points[used.sum(axis=0) < 2] = np.nan
    return points


def _resect(points: Floats, flat: Floats, camera: Floats | None = None) -> Floats:
    """Return the camera (3, 4) that projects points (n, 4) to ``flat`` (n, 2), reweighted by an estimate if given."""
    rows = np.zeros((len(points), 2, 12))
    rows[:, 0, 0:4] = rows[:, 1, 4:8] = points
    rows[:, :, 8:12] = -flat[:, :, None] * points[:, None, :]
    if camera is not None:
        seen = points @ camera.T
        apart = np.linalg.norm(seen[:, :2] / seen[:, 2:] - flat, axis=1)
        weight = 1.0 / (np.abs(seen[:, 2]) * np.sqrt(1.0 + (apart / (np.median(apart) + 1e-9)) ** 2))
        rows *= weight[:, None, None]
    equations = rows.reshape(-1, 12)
    found = np.linalg.eigh(equations.T @ equations)[1][:, 0].reshape(3, 4)
    return found / np.linalg.norm(found)


def _resect_robustly(points: Floats, flat: Floats, rng: np.random.Generator) -> Floats:
    samples = np.argpartition(rng.random((RESECTIONS, len(points))), 5, axis=1)[:, :6]
    rows = np.zeros((RESECTIONS, 6, 2, 12))
    rows[:, :, 0, 0:4] = rows[:, :, 1, 4:8] = points[samples]
    rows[:, :, :, 8:12] = -flat[samples][..., None] * points[samples][:, :, None, :]
    cameras = np.linalg.svd(rows.reshape(RESECTIONS, 12, 12))[2][:, -1].reshape(-1, 3, 4)
    seen = points @ cameras.transpose(0, 2, 1)
    apart = np.linalg.norm(seen[..., :2] / seen[..., 2:] - flat, axis=-1)
    limit = 0.01
    best = int(np.argmin(np.minimum(apart, limit).sum(axis=1)))
    camera = cameras[best]
    for _ in range(3):
        seen = points @ camera.T
        near = np.linalg.norm(seen[:, :2] / seen[:, 2:] - flat, axis=1) < limit
        if near.sum() < LEAST_RESECTED:
            break
        camera = _resect(points[near], flat[near], camera)
    return camera


def factorisations(
    flat: Floats, used: Flags, pairs: Pairs, rng: np.random.Generator, most: int
) -> Iterator[tuple[Floats, Floats]]:
    """Yield the factorisations from the ``most`` best start sets, skipping those that do not reach every camera."""
    for start in starts(used, pairs)[:most]:
        found = factorise(flat, used, pairs, start, rng)
        if found is not None:
            yield found
