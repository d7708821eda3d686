"""How the right image of a rectified pair lies to the left one, and what is wrong if it does not fit."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from cospeech.capture.head.bandpass import bandpass, gain_for
from cospeech.capture.head.face import Box
from cospeech.capture.head.flow import find_flow
from cospeech.capture.head.optics import RECTIFY, Optics
from cospeech.data.arrays import Plane
from cospeech.errors import UserError

DARK_LEVEL, DARK_SPREAD = 20.0, 4.0
"""Mean and standard deviation of the grey levels of an image below which nothing can be seen in it."""

ROWS_OFF = 0.04
"""How far the rows of the two images may be apart for the face to be found, as a share of the image height."""

ALIKE = 0.45
"""Smallest correlation of the face in both images."""

UNRECTIFIED = 0.002
"""Largest median difference in rows of the same point in both images, as a share of the image width."""

NEAREST_M, FARTHEST_M = 0.2, 4.0
"""Distances at which a face can be measured."""

GRID = 9
"""Number of points across the face whose rows are compared."""


class Views(NamedTuple):
    """Luma (H, W) of the left and right image of one frame, and where they come from, for messages."""

    left: Plane
    right: Plane
    where: str


def is_dark(luma: Plane) -> bool:
    """Return whether nothing can be seen in an image (H, W)."""
    return bool(luma.mean() < DARK_LEVEL and luma.std() < DARK_SPREAD)


def check_light(luma: Plane, where: str) -> None:
    """Raise UserError if an image (H, W), described by ``where``, is dark."""
    if is_dark(luma):
        raise UserError(f"{where}: the image is dark; take off the lens cap, light the face, or film again")


def face_disparity(views: Views, face: Box, optics: Optics) -> float:
    """Return the disparity in pixels of a face detected in the left image.

    Raises
    ------
    UserError : if one image is dark, if the face is not found in the right image or is impossibly near or far, or if
        the images are swapped or not rectified.
    """
    check_light(views.left, f"{views.where}, left film")
    check_light(views.right, f"{views.where}, right film")
    height, width = views.left.shape
    x, y = (max(0, round(side)) for side in face[:2])
    right, bottom = min(width, round(face.right)), min(height, round(face.bottom))
    region = np.zeros(views.left.shape, dtype=bool)
    region[y:bottom, x:right] = True
    gain = gain_for(views.left, region)
    banded, other = bandpass(views.left, gain), bandpass(views.right, gain)
    slack = round(ROWS_OFF * height)
    top = max(0, y - slack)
    alike = cv2.matchTemplate(other[top : bottom + slack], banded[y:bottom, x:right], cv2.TM_CCOEFF_NORMED)
    _, best, _, (found_x, found_y) = cv2.minMaxLoc(alike)
    disparity, rows_off = float(x - found_x), found_y + top - y
    if best < ALIKE:
        raise UserError(
            f"{views.where}: the face of the left film is not seen in the right one at the same height; film both at "
            f"the same time, and {RECTIFY}"
        )
    grid = np.stack(
        np.meshgrid(np.linspace(x, right, GRID + 2)[1:-1], np.linspace(y, bottom, GRID + 2)[1:-1]), axis=-1
    )
    points = grid.reshape(-1, 2)
    there, good = find_flow(banded, other, points, points - [disparity, -rows_off])
    rows = np.median((there - points)[good, 1]) if good.sum() > GRID else float(rows_off)
    if abs(rows) > max(0.5, UNRECTIFIED * width):
        raise UserError(
            f"{views.where}: not rectified: the same points are {abs(rows):.1f} pixels "
            f"{'lower' if rows > 0 else 'higher'} in the right film; {RECTIFY}"
        )
    _check_depth(disparity, optics, views.where)
    return disparity


def _check_depth(disparity: float, optics: Optics, where: str) -> None:
    if disparity <= optics.shift_px:
        raise UserError(
            f"{where}: the face lies further to the right in the right film than in the left one, as if behind the "
            "camera: the films are swapped; exchange left and right"
        )
    depth = float(optics.depths(np.array(disparity)))
    if not NEAREST_M <= depth <= FARTHEST_M:
        raise UserError(
            f"{where}: the disparity of {disparity:.1f} pixels puts the face at {depth:.2f} m; give the baseline in "
            "metres and the focal length in pixels of these films"
        )
