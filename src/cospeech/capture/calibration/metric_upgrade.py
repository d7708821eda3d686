"""Metric upgrade of a projective reconstruction by linear estimation of the dual absolute quadric.

M. Pollefeys et al., Visual modeling with a hand-held camera, IJCV 2004, section 5.2. Square pixels, a principal point
near the image centre and a focal length near a guess, each weighted by its uncertainty, are linear constraints on the
ten parameters of the quadric.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats

UNCERTAIN = {"focal": 3.0, "aspect": 0.05, "skew": 0.01, "centre": 0.1}
"""Uncertainty of the intrinsics around the guess, relative to the focal length."""

REWEIGHTINGS = 6


def upgrade(cameras: Floats, points: Floats, focal: float) -> tuple[Floats, Floats, Floats, Floats] | None:
    """Return focal lengths (C,), rotations (C, 3, 3), translations (C, 3) and points (N, 3), or None if it fails.

    Parameters
    ----------
    cameras : projective cameras (C, 3, 4), for image coordinates relative to the image centre.
    points : projective points (N, 4).
    focal : initial guess for all focal lengths, in the same units.
    """
    scaled = cameras / np.array([focal, focal, 1.0])[:, None]
    change = _change_of_space(_quadric(scaled))
    if change is None:
        return None
    best = None
    for mirror in (np.eye(4), np.diag([1.0, 1.0, 1.0, -1.0])):
        matrices = scaled @ change @ mirror
        matrices *= np.sign(np.linalg.det(matrices[:, :, :3]))[:, None, None]
        placed = points @ np.linalg.inv(change @ mirror).T
        placed = placed[:, :3] / placed[:, 3:]
        depths = np.einsum("cj,nj->cn", matrices[:, 2, :3], placed) + matrices[:, 2, 3:]
        ahead = int((depths > 0).sum())
        if best is None or ahead > best[0]:
            best = ahead, matrices, placed
    assert best is not None
    _, matrices, placed = best
    outer = matrices[:, :, :3] @ matrices[:, :, :3].transpose(0, 2, 1)
    centre = outer[:, :2, 2] / outer[:, 2:, 2]
    square = (outer[:, 0, 0] + outer[:, 1, 1]) / outer[:, 2, 2] - (centre**2).sum(axis=1)
    focals = np.sqrt(np.clip(square / 2.0, 0.04, 25.0))
    inverse = np.stack([1.0 / focals, 1.0 / focals, np.ones_like(focals)], axis=1)
    turned = inverse[:, :, None] * matrices
    u, s, vt = np.linalg.svd(turned[:, :, :3])
    return focals * focal, u @ vt, turned[:, :, 3] / s.mean(axis=1)[:, None], placed


def _quadric(cameras: Floats) -> Floats:
    """Return the dual absolute quadric (4, 4) of cameras whose intrinsic matrix is close to the identity."""
    at = [(i, j) for i in range(4) for j in range(i, 4)]
    weights = np.ones(len(cameras))
    quadric = np.zeros((4, 4))
    for _ in range(REWEIGHTINGS):
        rows = []
        for camera, weight in zip(cameras, weights, strict=True):

            def entry(a: int, b: int, camera: Floats = camera) -> Floats:
                product = np.outer(camera[a], camera[b])
                return np.array([product[i, j] + (product[j, i] if i != j else 0.0) for i, j in at])

            equations = (
                (entry(0, 0) - entry(2, 2), 2.0 * UNCERTAIN["focal"]),
                (entry(1, 1) - entry(2, 2), 2.0 * UNCERTAIN["focal"]),
                (entry(0, 0) - entry(1, 1), 2.0 * UNCERTAIN["aspect"]),
                (entry(0, 1), UNCERTAIN["skew"]),
                (entry(0, 2), UNCERTAIN["centre"]),
                (entry(1, 2), UNCERTAIN["centre"]),
            )
            rows += [weight * equation / doubt for equation, doubt in equations]
        solution = np.linalg.svd(np.array(rows))[2][-1]
        for (i, j), value in zip(at, solution, strict=True):
            quadric[i, j] = quadric[j, i] = value
        scale = np.einsum("cj,jk,ck->c", cameras[:, 2], quadric, cameras[:, 2])
        quadric *= np.sign(np.median(scale))
        weights = 1.0 / np.maximum(np.abs(scale), 1e-3 * np.abs(scale).max())
    return quadric


def _change_of_space(quadric: Floats) -> Floats | None:
    """Return H (4, 4) with quadric = H diag(1, 1, 1, 0) H^T, or None if the signs of its eigenvalues forbid it."""
    values, vectors = np.linalg.eigh(quadric)
    order = np.argsort(values)[::-1]
    values, vectors = values[order], vectors[:, order]
    if values[2] <= 0.0:
        return None
    return vectors * np.sqrt(np.array([values[0], values[1], values[2], values[0]]))
