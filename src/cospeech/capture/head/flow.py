"""Sparse optical flow, checked by tracking back and by comparing the windows.

References
----------
J.-Y. Bouguet, Pyramidal implementation of the Lucas Kanade feature tracker, Intel, 1999 (as implemented by OpenCV).
Z. Kalal, K. Mikolajczyk and J. Matas, Forward-backward error, ICPR 2010.
"""

from __future__ import annotations

import cv2
import numpy as np

from cospeech.capture.head.disparity import cut
from cospeech.data.arrays import Flags, Floats, Plane, Singles
from cospeech.kernels.jit import njit

HALF_WINDOW_PX = 8
"""Half the width of the window around a point, without its middle."""

THERE_AND_BACK_PX = 0.7
"""Largest distance between a point and where it comes back to."""

LEAST_ALIKE = 0.6
"""Smallest correlation of the windows around a point before and after."""

LEVELS = 3
"""Levels of the pyramid above the image itself."""

STOP = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 0.01)


def find_flow(before: Plane, after: Plane, pixels: Floats, expected: Floats) -> tuple[Floats, Flags]:
    """Return where points of one image are in another, (n, 2), and for which (n,) that is reliable.

    Parameters
    ----------
    before, after : (H, W) band-passed images.
    pixels : (n, 2) the points in ``before``. expected : (n, 2) where to begin the search in ``after``.
    """
    if not len(pixels):
        return pixels, np.zeros(0, dtype=bool)
    start = _list(pixels)
    there, went = _track(before, after, start, _list(expected))
    back, returned = _track(after, before, there, start.copy())
    found = there[:, 0].astype(float)
    off = np.linalg.norm((back - start)[:, 0], axis=1)
    good = (
        went & returned & (off <= THERE_AND_BACK_PX) & _alike(before, after, np.asarray(pixels, dtype=float), found)
    )
    return found, good


def _list(pixels: Floats) -> Singles:
    """Return points (n, 2) as OpenCV wants them, (n, 1, 2)."""
    return np.array(pixels, dtype=np.float32, order="C").reshape(-1, 1, 2)


def _track(before: Plane, after: Plane, start: Singles, guess: Singles) -> tuple[Singles, Flags]:
    """Return where points (n, 1, 2) went and which (n,) were found; ``guess`` is overwritten."""
    side = 2 * HALF_WINDOW_PX + 1
    found, went, _ = cv2.calcOpticalFlowPyrLK(
        before,
        after,
        start,
        guess,
        winSize=(side, side),
        maxLevel=LEVELS,
        criteria=STOP,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray(found, dtype=np.float32), np.asarray(went)[:, 0] == 1


@njit
def _alike(before: Plane, after: Plane, here: Floats, there: Floats) -> Flags:
    """Return which windows (n,) around points of two images correlate; none whose windows leave the images."""
    side = 2 * HALF_WINDOW_PX + 1
    height, width = before.shape
    one, other = np.empty((side, side)), np.empty((side, side))
    alike = np.zeros(len(here), dtype=np.bool_)
    for n in range(len(here)):
        x, y = min(here[n, 0], there[n, 0]) - HALF_WINDOW_PX, min(here[n, 1], there[n, 1]) - HALF_WINDOW_PX
        right, bottom = max(here[n, 0], there[n, 0]), max(here[n, 1], there[n, 1])
        if x < 0 or y < 0 or right + HALF_WINDOW_PX >= width - 1 or bottom + HALF_WINDOW_PX >= height - 1:
            continue
        cut(before, here[n, 0] - HALF_WINDOW_PX, here[n, 1] - HALF_WINDOW_PX, one)
        cut(after, there[n, 0] - HALF_WINDOW_PX, there[n, 1] - HALF_WINDOW_PX, other)
        a, b = one - one.mean(), other - other.mean()
        alike[n] = (a * b).sum() >= LEAST_ALIKE * np.sqrt((a * a).sum() * (b * b).sum()) + 1e-9
    return alike
