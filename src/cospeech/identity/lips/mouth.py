"""Find the face and its mouth in the first frame of a clip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import dlib
import numpy as np

from cospeech.data.arrays import Floats, Plane
from cospeech.errors import UserError

DETECTION_PX = 480
"""Height of the picture in which faces are looked for: the detector needs faces of 80 pixels."""
MOUTH_BELOW_TOP = 0.79
"""Usual place of the mouth in the box of the detector, in heights of the box."""
SEARCHED = 0.10
"""How far from there the mouth is looked for, in heights of the box."""
MOUTH_HALF_WIDTH = 0.15
"""Half the width of the columns in which it is looked for, in widths of the box."""
BLUR = 0.025
"""Standard deviation of the blur of the rows, in heights of the box."""
MOUTH_BELOW_FACE = 0.30
"""How far the mouth is below the middle of the face, in widths of the face."""
TYPICAL_WIDTH_PX = 170.0
"""Width of the face if only the middle of the mouth is stated: the lip region of the document fits such a face."""


@dataclass(frozen=True)
class Face:
    """A face in a picture, in pixels: its middle, its width, and the middle of the mouth."""

    x: float
    y: float
    width: float
    mouth_x: float
    mouth_y: float

    def scaled(self, factor: float) -> Face:
        """Return the face in a picture that is ``factor`` times as large; pixel centres are whole numbers."""
        x, y, mouth_x, mouth_y = (
            (place + 0.5) * factor - 0.5 for place in (self.x, self.y, self.mouth_x, self.mouth_y)
        )
        return Face(x, y, self.width * factor, mouth_x, mouth_y)


@cache
def _detector() -> dlib.fhog_object_detector:
    return dlib.get_frontal_face_detector()


def find(picture: Plane, where: str) -> Face:
    """Return the largest face in a picture (H, W).

    The box of the face gives the usual place of the mouth; around it, the darkest row in the middle of the face is
    that between the lips.

    Parameters
    ----------
    where : the film, for messages.

    Raises
    ------
    UserError : if there is no face.
    """
    factor = min(1.0, DETECTION_PX / picture.shape[0])
    small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA) if factor < 1.0 else picture
    boxes = _detector()(np.ascontiguousarray(small), 0 if factor < 1.0 or picture.shape[0] >= 240 else 1)
    if not boxes:
        raise UserError(
            f"{where}: no face, and so no mouth, in the first frame; cut the film so that it begins with a frontal "
            "face, or state the middle of the mouth (mouth_x_px, mouth_y_px)"
        )
    box = max(boxes, key=lambda one: one.area())
    left, top, width = box.left() / factor, box.top() / factor, box.width() / factor
    middle_x, middle_y = left + width / 2 - 0.5, top + width / 2 - 0.5
    return Face(middle_x, middle_y, width, middle_x, _darkest_row(picture, middle_x, top, width))


def _darkest_row(picture: Plane, middle_x: float, top: float, size: float) -> float:
    """Return the row of the mouth: that which is darker than those around it."""
    usual = top + MOUTH_BELOW_TOP * size
    columns = slice(max(0, round(middle_x - MOUTH_HALF_WIDTH * size)), round(middle_x + MOUTH_HALF_WIDTH * size) + 1)
    first, last = (
        max(0, round(usual - 2 * SEARCHED * size)),
        min(len(picture), round(usual + 2 * SEARCHED * size) + 1),
    )
    if last - first < 5:
        return usual
    rows = picture[first:last, columns].mean(axis=1, keepdims=True).astype(np.float32)
    fine, coarse = (
        cv2.GaussianBlur(rows, (1, 0), sigmaX=1.0, sigmaY=sigma * size)[:, 0] for sigma in (BLUR, 4 * BLUR)
    )
    places = np.arange(first, last)
    near = np.abs(places - usual) <= SEARCHED * size
    darkness: Floats = np.where(near, coarse - fine, -np.inf)
    return float(places[int(np.argmax(darkness))])


def stated(mouth_x: float, mouth_y: float) -> Face:
    """Return the face around a mouth whose middle is stated, of the size that the document assumes."""
    width = TYPICAL_WIDTH_PX
    return Face(mouth_x, mouth_y - MOUTH_BELOW_FACE * width, width, mouth_x, mouth_y)
