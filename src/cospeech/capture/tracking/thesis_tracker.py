"""The plain tracker of the thesis: one window of 5x5 pixels for each marker in each view (Özkul 2012, 2.3 and 2.4).

Each view is tracked by itself: a marker's window stands where its last two positions lead to, and the mean of the
pixels that pass a colour threshold is its position. Where none passes, the window stays where it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cospeech.capture.tracking import blobs
from cospeech.capture.tracking.colour import Mixer
from cospeech.capture.tracking.detections import Sights
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera, project
from cospeech.geometry.triangulate import triangulate
from cospeech.motion.markers import MARKERS

HALF_WINDOW = 2
THRESHOLD = 0.3
"""Least share of the marker's colour, in full light, of a pixel that counts."""


class ThesisTracker:
    """Follows the markers of one take; see ``RobustTracker`` for the parameters."""

    def __init__(self, cameras: Sequence[Camera], first_m: Floats, mixers: Mapping[str, Mixer]) -> None:
        self.cameras = cameras
        self.mixers = [mixers[marker.colour] for marker in MARKERS]
        self.last = np.stack([project(camera, first_m) for camera in cameras], axis=1)
        self.shift = np.zeros_like(self.last)

    def step(self, pictures: Sequence[Planes], corrections: Sequence[tuple[int, int, float, float]] = ()) -> Sights:
        """Return the markers of the next frame, seen in one picture for each camera; see ``RobustTracker.step``."""
        pixels = np.full(self.last.shape, np.nan)
        n_pixels = np.zeros(self.last.shape[:2], dtype=np.int64)
        for marker, mixer in enumerate(self.mixers):
            for view, (planes, camera) in enumerate(zip(pictures, self.cameras, strict=True)):
                expected = self.last[marker, view] + self.shift[marker, view]
                pixels[marker, view], n_pixels[marker, view] = window_mean(planes, camera.size_px, mixer, expected)
        corrected = np.zeros(n_pixels.shape, dtype=bool)
        for marker, view, x, y in corrections:
            pixels[marker, view], corrected[marker, view] = (x, y), True
        seen = np.isfinite(pixels)
        self.shift = np.where(seen, pixels - self.last, 0.0)
        self.last = np.where(seen, pixels, self.last)
        points, used, residual = triangulate(self.cameras, pixels, np.inf)
        return Sights(pixels, n_pixels, corrected, used, points, residual)


def window_mean(planes: Planes, size_px: tuple[int, int], mixer: Mixer, expected: Floats) -> tuple[Floats, int]:
    """Return the mean pixel (2,) of one colour in the window around ``expected`` (2,), and how many pixels it is of.

    The mean is NaN where no pixel passes the threshold.
    """
    width, height = size_px
    if not (np.isfinite(expected).all() and np.abs(expected).max() < 1e6):
        return np.full(2, np.nan), 0
    column, row = (round(float(value)) for value in expected)
    left, top = max(0, column - HALF_WINDOW), max(0, row - HALF_WINDOW)
    right, bottom = min(width, column + HALF_WINDOW + 1), min(height, row + HALF_WINDOW + 1)
    if right <= left or bottom <= top:
        return np.full(2, np.nan), 0
    amount = blobs.shares(*planes, (left, top, right, bottom), mixer.across, mixer.share)
    rows, columns = np.nonzero(amount >= THRESHOLD)
    if not len(rows):
        return np.full(2, np.nan), 0
    return np.array([left + columns.mean(), top + rows.mean()]), len(rows)
