"""The tracker of the thesis: one window of 5x5 pixels per marker and view (Özkul 2012, 2.3 and 2.4).

Each view is tracked separately. The window of a marker is extrapolated from its last two positions, and the mean of
the pixels that pass a colour threshold is the new position. If no pixel passes, the window stays where it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cospeech.capture.tracking import blobs
from cospeech.capture.tracking.colour import Unmixer
from cospeech.capture.tracking.detections import Detections
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera, project
from cospeech.geometry.triangulate import triangulate
from cospeech.motion.markers import MARKERS

HALF_WINDOW = 2
THRESHOLD = 0.3
"""Minimum fraction of the marker's colour in a pixel (1 is fully lit)."""


class ThesisTracker:
    """Tracks the markers of one take; see ``RobustTracker`` for the parameters."""

    def __init__(self, cameras: Sequence[Camera], first_m: Floats, unmixers: Mapping[str, Unmixer]) -> None:
        self.cameras = cameras
        self.unmixers = [unmixers[marker.colour] for marker in MARKERS]
        self.last = np.stack([project(camera, first_m) for camera in cameras], axis=1)
        self.shift = np.zeros_like(self.last)

    def step(
        self, pictures: Sequence[Planes], corrections: Sequence[tuple[int, int, float, float]] = ()
    ) -> Detections:
        """Return the markers of the next frame, given one image per camera; see ``RobustTracker.step``."""
        pixels = np.full(self.last.shape, np.nan)
        n_pixels = np.zeros(self.last.shape[:2], dtype=np.int64)
        for marker, unmixer in enumerate(self.unmixers):
            for view, (planes, camera) in enumerate(zip(pictures, self.cameras, strict=True)):
                expected = self.last[marker, view] + self.shift[marker, view]
                pixels[marker, view], n_pixels[marker, view] = window_mean(planes, camera.size_px, unmixer, expected)
        corrected = np.zeros(n_pixels.shape, dtype=bool)
        for marker, view, x, y in corrections:
            pixels[marker, view], corrected[marker, view] = (x, y), True
        seen = np.isfinite(pixels)
        self.shift = np.where(seen, pixels - self.last, 0.0)
        self.last = np.where(seen, pixels, self.last)
        points, used, residual = triangulate(self.cameras, pixels, np.inf)
        return Detections(pixels, n_pixels, corrected, used, points, residual)


def window_mean(planes: Planes, size_px: tuple[int, int], unmixer: Unmixer, expected: Floats) -> tuple[Floats, int]:
    """Return the mean position (2,) of pixels of one colour in the window around ``expected`` (2,), and their number.

    The mean is NaN if no pixel passes the threshold.
    """
    width, height = size_px
    if not (np.isfinite(expected).all() and np.abs(expected).max() < 1e6):
        return np.full(2, np.nan), 0
    column, row = (round(float(value)) for value in expected)
    left, top = max(0, column - HALF_WINDOW), max(0, row - HALF_WINDOW)
    right, bottom = min(width, column + HALF_WINDOW + 1), min(height, row + HALF_WINDOW + 1)
    if right <= left or bottom <= top:
        return np.full(2, np.nan), 0
    amount = blobs.shares(*planes, (left, top, right, bottom), unmixer.across, unmixer.share)
    rows, columns = np.nonzero(amount >= THRESHOLD)
    if not len(rows):
        return np.full(2, np.nan), 0
    return np.array([left + columns.mean(), top + rows.mean()]), len(rows)
