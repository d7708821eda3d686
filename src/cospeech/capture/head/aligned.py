"""Disparity relative to a known surface.

A window around a point of a curved or slanted surface has no single disparity, and what a search for one finds is
biased towards the mean. If the right image is first drawn as the left camera would see it, were the surface exactly
where it is believed to be, only the small error of that belief is left to be found.
"""

from __future__ import annotations

import cv2
import numpy as np

from cospeech.capture.head.bandpass import bandpass
from cospeech.capture.head.disparity import find_disparities
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.surface import Warped
from cospeech.data.arrays import Floats, Plane


class Aligned:
    """The right image of a pair as the left camera would see it, in the window of a drawn surface.

    Parameters
    ----------
    right : (H, W) luma of the right image. drawn : the surface. gain : that of the band-pass filter.
    """

    def __init__(self, right: Plane, drawn: Warped, optics: Optics, gain: float) -> None:
        self.corner = drawn.corner
        seen = np.isfinite(drawn.depths)
        typical = float(np.median(drawn.depths[seen]))
        self.expected = optics.disparities(np.where(seen, drawn.depths, typical)).astype(np.float32)
        rows, columns = np.indices(self.expected.shape, dtype=np.float32)
        across = columns + np.float32(drawn.corner[0]) - self.expected
        down = np.asarray(rows + np.float32(drawn.corner[1]))
        moved = cv2.remap(right, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        self.banded = bandpass(np.asarray(moved, dtype=np.uint8), gain)

    def disparities(self, banded: Plane, pixels: Floats, reach: int, half: int) -> Floats:
        """Return the disparities (n,) in pixels of points of the left image, NaN where they are not valid.

        Parameters
        ----------
        banded : (H, W) the band-passed left image in the window. pixels : (n, 2) points in the window, may be NaN.
        reach, half : see ``find_disparities``.
        """
        if not len(pixels):
            return np.zeros(0)
        remaining = find_disparities(banded, self.banded, pixels, np.zeros(len(pixels)), reach, half)
        places = np.nan_to_num(pixels).astype(np.float32)
        expected = cv2.remap(self.expected, places[:, None, 0], places[:, None, 1], cv2.INTER_LINEAR)
        return remaining + expected[:, 0]
