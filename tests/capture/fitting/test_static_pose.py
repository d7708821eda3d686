"""The static pose is a mean; markers that move or are not seen are reported by name."""

import numpy as np
import pytest
import subject

from cospeech.capture.fitting.body_model import body_model
from cospeech.capture.fitting.static_pose import static_pose
from cospeech.errors import UserError
from cospeech.motion import markers


def test_the_mean_ignores_missing_positions():
    places = np.tile(np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 0.0]]), (40, 1, 1))
    places[::2, 0] += 0.002
    places[1::2, 1] = np.nan
    found = static_pose(places, ("a", "b", "c")[:2], 20.0, 1.0)
    np.testing.assert_allclose(found, [[1.001, 2.001, 3.001], [0.0, 1.0, 0.0]])


def test_a_marker_that_moves_or_is_never_seen_is_reported():
    places = subject.marked(subject.range_of_motion(6.0))
    with pytest.raises(UserError, match="'left_hand' moves by"):
        body_model(places, subject.FPS, 5.0)
    places[:40, markers.NAMES.index("left_elbow")] = np.nan
    with pytest.raises(UserError, match="'left_elbow' is not seen in the first 2 s"):
        body_model(places, subject.FPS, 2.0)


def test_a_trunk_with_two_markers_is_rejected():
    places = subject.marked(subject.range_of_motion(6.0))
    places[:, [markers.NAMES.index("back"), markers.NAMES.index("chest")]] = np.nan
    with pytest.raises(UserError, match=r"2 of the markers chest, back, left_shoulder, right_shoulder are seen"):
        body_model(places, subject.FPS, 2.0)


def test_a_marker_may_sway_by_fifteen_millimetres():
    sway = np.where(np.arange(40) % 2, 1.0, -1.0)[:, None, None] * np.array([1.0, 0.0, 0.0])
    places = np.array([[0.0, 1.0, 0.0]])
    np.testing.assert_allclose(static_pose(places + 0.014 * sway, ("a",), 20.0, 2.0), places, atol=1e-12)
    with pytest.raises(UserError, match="marker 'a' moves by 16 mm"):
        static_pose(places + 0.016 * sway, ("a",), 20.0, 2.0)


def test_the_hips_and_knees_scale_with_the_height_of_the_shoulders():
    places = subject.marked(subject.range_of_motion(), noise_m=0.0)
    adult, child = (body_model(size * places, subject.FPS, subject.STATIC_S) for size in (1.0, 0.7))
    np.testing.assert_allclose(child.offsets_m, 0.7 * adult.offsets_m, atol=1e-6)
    np.testing.assert_allclose(child.marker_places_m, 0.7 * adult.marker_places_m, atol=1e-6)
