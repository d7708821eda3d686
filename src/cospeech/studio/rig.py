"""The camera rig of the studio: five cameras on a semicircle in front of the actor, with small random deviations."""

from __future__ import annotations

import numpy as np

from cospeech.geometry.camera import Camera, look

FPS = 20.0
FULL_PX = (1392, 1040)
RADIUS_M = 3.0
TARGET_M = (0.0, 0.95, 0.0)
FOCAL = 1.0
"""Focal length in image widths: at 3 m, an actor with raised arms just fits into the image height."""


def cameras(width_px: int, seed: int) -> list[Camera]:
    """Return cameras c1 to c5, from the actor's right to the left, with images ``width_px`` wide."""
    rng = np.random.default_rng([seed, 5])
    height_px = round(width_px * FULL_PX[1] / FULL_PX[0])
    rig = []
    for number, bearing_deg in enumerate(np.linspace(-90.0, 90.0, 5), start=1):
        bearing = np.radians(bearing_deg + rng.normal(0.0, 2.0))
        distance = RADIUS_M + rng.normal(0.0, 0.05)
        place = (distance * np.sin(bearing), 1.6 + rng.normal(0.0, 0.15), distance * np.cos(bearing))
        rotation, origin = look(f"c{number}", place, np.array(TARGET_M) + rng.normal(0.0, 0.03, 3))
        focal = FOCAL * width_px * (1.0 + rng.normal(0.0, 0.01))
        middle = rng.normal(0.0, 0.004 * width_px, 2) + np.array([width_px - 1, height_px - 1]) / 2
        lens = (-0.08 + rng.normal(0.0, 0.02), 0.02 + rng.normal(0.0, 0.01), 0.0, 0.0, 0.0)
        turn, shift = (rotation[0], rotation[1], rotation[2]), (origin[0], origin[1], origin[2])
        centre = (float(middle[0]), float(middle[1]))
        rig.append(Camera(f"c{number}", (width_px, height_px), (focal, focal), centre, lens, turn, shift))
    return rig
