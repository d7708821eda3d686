"""The shape of a face from its motion in the film of a single camera, with planted points."""

import numpy as np
import pytest

from cospeech.capture.head import shape
from cospeech.capture.head.estimate import MISSING, Measurement, euler
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import Pose
from cospeech.geometry.rotation import from_euler

OPTICS = Optics((640, 480), (800.0, 800.0), (320.0, 240.0))


def planted(amplitude_deg, n_frames=40, noise_px=0.0):
    """True points, supposed ones on the same rays (a tilted face), and measurements with rough poses."""
    rng = np.random.default_rng(1)
    flat = rng.uniform(-0.07, 0.07, (80, 2))
    true = np.column_stack([flat, -0.7 - 4.0 * (flat**2).sum(axis=1)])
    tilted = true[:, 2] - 0.06 * flat[:, 0] + rng.normal(0.0, 0.002, 80)
    supposed = true * (tilted / true[:, 2])[:, None]
    angles = amplitude_deg * np.sin(np.arange(n_frames)[:, None] * (0.21, 0.34, 0.13))
    measured = []
    for angle in angles:
        turn = from_euler("XYZ", angle)
        pose = Pose(turn, true.mean(axis=0) - turn @ true.mean(axis=0) + 0.01 * np.sin(angle))
        seen = OPTICS.pixels(pose.points(true)) + rng.normal(0.0, noise_px, (80, 2))
        seen[rng.random(80) < 0.2] = np.nan
        seen[:3] += 15.0  # the mouth
        start = Pose(from_euler("XYZ", angle + rng.normal(0.0, 1.5, 3)), pose.shift_m)
        measured.append(Measurement(start, euler(start), 80, 0.0, seen))
    return true, supposed, measured


def depth_errors(points, true):
    """Errors of depths in metres, apart from the scale, which a single camera does not see."""
    ratio = points[3:, 2] / true[3:, 2]
    return (ratio / ratio.mean() - 1.0) * 0.7


def test_depths_follow_from_the_motion():
    true, supposed, measured = planted(20.0)
    assert np.abs(depth_errors(supposed, true)).mean() > 0.002
    found = shape.refined_points(supposed, measured, OPTICS)
    assert np.abs(depth_errors(found, true)).max() < 1e-4
    np.testing.assert_allclose(OPTICS.pixels(found), OPTICS.pixels(true), atol=1e-9)


def test_a_head_that_does_not_turn_keeps_the_supposed_shape():
    _, supposed, measured = planted(0.0, noise_px=0.3)
    found = shape.refined_points(supposed, measured, OPTICS)
    assert np.abs(found[3:, 2] - supposed[3:, 2]).max() < 0.004


@pytest.mark.parametrize("frames", [1, 40])
def test_frames_that_determine_the_shape_are_spread_over_those_with_a_pose(frames):
    *_, measured = planted(20.0, n_frames=frames)
    assert shape.chosen([MISSING, *measured, MISSING], most=10)[0] is measured[0]
    assert len(shape.chosen([MISSING, *measured], most=10)) == min(frames, 10)
