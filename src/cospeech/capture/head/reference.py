"""The reference frame: its face, the points that are tracked, and where they are in space."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cospeech.capture.head import ellipsoid, skin
from cospeech.capture.head import surface as face_surface
from cospeech.capture.head.aligned import Aligned
from cospeech.capture.head.bandpass import bandpass, gain_for
from cospeech.capture.head.disparity import find_disparities
from cospeech.capture.head.face import Box
from cospeech.capture.head.images import Planes
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import STILL
from cospeech.capture.head.skin import Ellipse, SkinColour
from cospeech.capture.head.surface import Surface
from cospeech.data.arrays import Flags, Floats, Plane

MOST_POINTS = 220
CELLS = 24
"""Cells of the grid of depths across the width of the face."""

HALF_WINDOW, LEAST_HALF_WINDOW_PX = 0.05, 5
"""Half the width of the window of a disparity, as a share of the width of the face, and the least it is set to."""

INSIDE = 0.92
"""Size of the ellipse that points are taken from, relative to the ellipse of the skin."""

GROWN = (0.15, 0.35, 0.15, 0.1)
"""How far skin is searched beyond a detected face to the left, top, right and bottom, in widths of the face."""

REFINEMENTS, REFINED_PX = 3, 4
"""How often the disparities of the reference are measured again relative to the surface found so far, and how far
they may then deviate from it, pixels."""

DEEP_M = 0.12
"""Largest difference in depth within a face."""


CENTRE_BEHIND_M = 0.09
"""How far the centre of the head lies behind the mean of the points of the face."""


@dataclass(frozen=True)
class Reference:
    """What is known about the face from the reference frame.

    Attributes
    ----------
    face, colour, ellipse : the detected face, the colour of its skin, and the ellipse of this colour.
    banded, gain : the band-passed left image, and the gain of the filter.
    surface : the surface of the face.
    pixels : (n, 2) points to track.
    points_m, normals : (n, 3) their places in space and the unit normals of the surface there.
    """

    face: Box
    colour: SkinColour
    ellipse: Ellipse
    banded: Plane
    gain: float
    surface: Surface
    pixels: Floats
    points_m: Floats
    normals: Floats

    @property
    def centre_m(self) -> Floats:
        """The supposed centre of the head (3,) behind the face."""
        return self.points_m.mean(axis=0) - [0.0, 0.0, CENTRE_BEHIND_M]

    @property
    def half_window(self) -> int:
        """Half the width of the window of a disparity, pixels."""
        return half_window(self.face)


def half_window(face: Box) -> int:
    """Return half the width of the window of a disparity on a face, pixels."""
    return max(LEAST_HALF_WINDOW_PX, round(HALF_WINDOW * face.width))


def search_region(face: Box) -> Box:
    """Return the region around a detected face in which its skin is searched: the head without the neck."""
    left, top, right, bottom = (share * face.width for share in GROWN)
    return Box(face.left - left, face.top - top, face.right + right, face.bottom + bottom)


def locate(planes: Planes, face: Box) -> tuple[SkinColour, Ellipse]:
    """Return the colour of the skin of a detected face and its ellipse; that of the box itself if none fits it."""
    _, cb, cr = planes
    colour = skin.learn(cb, cr, face)
    found = skin.find_ellipse(cb, cr, search_region(face), colour)
    of_box = skin.of_box(face)
    if found is None or not of_box.contains(found.middle[None])[0] or found.half_axes_px[1] < 0.25 * face.width:
        return colour, of_box
    return colour, found


def from_pair(left: Planes, right: Plane, face: Box, optics: Optics, expected_px: float) -> Reference:
    """Return the reference of a stereo pair.

    Parameters
    ----------
    left : the planes of the left image. right : luma (H, W) of the right image.
    expected_px : disparity of the face as a whole.
    """
    colour, ellipse = locate(left, face)
    gain = gain_for(left[0], inside(left[0].shape, ellipse))
    banded, other = bandpass(left[0], gain), bandpass(right, gain)
    columns, rows = _grid(face, ellipse)
    cells = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    depth = float(optics.depths(np.array(expected_px)))
    reach = int(np.ceil(abs(optics.disparities(np.array(depth)) - optics.disparities(np.array(depth + DEEP_M))))) + 3
    within = ellipse.contains(cells, 1.05)
    expected = np.where(within, expected_px, np.nan)
    disparities = find_disparities(banded, other, cells, expected, reach, 2 * half_window(face))
    shape = len(rows), len(columns)
    for _ in range(REFINEMENTS):
        depths = optics.depths(disparities).reshape(shape)
        supposed = face_surface.from_depths(optics, columns, rows, depths, extended=True)
        drawn = face_surface.warp(banded, supposed, optics, STILL, 0)
        if drawn is None:
            break
        aligned = Aligned(right, drawn, optics, gain)
        (x, y), (height, width) = drawn.corner, drawn.depths.shape
        window = np.ascontiguousarray(banded[y : y + height, x : x + width])
        own = np.where(within[:, None], cells, np.nan) - drawn.corner
        disparities = aligned.disparities(window, own, REFINED_PX, half_window(face))
    surface = face_surface.from_depths(optics, columns, rows, optics.depths(disparities).reshape(shape))
    return _with_points(face, colour, ellipse, banded, gain, surface)


def from_one(planes: Planes, face: Box, optics: Optics, head_width_m: float) -> Reference:
    """Return the reference of a single camera, with the depth of an ellipsoid as wide as a head."""
    colour, ellipse = locate(planes, face)
    gain = gain_for(planes[0], inside(planes[0].shape, ellipse))
    columns, rows = _grid(face, ellipse)
    cells = np.stack(np.meshgrid(columns, rows), axis=-1)
    depths = ellipsoid.depths(cells, face, ellipse, optics, head_width_m)
    depths = np.where(ellipse.contains(cells.reshape(-1, 2), 1.05).reshape(depths.shape), depths, np.nan)
    surface = Surface(columns, rows, optics.points(cells, depths))
    return _with_points(face, colour, ellipse, bandpass(planes[0], gain), gain, surface)


def corners(banded: Plane, region: Flags, face: Box) -> Floats:
    """Return up to ``MOST_POINTS`` points (n, 2) of a band-passed image where the flow is well determined."""
    distance = max(3.0, 0.035 * face.width)
    mask = region.astype(np.uint8)
    found = cv2.goodFeaturesToTrack(banded, MOST_POINTS, 0.003, distance, mask=mask, blockSize=5)
    return np.zeros((0, 2)) if found is None else found[:, 0].astype(float)


def _with_points(
    face: Box, colour: SkinColour, ellipse: Ellipse, banded: Plane, gain: float, surface: Surface
) -> Reference:
    pixels = corners(banded, inside(banded.shape, ellipse, INSIDE), face)
    points, normals = surface.at(pixels), surface.normals(pixels)
    known = np.isfinite(points).all(axis=1) & np.isfinite(normals).all(axis=1)
    return Reference(face, colour, ellipse, banded, gain, surface, pixels[known], points[known], normals[known])


def inside(shape: tuple[int, ...], ellipse: Ellipse, scale: float = 1.0) -> Flags:
    """Return which pixels (H, W) of an image lie in an ellipse."""
    v, u = np.indices(shape).astype(float)
    return ellipse.contains(np.stack([u.ravel(), v.ravel()], axis=1), scale).reshape(shape)


def _grid(face: Box, ellipse: Ellipse) -> tuple[Floats, Floats]:
    """Return the columns and rows of a grid that covers the ellipse of the face."""
    step = max(2.0, face.width / CELLS)
    half = np.sqrt(4.0 * np.diag(np.linalg.inv(ellipse.precision))) + 2.0 * step
    axes = [
        ellipse.middle[axis] + step * np.arange(-np.ceil(half[axis] / step), np.ceil(half[axis] / step) + 1)
        for axis in (0, 1)
    ]
    return axes[0], axes[1]
