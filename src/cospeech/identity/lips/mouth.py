"""Find the face and its mouth in the first frame of a clip, and the middle of the mouth by its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import cv2
import dlib
import numpy as np

from cospeech.data.arrays import Floats, Plane, Singles
from cospeech.errors import UserError

DETECTION_PX = 480
"""Height of the picture in which faces are looked for: the detector needs faces of 80 pixels."""
SCALES = (1.0, 0.95, 0.91, 0.87)
"""Scales of the picture at which faces are looked for: the detector knows sizes in steps of 1.2 only."""
MOUTH_BELOW_TOP = 0.73
"""Usual place of the mouth in the box of the detector, in heights of the box."""
SEARCHED = 0.1
"""How far from there the mouth may well be, in heights of the box."""
MOUTH_HALF_WIDTH = 0.15
"""Half the width of the columns in which it is looked for, in widths of the box."""
SMOOTH = 0.012
"""Standard deviation of the blur before halves of a face are compared, in widths of the box."""
BLUR = 0.008
"""Standard deviation of the blur of the rows, in heights of the box."""
ASIDE = 0.06
"""How far to the left or right of the middle of the box the mouth is looked for, in widths of the box."""
SYMMETRIC_WIDTH, SYMMETRIC_HEIGHT = 0.36, 0.16
"""Half the width and height of the part around the mouth that is compared with its mirror image, likewise."""
MOUTH_BELOW_FACE = 0.30
"""How far the mouth is below the middle of the face, in widths of the face."""
TYPICAL_WIDTH_PX = 230.0
"""Width of the face around a stated mouth if no face is found: the lip region of the document fits such a face."""

MOVING = 6.0
"""Standard deviation over time, of 255, that the most moving twentieth of the region exceeds in speech."""
AXIS_PX, HALF_MOUTH_PX = 12, 54
"""How far from the middle of the region the axis of the mouth may be, and how far from the axis the mouth reaches."""
BLURRED_PX = 2.0
"""Standard deviation of the blur of the variance before its halves are compared."""
HALF_MIDDLE_PX = 32
"""Half the width of the columns in which its rows are compared."""
UPPER_SHARE = 0.3
"""Share of the motion that is above the middle of the mouth: the lower lip moves further than the upper one."""


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


def find(picture: Plane, where: str, centre: tuple[float, float] | None = None) -> Face:
    """Return the largest face in a picture (H, W).

    The box of the face gives the usual place of the mouth. Near it, the darkest row in the middle of the face is that
    between the lips, and the axis about which the face is most symmetric passes through their middle.

    Parameters
    ----------
    where : the film, for messages.
    centre : x and y of the middle of the mouth in pixels, if it is known.

    Raises
    ------
    UserError : if no face is found and ``centre`` is not given.
    """
    boxes = np.array([box for scale in SCALES if (box := _largest_box(picture, scale)) is not None])
    if not len(boxes):
        if centre is not None:
            return Face(centre[0], centre[1] - MOUTH_BELOW_FACE * TYPICAL_WIDTH_PX, TYPICAL_WIDTH_PX, *centre)
        raise UserError(
            f"{where}: no face, and so no mouth, in the first frame; cut the film so that it begins with a frontal "
            "face, or state the middle of the mouth (mouth_x_px, mouth_y_px)"
        )
    middle_x, middle_y, width = np.median(boxes, axis=0).tolist()
    if centre is not None:
        return Face(middle_x, middle_y, width, *centre)
    top = middle_y - width / 2
    mouth_y = _darkest_row(picture, middle_x, top, width)
    return Face(middle_x, middle_y, width, _axis_of_symmetry(picture, middle_x, mouth_y, width), mouth_y)


def _largest_box(picture: Plane, scale: float) -> tuple[float, float, float] | None:
    """Return the middle, x and y, and the width of the largest face that is found at a scale, None without any."""
    factor = scale * min(1.0, DETECTION_PX / picture.shape[0])
    small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA) if factor < 1.0 else picture
    boxes = _detector()(np.ascontiguousarray(small), 0)
    if not boxes:
        return None
    box = max(boxes, key=lambda one: one.area())
    size = box.right() - box.left() + 1
    middles = ((first + size / 2) / factor - 0.5 for first in (box.left(), box.top()))
    return next(middles), next(middles), size / factor


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
    likely = np.exp(-(((places - usual) / (SEARCHED * size)) ** 2))
    darkness: Floats = (coarse - fine) * likely
    return float(places[int(np.argmax(darkness))])


def _axis_of_symmetry(picture: Plane, middle_x: float, mouth_y: float, size: float) -> float:
    """Return the column about which the face around the mouth is most symmetric."""
    first, last = max(0, round(mouth_y - SYMMETRIC_HEIGHT * size)), round(mouth_y + SYMMETRIC_HEIGHT * size) + 1
    reach, most = round(SYMMETRIC_WIDTH * size), round(ASIDE * size)
    columns = [round(2 * middle_x) / 2 + half / 2 for half in range(-2 * most, 2 * most + 1)]
    inside = [x for x in columns if x - reach >= 0 and x + reach < picture.shape[1]]
    rows = cv2.GaussianBlur(picture[first:last].astype(np.float32), (0, 0), max(0.5, SMOOTH * size))

    def symmetry(x: float) -> float:
        strip = rows[:, int(np.ceil(x - reach)) : int(np.floor(x + reach)) + 1]
        return float(np.corrcoef(strip.ravel(), strip[:, ::-1].ravel())[0, 1]) if strip.std() > 0.0 else 0.0

    return max(inside, key=symmetry, default=middle_x)


def moving(regions: Singles, margin: int) -> tuple[float, float]:
    """Return how far the middle of a mouth that moves is to the right of the middle of a region, and below it.

    The mouth is what moves in an aligned face: the variance over time is symmetric about the axis of the mouth, and
    ``UPPER_SHARE`` of it lies above its middle. Both are found to a quarter of a pixel on virtual faces, the first
    frame alone gives them to two pixels.

    Parameters
    ----------
    regions : (T, H, W) aligned regions with a margin; NaN outside the picture.
    margin : number of pixels on each side, more than ``AXIS_PX``; the middle is looked for no further than that.

    Returns
    -------
    Pixels to the right and downward, 0 if the mouth does not move.
    """
    variance = np.nan_to_num(regions.var(axis=0))
    if np.quantile(variance, 0.95) < MOVING**2:
        return 0.0, 0.0
    middle = (variance.shape[1] - 1) / 2
    reach = min(HALF_MOUTH_PX, int(middle) - AXIS_PX)
    smooth = cv2.GaussianBlur(variance, (0, 0), BLURRED_PX)

    def symmetry(shift: float) -> float:
        first, last = math.ceil(middle + shift - reach), math.floor(middle + shift + reach) + 1
        return float(np.corrcoef(smooth[:, first:last].ravel(), smooth[:, first:last][:, ::-1].ravel())[0, 1])

    right = max((half / 2 for half in range(-2 * AXIS_PX, 2 * AXIS_PX + 1)), key=symmetry)
    centre = round(middle + right)
    rows = variance[:, centre - HALF_MIDDLE_PX : centre + HALF_MIDDLE_PX + 1].sum(axis=1)
    down = np.interp(UPPER_SHARE, np.cumsum(rows) / rows.sum(), np.arange(len(rows))) - (len(rows) - 1) / 2
    return right, float(np.clip(down, -margin, margin))
