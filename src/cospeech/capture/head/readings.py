"""What the equations of Sargin 2006 for the pose of a head give as printed, and as read here, on known motion.

The points are those of a face, 1 m in front of the camera, measured with 2 mm of noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.capture.head import smoothing
from cospeech.capture.head.smoothing import Smoothing
from cospeech.data.arrays import Floats
from cospeech.geometry import rotation
from cospeech.geometry.newton_rotation import Variant, newton_rotation
from cospeech.geometry.rigid import align

FACE_M, DISTANCE_M, NOISE_M, N_POINTS = (0.05, 0.06, 0.02), 1.0, 0.002, 60
FPS, SECONDS = 30.0, 4.0

AXES_HZ = np.array([0.5, 0.7, 0.9])
"""Frequencies of the movement about the three axes."""

LARGEST_DEG = 30.0


class Reading(NamedTuple):
    """What an equation gives, of a ``quantity`` in a ``unit``, as printed and as read."""

    equation: str
    quantity: str
    unit: str
    as_printed: float
    as_read: float


def readings(seed: int) -> list[Reading]:
    """Return the readings of B.2, B.10 and B.15, 4.4, 4.5 and 4.7."""
    rng = np.random.default_rng(seed)
    return [_translation(rng), *_newton(rng), _arctan(), _increments(), _filter(rng)]


def movement() -> Floats:
    """Return the angles (T, 3) in degrees of a head that moves about all axes."""
    times_s = np.arange(round(SECONDS * FPS)) / FPS
    return np.asarray(LARGEST_DEG * np.sin(2.0 * np.pi * AXES_HZ * times_s[:, None]))


def _face(rng: np.random.Generator, turned: Floats) -> tuple[Floats, Floats]:
    """Return points of a face (n, 3) in metres, in the frame of the camera, and as measured after a rotation."""
    centre = np.array([0.0, 0.0, DISTANCE_M])
    points = rng.normal(0.0, FACE_M, (N_POINTS, 3))
    return points + centre, points @ turned.T + centre + rng.normal(0.0, NOISE_M, points.shape)


def _translation(rng: np.random.Generator) -> Reading:
    """Return the error of the place of the face after a turn of 10 degrees about its own centre (B.2)."""
    turned = rotation.from_euler("XYZ", np.array([0.0, 10.0, 0.0]))
    source, target = _face(rng, turned)
    found = align(source, target[None])[0][0]
    centre = source.mean(axis=0)
    shifts = target.mean(axis=0) - centre, target.mean(axis=0) - found @ centre
    errors = [1000.0 * float(np.linalg.norm(found @ centre + shift - target.mean(axis=0))) for shift in shifts]
    return Reading("B.2", "error of the place after a turn of 10°", "mm", *errors)


def _newton(rng: np.random.Generator) -> list[Reading]:
    """Return steps and convergence of Newton's method (B.10, B.15)."""
    found = []
    for angle in (30.0, 130.0):
        searches = []
        for _ in range(20):
            axis = rng.normal(size=3)
            turned = rotation.from_vectors(np.radians(angle) * axis / np.linalg.norm(axis))
            faces = _face(rng, turned)
            searches.append([newton_rotation(*faces, variant) for variant in (Variant.PRINTED, Variant.CORRECTED)])
        if angle == 30.0:
            steps = [float(np.mean([pair[place].n_steps for pair in searches])) for place in (0, 1)]
            found.append(Reading("B.10, B.15", "Newton steps for a rotation of 30°", "", *steps))
        else:
            shares = [100.0 * float(np.mean([pair[place].converged for pair in searches])) for place in (0, 1)]
            found.append(Reading("B.10, B.15", "rotations of 130° that are found", "%", *shares))
    return found


def _arctan() -> Reading:
    """Return the largest error of the angle about x over a whole nod, by the arctangent of a quotient (4.4)."""
    nods = np.arange(-120.0, 121.0, 10.0) + 0.5
    turned = rotation.from_euler("XYZ", np.column_stack([nods, 0.0 * nods, 0.0 * nods]))
    quotient = np.degrees(np.arctan(-turned[:, 1, 2] / turned[:, 2, 2]))
    errors = [float(np.abs(own - nods).max()) for own in (quotient, rotation.to_euler("XYZ", turned)[:, 0])]
    return Reading("4.4", "largest error of the nod within ±120°", "°", *errors)


def _increments() -> Reading:
    """Return the largest error of angles that are followed from frame to frame (4.5)."""
    true = movement()
    turned = rotation.from_euler("XYZ", true)
    steps = turned[1:] @ np.swapaxes(turned[:-1], -1, -2)
    added = true[0] + np.cumsum(rotation.to_euler("XYZ", steps), axis=0)
    composed, places = turned[0], []
    for step in steps:
        composed = step @ composed
        places.append(composed)
    followed = rotation.to_euler("XYZ", np.array(places))
    errors = [float(np.abs(own - true[1:]).max()) for own in (added, followed)]
    return Reading("4.5", f"largest error in {SECONDS:g} s of movement within ±{LARGEST_DEG:g}°", "°", *errors)


def _filter(rng: np.random.Generator) -> Reading:
    """Return the error that remains of measured angles after the Kalman filter (4.6, 4.7) and after the smoother."""
    true = movement()
    measured = true + rng.normal(0.0, smoothing.ANGLE_SD_DEG, true.shape)
    errors = [
        float(np.sqrt(((smoothing.smoothed_angles(measured, FPS, how) - true) ** 2).mean()))
        for how in (Smoothing.KALMAN, Smoothing.SMOOTHER)
    ]
    return Reading("4.6, 4.7", f"error left of {smoothing.ANGLE_SD_DEG:g}° of noise", "°", *errors)
