"""Functional calibration: joint centres estimated from the motion of markers in a range-of-motion take.

The thorax carries four markers and is aligned as a rigid body in each frame (Kabsch 1976). In the frame of the
thorax, a marker on the upper arm moves on a sphere about the centre of the shoulder. The centre is initialised by the
linear equations of the sphere (unweighted Pratt form) and refined by Gauss-Newton on the distances, which gives the
maximum likelihood estimate under white noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

STEPS = 50
WORST_CONDITION = 1e7
UNSURE_M = 0.005
"""Largest standard error of a joint centre that the take is considered to determine."""

SHORTEST_ARM_M = 0.1
"""Minimum length of an upper arm: noise around one position fits a small sphere well."""


class Sphere(NamedTuple):
    """A fitted sphere: centre (3,), radius, and the standard error of the centre, in metres."""

    centre_m: Floats
    radius_m: float
    error_m: float


def to_local(rotations: Floats, shifts_m: Floats, places_m: Floats) -> Floats:
    """Return world positions (T, 3) in the moving frame given by rotations (T, 3, 3) and translations (T, 3)."""
    return np.einsum("tji,tj->ti", rotations, places_m - shifts_m)


def fit_sphere(points_m: Floats) -> Sphere:
    """Return the sphere fitted to ``points_m`` (N, 3); rows with NaN are ignored.

    The standard error of the centre is that in its least certain direction, estimated from the residuals. It is
    infinite if the points do not determine a sphere (fewer than five, or all in one plane).
    """
    points = points_m[~np.any(np.isnan(points_m), axis=1)]
    if len(points) < 5:
        return Sphere(np.full(3, np.nan), np.nan, np.inf)
    middle = points.mean(axis=0)
    centred = points - middle
    normal = np.column_stack([2.0 * centred, np.ones(len(points))])
    solution, *_ = np.linalg.lstsq(normal, (centred**2).sum(axis=1), rcond=None)
    centre, radius = solution[:3], float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 1e-12)))
    for _ in range(STEPS):
        away = centred - centre
        distance = np.linalg.norm(away, axis=1)
        jacobian = np.column_stack([-away / distance[:, None], -np.ones(len(points))])
        step, *_ = np.linalg.lstsq(jacobian, radius - distance, rcond=None)
        centre, radius = centre + step[:3], radius + float(step[3])
        if np.abs(step).max() < 1e-10:
            break
    residual = np.linalg.norm(centred - centre, axis=1) - radius
    if np.linalg.cond(jacobian) > WORST_CONDITION:
        return Sphere(centre + middle, radius, np.inf)
    variance = (residual**2).sum() / (len(points) - 4) * np.linalg.inv(jacobian.T @ jacobian)
    return Sphere(centre + middle, radius, float(np.sqrt(np.linalg.eigvalsh(variance[:3, :3])[-1])))


def shoulder_centre(side: str, elbow_m: Floats, thorax: tuple[Floats, Floats]) -> Sphere:
    """Return the sphere on which the elbow marker (T, 3) moves about the shoulder, in the frame of the thorax.

    Raises
    ------
    UserError : if the arm moves too little to determine the centre.
    """
    found = fit_sphere(to_local(*thorax, elbow_m))
    if found.error_m > UNSURE_M or found.radius_m < SHORTEST_ARM_M:
        raise UserError(
            f"joint centres: the {side} arm moves too little in the range-of-motion take to locate the shoulder "
            f"(radius {found.radius_m * 1000:.0f} mm, standard error {found.error_m * 1000:.1f} mm, at most "
            f"{UNSURE_M * 1000:.0f} mm allowed); record the take again with wide circles of both arms"
        )
    return found
