"""Functional calibration: where the joints turn, found from how the markers move in a range-of-motion take.

The thorax carries four markers and is aligned frame by frame as a rigid body (Kabsch 1976). A marker that sits on the
upper arm then moves, in the frame of the thorax, on a sphere about the centre of the shoulder: its centre is found in
one step from the linear equations of the sphere (Pratt's normal form without weights), and refined by Gauss-Newton
on the distances, which makes it the most likely one under white noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

STEPS = 50
WORST_CONDITION = 1e7
UNSURE_M = 0.005
"""Standard error of a joint centre beyond which the take does not determine it."""

SHORTEST_ARM_M = 0.1
"""Shortest upper arm there is: noise about one spot is a good sphere, but a small one."""


class Sphere(NamedTuple):
    """A sphere through points: centre (3,), radius, and the standard error of the centre, in metres."""

    centre_m: Floats
    radius_m: float
    error_m: float


def within(rotations: Floats, shifts_m: Floats, places_m: Floats) -> Floats:
    """Return places (T, 3) of the world in the moving frame of rotations (T, 3, 3) and shifts (T, 3)."""
    return np.einsum("tji,tj->ti", rotations, places_m - shifts_m)


def sphere(points_m: Floats) -> Sphere:
    """Return the sphere through ``points_m`` (N, 3); rows with NaN are left out.

    The standard error is that of the centre in its least sure direction, from the residuals; infinite where the
    points do not determine a sphere (fewer than five, or all in one plane).
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


def shoulder(side: str, elbow_m: Floats, thorax: tuple[Floats, Floats]) -> Sphere:
    """Return the sphere of the elbow marker (T, 3) about the shoulder, in the frame of the thorax.

    Raises
    ------
    UserError : where the arm moves too little to tell the centre.
    """
    found = sphere(within(*thorax, elbow_m))
    if found.error_m > UNSURE_M or found.radius_m < SHORTEST_ARM_M:
        raise UserError(
            f"joint centres: the range-of-motion take moves the {side} arm too little to find its shoulder (radius "
            f"{found.radius_m * 1000:.0f} mm, standard error {found.error_m * 1000:.1f} mm, at most "
            f"{UNSURE_M * 1000:.0f}); circle both arms widely"
        )
    return found
