"""Align the face in each frame to that in the first one, by the quadratic motion model (Sargin 2006, 2.1.2).

A point (x, y) of the first frame is at (x + q . a, y + q . b) in another one, where q = (1, x, y, x^2, xy, y^2) is
its position relative to the middle of the face, in units of half the width of the face, and the 12 parameters a and b
are in pixels. This is the motion of a curved surface that turns a little.

The parameters, and a gain and an offset for the lighting, are those that minimise the robust (Geman-McClure)
difference from the first frame, over the face without the mouth. Gauss-Newton steps go through a Gaussian pyramid
from coarse to fine, beginning at the parameters of the frame before. Every frame is aligned to the first one, since
quadratic motions do not compose; in this way errors do not accumulate. The gradients are those of the first frame
(Hager and Belhumeur 1998), so that the matrix of the normal equations is inverted once per clip.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats, Plane, Singles
from cospeech.identity.lips import alignment_kernels as kernels
from cospeech.identity.lips.mouth import Face

LEVELS = 3
"""Number of levels of the pyramid."""
SMOOTHING_PX = 0.8
"""Standard deviation of the blur before the finest level: it makes up for interpolation between pixels."""
MOST_PIXELS = 6000
"""Number of pixels at a level that are used at most."""
MOST_STEPS = 30
"""Number of steps at a level at most."""
SMALL_STEP_PX = 0.02
"""Steps end when no point of the face moves further than this."""
STIFFNESS = 1e-4
"""Ridge, relative to the diagonal of the normal equations, that keeps what the picture does not show at zero."""

FACE_WIDTH, FACE_HEIGHT = 0.46, 0.58
"""Half the width and height of the ellipse that is aligned, in widths of the face."""
MOUTH_WIDTH, MOUTH_HEIGHT, BELOW = 0.30, 0.34, 0.20
"""Half the width and height of the ellipse that is left out, and how far it is below the mouth, likewise."""
LEAST_CORRELATION = 0.6
"""Correlation with the first frame below which a frame counts as not aligned."""
LARGEST_SHIFT = 0.6
"""Shift of the face from which on a frame counts as not aligned, in widths of the face."""


@dataclass(frozen=True)
class Level:
    """What the kernels need of the first frame at one level of the pyramid.

    Attributes
    ----------
    places : (N, 2) pixels of the face, x and y.
    points : (N, 2) the same in units of the model.
    values : (N,) luminance.
    gradients : (N, 2) its gradients over x and y.
    inverse : (14, 14) inverse of the matrix of the normal equations.
    """

    places: Singles
    points: Singles
    values: Singles
    gradients: Singles
    inverse: Floats


@dataclass(frozen=True)
class Reference:
    """The first frame, and the levels of its pyramid from coarse to fine; ``middle`` (2,) and ``unit`` in pixels."""

    levels: list[Level]
    middle: Floats
    unit: float


@dataclass(frozen=True)
class Aligned:
    """Where the face is in a frame.

    Attributes
    ----------
    motion : (2, 6) the parameters a and b in pixels.
    light : (2,) gain and offset relative to the first frame.
    correlation : that of the frame with the first one over the face.
    """

    motion: Floats
    light: Floats
    correlation: float

    def lost(self, face: Face) -> bool:
        """Return whether the face was not found in the frame."""
        shift = float(np.hypot(*self.motion[:, 0]))
        return not (self.correlation >= LEAST_CORRELATION and shift <= LARGEST_SHIFT * face.width)


STILL = Aligned(np.zeros((2, 6)), np.array([1.0, 0.0]), 1.0)


def pyramid(picture: Plane) -> list[Singles]:
    """Return a Gaussian pyramid of a picture (H, W), from coarse to fine."""
    finest = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), SMOOTHING_PX)
    levels = [np.asarray(finest, dtype=np.float32)]
    for _ in range(LEVELS - 1):
        levels.append(np.asarray(cv2.pyrDown(levels[-1]), dtype=np.float32))
    return levels[::-1]


def reference(picture: Plane, face: Face) -> Reference:
    """Prepare the first frame (H, W) of a clip with its face."""
    middle, unit = np.array([face.x, face.y]), face.width / 2
    levels = []
    for depth, level in zip(range(LEVELS - 1, -1, -1), pyramid(picture), strict=True):
        levels.append(_level(level, face, middle, unit, 2.0**depth))
    return Reference(levels, middle, unit)


def _level(picture: Singles, face: Face, middle: Floats, unit: float, step: float) -> Level:
    y, x = np.mgrid[1 : picture.shape[0] - 1, 1 : picture.shape[1] - 1].astype(float)
    used = np.flatnonzero(_is_aligned(x.ravel() * step, y.ravel() * step, face))
    used = used[:: max(1, -(-len(used) // MOST_PIXELS))]
    places = np.stack([x.ravel()[used], y.ravel()[used]], axis=1)
    points = (places * step - middle) / unit
    column, row = places.T.astype(int)
    gradients = np.stack(
        [picture[row, column + 1] - picture[row, column - 1], picture[row + 1, column] - picture[row - 1, column]],
        axis=1,
    ) / (2.0 * step)
    values = picture[row, column].astype(float)
    quadratic = monomials(points)
    # Changes of luminance per pixel of motion at the finest level, per gain and per unit of offset.
    changes = np.concatenate([gradients[:, :1] * quadratic, gradients[:, 1:] * quadratic], axis=1)
    jacobian = np.column_stack([changes, -values, -np.ones(len(values))])
    normal = jacobian.T @ jacobian
    inverse = np.linalg.inv(normal + STIFFNESS * np.diag(np.diag(normal)))
    single = [one.astype(np.float32) for one in (places, points, values, gradients)]
    return Level(single[0], single[1], single[2], single[3], inverse)


def _is_aligned(x: Floats, y: Floats, face: Face) -> npt.NDArray[np.bool_]:
    """Return whether pixels belong to what is aligned: the face without the mouth and what moves with it."""
    u, v = (x - face.x) / face.width, (y - face.y) / face.width
    own_u, own_v = (x - face.mouth_x) / face.width, (y - face.mouth_y) / face.width - BELOW
    on_face = (u / FACE_WIDTH) ** 2 + (v / FACE_HEIGHT) ** 2 < 1.0
    return on_face & ((own_u / MOUTH_WIDTH) ** 2 + (own_v / MOUTH_HEIGHT) ** 2 > 1.0)


def monomials(points: Floats) -> Floats:
    """Return (1, x, y, x^2, xy, y^2) of points (..., 2), (..., 6)."""
    x, y = points[..., 0], points[..., 1]
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def align(first: Reference, picture: Plane, start: Aligned) -> Aligned:
    """Return where the face of the first frame is in a picture (H, W).

    Parameters
    ----------
    start : where it was in the frame before.
    """
    parameters = np.concatenate([start.motion.ravel(), start.light])
    correlation = 0.0
    for depth, level, values in zip(range(LEVELS - 1, -1, -1), first.levels, pyramid(picture), strict=True):
        parameters, correlation = kernels.solve(
            values, level.places, level.points, level.values, level.gradients, level.inverse, parameters, 2.0**depth,
            MOST_STEPS, SMALL_STEP_PX * 2.0**depth,
        )  # fmt: skip
    return Aligned(parameters[:12].reshape(2, 6), parameters[12:], float(correlation))


def moved(first: Reference, aligned: Aligned, points_px: Floats) -> Floats:
    """Return where points (..., 2) of the first frame, x and y in pixels, are in an aligned one, (..., 2)."""
    return np.asarray(points_px + monomials((points_px - first.middle) / first.unit) @ aligned.motion.T)
