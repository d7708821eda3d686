"""An ellipsoid for the head, where a single camera leaves the depth of the face unknown.

Its width and its plane of symmetry are those of the skin, which a frontal face shows symmetrically: if the ellipsoid
is off by 4 % of its width to one side, turns of 30 degrees are wrong by 5.

Reference: S. Basu, I. Essa and A. Pentland, Motion regularization for model-based head tracking, ICPR 1996.
"""

from __future__ import annotations

import numpy as np

from cospeech.capture.head.face import Box
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.skin import Ellipse
from cospeech.data.arrays import Floats

PROPORTIONS = np.array([1.0, 2.1, 1.25])
"""Half axes of the ellipsoid relative to half the width of the head: across, upward, forward. From the forehead to
the chin, a face is less curved than a head as a whole, which is 1.5 times as tall as wide."""

ABOVE_BOX = 0.14
"""How far the middle of the ellipsoid lies above that of a detected face, in widths of the face."""


def depths(pixels: Floats, face: Box, ellipse: Ellipse, optics: Optics, head_width_m: float) -> Floats:
    """Return the depths (...) in metres at which the rays of pixels (..., 2) meet the head, NaN where they miss it.

    Parameters
    ----------
    face, ellipse : the detected face and the ellipse of its skin.
    head_width_m : width of the head, which sets the scale.
    """
    half_m = PROPORTIONS * head_width_m / 2
    distance = optics.focal_px[0] * head_width_m / (2.0 * ellipse.half_axes_px[1])
    place = np.array([ellipse.middle[0], face.middle[1] - ABOVE_BOX * face.width])
    centre = optics.points(place, np.array(distance)) / half_m
    ray = optics.points(pixels, np.ones(pixels.shape[:-1])) / half_m
    a, b = (ray * ray).sum(axis=-1), ray @ centre
    inside = b * b - a * (centre @ centre - 1.0)
    return np.where(inside > 0.0, (b - np.sqrt(np.maximum(inside, 0.0))) / a, np.nan)
