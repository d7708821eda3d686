"""The optics of a rectified stereo pair, or of one camera, in axes of the person who faces it.

Points are in metres from the centre of projection of the left camera: x to the person's left (to the right in the
image), y up, and z from the image plane towards the camera, so that everything seen has a negative z. A camera that
looks at the person horizontally has the axes of the world (``geometry.camera``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import angles_deg

SHORTEST_BASELINE_M = 0.01
"""Baseline below which two cameras have no parallax to speak of."""

TURNED_DEG, OFF_AXIS, UNEQUAL = 0.1, 0.01, 1e-3
"""How far a rectified pair may deviate: rotation between its cameras, direction of its baseline, and difference of
focal lengths and image rows, relative to the focal length."""

RECTIFY = "rectify the films and the calibration (cv2.stereoRectify, cv2.remap) first"


@dataclass(frozen=True)
class Optics:
    """The left camera of a rectified pair, or a single camera.

    Attributes
    ----------
    size_px, focal_px, centre_px : as those of a ``Camera``.
    baseline_m : distance of the right camera; None if there is none.
    shift_px : x of the principal point in the left image less that in the right image: the disparity at infinity.
    """

    size_px: tuple[int, int]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    baseline_m: float | None = None
    shift_px: float = 0.0

    @property
    def numbers(self) -> Floats:
        """fx, fy, cx, cy, baseline in metres (0: none) and shift, (6,), for compiled functions."""
        return np.array([*self.focal_px, *self.centre_px, self.baseline_m or 0.0, self.shift_px])

    def disparities(self, depths_m: Floats) -> Floats:
        """Return the disparities in pixels, x in the left less x in the right image, at depths of a pair."""
        return self.focal_px[0] * (self.baseline_m or 0.0) / depths_m + self.shift_px

    def depths(self, disparities_px: Floats) -> Floats:
        """Return the depths in metres at disparities of a pair; NaN where a disparity is that of no point."""
        above = np.where(disparities_px > self.shift_px, disparities_px - self.shift_px, np.nan)
        return self.focal_px[0] * (self.baseline_m or 0.0) / above

    def points(self, pixels: Floats, depths_m: Floats) -> Floats:
        """Return the points (..., 3) at pixels (..., 2) and depths (...)."""
        x = (pixels[..., 0] - self.centre_px[0]) / self.focal_px[0] * depths_m
        y = (pixels[..., 1] - self.centre_px[1]) / self.focal_px[1] * depths_m
        return np.stack([x, -y, -depths_m], axis=-1)

    def pixels(self, points_m: Floats) -> Floats:
        """Return the pixels (..., 2) of points (..., 3) in the image of the left camera."""
        flat = points_m[..., :2] / -points_m[..., 2:]
        return np.stack([flat[..., 0], -flat[..., 1]], axis=-1) * self.focal_px + self.centre_px


def single(camera: Camera) -> Optics:
    """Return the optics of one camera.

    Raises
    ------
    UserError : if its lens distorts.
    """
    _check_lens(camera)
    return Optics(camera.size_px, camera.focal_px, camera.centre_px)


def rectified(cameras: Sequence[Camera]) -> tuple[Optics, int]:
    """Return the optics of a rectified pair, and which of the two cameras is the left one, seen from behind them.

    Raises
    ------
    UserError : if there are not two cameras, or if they are not rectified, have no baseline, or bear each other's
        names.
    """
    if len(cameras) != 2:
        raise UserError(f"calibration: {len(cameras)} cameras; a stereo pair has two, named after its two films")
    first, second = cameras
    for camera in cameras:
        _check_lens(camera)
    where = f"calibration: cameras {first.name} and {second.name}"
    if first.size_px != second.size_px:
        raise UserError(f"{where} have images of different size; {RECTIFY}")
    apart = first.rotation @ (second.place_m - first.place_m)
    baseline = float(np.linalg.norm(apart))
    if baseline < SHORTEST_BASELINE_M:
        raise UserError(
            f"{where} have no baseline: they are {1000 * baseline:.1f} mm apart; give their distance in metres in "
            "the translation"
        )
    turned = float(angles_deg(second.rotation @ first.rotation.T))
    if turned > TURNED_DEG:
        raise UserError(f"{where} are not rectified: one is turned by {turned:.2f} degrees; {RECTIFY}")
    off_axis = float(np.abs(apart[1:]).max() / baseline)
    if off_axis > OFF_AXIS:
        raise UserError(
            f"{where} are not rectified: the baseline deviates by {np.degrees(np.arcsin(min(off_axis, 1.0))):.1f} "
            f"degrees from the rows of the image; {RECTIFY}"
        )
    focal, centre = np.array([c.focal_px for c in cameras]), np.array([c.centre_px for c in cameras])
    if np.abs(focal[0] - focal[1]).max() > UNEQUAL * focal.min() or abs(centre[0, 1] - centre[1, 1]) > UNEQUAL * (
        focal.min()
    ):
        raise UserError(f"{where} are not rectified: focal lengths or principal points differ; {RECTIFY}")
    left = 0 if apart[0] > 0 else 1
    if (cameras[left].name.lower(), cameras[1 - left].name.lower()) == ("right", "left"):
        raise UserError(
            f"{where} are swapped: the one called 'left' stands on the right, seen from behind the cameras; exchange "
            "them in the calibration"
        )
    one, other = cameras[left], cameras[1 - left]
    return Optics(one.size_px, one.focal_px, one.centre_px, baseline, one.centre_px[0] - other.centre_px[0]), left


def _check_lens(camera: Camera) -> None:
    if any(camera.lens):
        raise UserError(
            f"calibration: camera {camera.name}: the lens distorts, which a rectified film does not; undistort the "
            "film and the calibration (cv2.undistort) first"
        )
