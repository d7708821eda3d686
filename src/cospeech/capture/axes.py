"""Metre and axes of a self-calibrated rig, from stated facts: films alone tell neither.

Every function takes cameras and points of one frame to another by a similarity: a point X becomes s Q X + b.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from cospeech.capture.camera import Camera
from cospeech.errors import UserError

Floats = npt.NDArray[np.float64]

LEAST_ACROSS = 0.05
"""Smallest width of the triangle of camera places, relative to its length, that fixes a rotation."""


@dataclass(frozen=True)
class Similarity:
    """s, Q (3, 3) and b (3,)."""

    scale: float
    rotation: Floats
    shift: Floats

    def points(self, points: Floats) -> Floats:
        """Return points (..., 3) in the new frame."""
        return self.scale * points @ self.rotation.T + self.shift

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        """Return the cameras in the new frame; their pictures stay the same."""
        moved = []
        for camera in cameras:
            rotation = camera.rotation @ self.rotation.T
            turn, shift = Rotation.from_matrix(rotation).as_rotvec(), -rotation @ self.points(camera.place_m)
            moved.append(replace(camera, turn=tuple(turn.tolist()), shift_m=tuple(shift.tolist())))
        return moved


def stated(cameras: Sequence[Camera], facts: Mapping[str, Any]) -> Similarity:
    """Return the similarity that the stated facts of a rig give.

    Parameters
    ----------
    facts : ``places_m``, camera names to (x, y, z); or ``distance_m`` with ``between``, two camera names. A distance
        alone gives the metre, and leaves the axes those of the first camera.

    Raises
    ------
    UserError : where the facts are none of these, or do not determine the change.
    """
    if set(facts) == {"places_m"}:
        return by_places(cameras, facts["places_m"])
    if set(facts) == {"distance_m", "between"}:
        first, second = facts["between"]
        return by_distance(cameras, first, second, facts["distance_m"])
    raise UserError(
        f"calibration: facts {sorted(facts)} give no metre; state places_m, or distance_m and between, of cameras"
    )


def by_distance(cameras: Sequence[Camera], first: str, second: str, distance_m: float) -> Similarity:
    """Return the change of unit that puts two named cameras ``distance_m`` apart.

    Raises
    ------
    UserError : where there is no such camera.
    """
    places = _places(cameras, (first, second))
    return Similarity(distance_m / float(np.linalg.norm(places[0] - places[1])), np.eye(3), np.zeros(3))


def by_wand(ends: Floats, length_m: float) -> Similarity:
    """Return the change of unit that makes the wand, ends (N, 2, 3) with NaN where unseen, ``length_m`` long.

    Raises
    ------
    UserError : where both ends are never seen together.
    """
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    lengths = lengths[~np.isnan(lengths)]
    if not len(lengths):
        raise UserError("calibration: both ends of the wand are never seen together; film it again")
    return Similarity(length_m / float(np.median(lengths)), np.eye(3), np.zeros(3))


def by_places(cameras: Sequence[Camera], places_m: Mapping[str, Sequence[float]]) -> Similarity:
    """Return the similarity that brings the cameras nearest to their measured places (Umeyama, PAMI 1991).

    Raises
    ------
    UserError : where fewer than three places are stated, one is of no camera, or all lie on a line.
    """
    if len(places_m) < 3:
        raise UserError(f"calibration: {len(places_m)} camera places are stated, at least three fix the axes")
    wanted = np.array([places_m[name] for name in places_m], dtype=float)
    return fit(_places(cameras, tuple(places_m)), wanted)


def by_points(origin: Floats, left: Floats, ahead: Floats) -> Similarity:
    """Return the turn and shift to the frame of three points (3,): origin, one to the actor's left, one ahead.

    The unit stays. The origin and the point ahead lie on z exactly; x is as near to the point at the left as can be.

    Raises
    ------
    UserError : where the three points lie on a line.
    """
    z, x = ahead - origin, left - origin
    y = np.cross(z, x)
    if np.linalg.norm(y) < LEAST_ACROSS * np.linalg.norm(z) * np.linalg.norm(x):
        raise UserError("calibration: the three points of the frame lie on a line; state another point at the left")
    z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
    rotation = np.array([np.cross(y, z), y, z])
    return Similarity(1.0, rotation, -rotation @ origin)


def fit(found: Floats, wanted: Floats) -> Similarity:
    """Return the similarity that takes ``found`` (n, 3) to ``wanted`` (n, 3) with the least sum of squares.

    Raises
    ------
    UserError : where the points lie on a line.
    """
    a, b = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
    spread = np.linalg.svd(b, compute_uv=False)
    if spread[1] < LEAST_ACROSS * spread[0]:
        raise UserError("calibration: the stated places lie on a line, which leaves a rotation open; state another")
    u, s, vt = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    scale = float((s * signs).sum() / (a**2).sum())
    return Similarity(scale, rotation, wanted.mean(axis=0) - scale * rotation @ found.mean(axis=0))


def _places(cameras: Sequence[Camera], names: Sequence[str]) -> Floats:
    known = {camera.name: camera.place_m for camera in cameras}
    for name in names:
        if name not in known:
            raise UserError(f"calibration: a fact is stated of camera {name}, the rig has {', '.join(known)}")
    return np.array([known[name] for name in names])
