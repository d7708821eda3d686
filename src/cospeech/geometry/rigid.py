"""Alignment of point sets by rotation, translation and scale, in closed form.

References
----------
W. Kabsch, A solution for the best rotation to relate two sets of vectors, Acta Crystallographica A 32, 1976.
S. Umeyama, Least-squares estimation of transformation parameters between two point patterns, PAMI 13, 1991.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import to_vectors


@dataclass(frozen=True)
class Similarity:
    """A change of coordinates that takes a point X to s Q X + b.

    Attributes
    ----------
    scale : s. rotation : Q, (3, 3). shift : b, (3,).
    """

    scale: float
    rotation: Floats
    shift: Floats

    def points(self, points: Floats) -> Floats:
        """Return points (..., 3) in the new coordinates."""
        return self.scale * points @ self.rotation.T + self.shift

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        """Return the cameras in the new coordinates; the pixels of all points stay the same."""
        moved = []
        for camera in cameras:
            rotation = camera.rotation @ self.rotation.T
            turn, shift = to_vectors(rotation), -rotation @ self.points(camera.place_m)
            moved.append(replace(camera, turn=tuple(turn.tolist()), shift_m=tuple(shift.tolist())))
        return moved


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Return the similarity that takes ``source`` (n, 3) to ``target`` (n, 3) with the least sum of squares.

    The rotation is determined only if neither set of points is on a line (Umeyama 1991).
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    rotation, strength = _nearest_rotation(b.T @ a)
    scale = float(strength / (a**2).sum())
    return Similarity(scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0))


def align(template: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return rotations (T, 3, 3) and translations (T, 3) that take a rigid template (M, 3) to points (T, M, 3).

    Each frame is a least-squares fit to the points seen in it, which are those that are not NaN (Kabsch 1976). The
    result is NaN in frames with fewer than three.
    """
    seen = ~np.any(np.isnan(points), axis=2)
    weight = seen[:, :, None] / np.maximum(seen.sum(axis=1), 1)[:, None, None]
    present = np.where(seen[:, :, None], points, 0.0)
    middle, template_middle = (weight * present).sum(axis=1), (weight * template).sum(axis=1)
    centred = weight * (template - template_middle[:, None])
    inverse, _ = _nearest_rotation(np.einsum("tmi,tmj->tij", centred, present - middle[:, None]))
    rotations = np.swapaxes(inverse, 1, 2)
    shifts = middle - np.einsum("tij,tj->ti", rotations, template_middle)
    few = seen.sum(axis=1) < 3
    rotations[few], shifts[few] = np.nan, np.nan
    return rotations, shifts


def _nearest_rotation(correlation: Floats) -> tuple[Floats, Floats]:
    """Return the rotations R (..., 3, 3) that maximise trace(R^T C) for matrices C (..., 3, 3), and the maxima."""
    u, s, vt = np.linalg.svd(correlation)
    signs = np.ones_like(s)
    signs[..., 2] = np.sign(np.linalg.det(u @ vt))
    return (u * signs[..., None, :]) @ vt, (s * signs).sum(axis=-1)
