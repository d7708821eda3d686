"""From points of the face before and after a motion to the pose of the head."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cospeech.capture.head import skin
from cospeech.capture.head.face import Box
from cospeech.capture.head.images import Frame
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import SAMPLE_SIZE, STILL, Pose, RigidFit, consensus, fit_in_space
from cospeech.capture.head.reference import Reference
from cospeech.data.arrays import Flags, Floats, Singles
from cospeech.geometry.rotation import to_euler

FEWEST_POINTS = 12
"""Number of points that must agree on a pose."""

FEWEST_AGREE, FEWEST_FOUND = 0.35, 0.15
"""Share that they must be of the matched points, and of the points that were looked for."""

THRESHOLD, LEAST_THRESHOLD_PX = 0.009, 1.0
"""Tolerance of an ``Estimator``, and the least number of pixels that it is set to."""

MODEL_ERROR = 0.03
"""The same with a model of the head instead of disparities."""

SKIN_MARGIN = 1.25
"""How much the ellipse of the skin is enlarged before points outside it are left out."""

AROUND = 0.25
"""How far around its last place the head is searched, in widths of the face."""


class Measurement(NamedTuple):
    """The head in one frame.

    Attributes
    ----------
    pose : from the reference frame; None if it could not be measured.
    angles_deg : (3,) Euler angles x, y, z.
    n_points, residual_m : points that the pose rests on, and their root mean square distance from it in metres.
    seen : (n, 2) where the points of the reference are, in pixels, NaN where not found; None for a stereo pair.
    """

    pose: Pose | None
    angles_deg: Floats
    n_points: int
    residual_m: float
    seen: Singles | None = None


MISSING = Measurement(None, np.full(3, np.nan), 0, np.nan)


class Matches(NamedTuple):
    """Points found again.

    Attributes
    ----------
    points_m : (n, 3) places before the motion. seen : (n, 3) x, y and disparity after it, in pixels; the disparity
        may be NaN.
    n_tried : number of points that were looked for.
    """

    points_m: Floats
    seen: Floats
    n_tried: int


@dataclass
class State:
    """What earlier frames tell: the last pose and angles of the head, and for how many frames it has been missing."""

    pose: Pose = STILL
    angles_deg: Floats = field(default_factory=lambda: np.zeros(3))
    n_missed: int = 0


@dataclass(frozen=True)
class Estimator:
    """Estimates poses of one head.

    Attributes
    ----------
    optics, reference : the camera, and the face in the reference frame. rigid : how points that agree are fitted.
    tolerance : largest distance of a point from where the pose puts it, in widths of the face.
    """

    optics: Optics
    reference: Reference
    rigid: RigidFit
    tolerance: float

    def measure(self, matches: Matches, expected: Pose) -> Measurement:
        """Return the motion that the matches agree on, if enough do; the search for it starts at ``expected``."""
        if len(matches.points_m) < FEWEST_POINTS:
            return MISSING
        threshold = max(LEAST_THRESHOLD_PX, self.tolerance * self.reference.face.width)
        pose, agreeing = consensus(matches.points_m, matches.seen, self.optics.numbers, expected, threshold)
        fewest = max(FEWEST_POINTS, FEWEST_AGREE * len(agreeing), FEWEST_FOUND * matches.n_tried)
        if agreeing.sum() < fewest:
            return MISSING
        points, seen = matches.points_m[agreeing], matches.seen[agreeing]
        measured = np.isfinite(seen[:, 2])
        if self.rigid is not RigidFit.REPROJECTION and measured.sum() >= SAMPLE_SIZE:
            pose = fit_in_space(points[measured], self._places(seen[measured]), self.rigid)
        off = self._off_m(pose.points(points), seen)
        return Measurement(pose, euler(pose), int(agreeing.sum()), float(np.sqrt(np.mean(off**2))))

    def shift_px(self, before: Pose, after: Pose) -> float:
        """Return how far the points of the face move in the image from one pose to another, on average."""
        one, other = (self.optics.pixels(pose.points(self.reference.points_m)) for pose in (before, after))
        return float(np.linalg.norm(other - one, axis=1).mean())

    def region(self, pose: Pose) -> Box:
        """Return where the head may be a frame after it had a pose."""
        pixels = self.optics.pixels(pose.points(self.reference.points_m))
        (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
        around = AROUND * self.reference.face.width
        return Box(left - around, top - around, right + around, bottom + around)

    def on_skin(self, frame: Frame, pixels: Floats, pose: Pose) -> Flags:
        """Return which points (n, 2) lie in the ellipse of the skin near the last pose; all if there is none."""
        found = skin.find_ellipse(*frame.left[1:], self.region(pose), self.reference.colour)
        return np.ones(len(pixels), dtype=bool) if found is None else found.contains(pixels, SKIN_MARGIN)

    def _places(self, seen: Floats) -> Floats:
        """Return the places (n, 3) of points with x, y and disparity (n, 3)."""
        return self.optics.points(seen[:, :2], self.optics.depths(seen[:, 2]))

    def _off_m(self, moved: Floats, seen: Floats) -> Floats:
        """Return the distances (n,) of points from where they are seen; across the line of sight without depth."""
        measured = np.isfinite(seen[:, 2])
        if measured.any():
            return np.linalg.norm(moved[measured] - self._places(seen[measured]), axis=1)
        across = (self.optics.pixels(moved) - seen[:, :2]) * -moved[:, 2:] / self.optics.focal_px
        return np.linalg.norm(across, axis=1)


def euler(pose: Pose) -> Floats:
    """Return the Euler angles (3,) of a pose in degrees: R = Rx Ry Rz (4.3, 4.4 with the quadrants of atan2)."""
    return to_euler("XYZ", pose.rotation)
