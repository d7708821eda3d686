"""The optics of a pair against the camera model, and calibrations that are refused."""

from dataclasses import replace

import numpy as np
import planted_head
import pytest

from cospeech.capture.head import optics
from cospeech.errors import UserError
from cospeech.geometry.camera import project

CAMERAS = planted_head.cameras(640)


def moved(camera, **changes):
    return replace(camera, **changes)


def test_points_pixels_and_disparities_are_those_of_the_cameras():
    left, right = CAMERAS
    right = moved(right, centre_px=(right.centre_px[0] - 7.0, right.centre_px[1]))
    own, first = optics.rectified([right, left])
    assert first == 1
    points = np.random.default_rng(0).normal(0, 0.1, (50, 3))
    seen, other = project(left, points), project(right, points)
    disparity = seen[:, 0] - other[:, 0]
    in_axes = points - left.place_m
    np.testing.assert_allclose(own.pixels(in_axes), seen, atol=1e-9)
    np.testing.assert_allclose(own.disparities(-in_axes[:, 2]), disparity, atol=1e-9)
    np.testing.assert_allclose(own.points(seen, own.depths(disparity)), in_axes, atol=1e-12)
    assert np.isnan(own.depths(np.array([own.shift_px, own.shift_px - 1]))).all()


LEFT, RIGHT = CAMERAS
REFUSED = {
    "no baseline: they are 0.0 mm apart": (LEFT, moved(RIGHT, shift_m=LEFT.shift_m)),
    "one is turned by 1.00 degrees": (LEFT, moved(RIGHT, turn=(np.pi + np.radians(1.0), 0.0, 0.0))),
    "the baseline deviates by 5.7 degrees": (LEFT, moved(RIGHT, shift_m=(-0.05, 0.01, 0.8))),
    "focal lengths or principal points differ": (LEFT, moved(RIGHT, focal_px=(880.0, 880.0))),
    "the lens distorts": (LEFT, moved(RIGHT, lens=(0.1, 0.0, 0.0, 0.0, 0.0))),
    "images of different size": (LEFT, moved(RIGHT, size_px=(320, 240))),
    "are swapped": (moved(RIGHT, name="left"), moved(LEFT, name="right")),
    "1 cameras; a stereo pair has two": (LEFT,),
}


@pytest.mark.parametrize(("message", "cameras"), REFUSED.items(), ids=list(REFUSED))
def test_a_calibration_that_is_not_that_of_a_rectified_pair_is_refused(message, cameras):
    with pytest.raises(UserError, match=message):
        optics.rectified(cameras)
