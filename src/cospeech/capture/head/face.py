"""Detection of faces, by the frontal detector that comes with dlib.

It stands for the cascade of Viola and Jones in Sargin 2006, section 4.1.1, whose model OpenCV no longer ships.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import cv2
import dlib
import numpy as np

from cospeech.data.arrays import Plane

SMALLEST_PX = 80
"""Width of the smallest face that the detector finds."""

SEARCHED_PX = (320, 640)
"""Widths to which an image is scaled, one after the other until a face is found in it. A face narrower than an eighth
of the image, which only a larger scale would show, is too small to be measured."""

LEAST_SCORE = 0.4
"""Score of a detection from which it is taken for a face. Structures in the background reach 0.3."""


class Box(NamedTuple):
    """A rectangle in an image, in pixels."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """Width in pixels."""
        return self.right - self.left

    @property
    def middle(self) -> tuple[float, float]:
        """x and y of the middle."""
        return (self.left + self.right) / 2, (self.top + self.bottom) / 2


@functools.cache
def _detector() -> Any:
    return dlib.get_frontal_face_detector()


def find_faces(luma: Plane) -> list[Box]:
    """Return the faces in an image (H, W), from left to right. A box reaches from the brows to the chin.

    The smaller the image, the faster: larger scales are searched only if no face is found at smaller ones.
    """
    for width in SEARCHED_PX:
        scale = width / luma.shape[1]
        size = (width, round(luma.shape[0] * scale))
        scaled = cv2.resize(luma, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
        rectangles, scores, _ = _detector().run(np.ascontiguousarray(scaled), 0, LEAST_SCORE)
        if len(rectangles):
            boxes = [
                Box(*(side / scale for side in (r.left(), r.top(), r.right() + 1, r.bottom() + 1)))
                for r, _ in zip(rectangles, scores, strict=True)
            ]
            return sorted(boxes)
    return []
