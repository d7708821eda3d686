"""Elbow centres are recovered wherever their markers sit on the arm."""

import numpy as np
import pytest
import subject

from cospeech.capture.fitting.body_model import NAMES, body_model
from cospeech.capture.fitting.elbows import LEAST_ARC_DEG, circle_centre, refine_elbows
from cospeech.studio import dress, range_of_motion

TRUE_M = 0.29


@pytest.mark.parametrize("up_m", [-0.012, 0.015])
def test_an_elbow_is_located_whether_its_marker_sits_above_or_below(up_m):
    worn = dress.places("ada", 1)
    worn[7:9, 1] = -TRUE_M + up_m
    places = dress.wear(range_of_motion.perform(subject.FPS), worn)
    places += np.random.default_rng(0).normal(0.0, 0.0005, places.shape)
    first = body_model(places, subject.FPS, subject.STATIC_S)
    found = refine_elbows(first, places)
    for side in ("left", "right"):
        forearm = NAMES.index(f"{side}_forearm")
        assert abs(-first.offsets_m[forearm, 1] - TRUE_M) > 0.009
        assert -found.offsets_m[forearm, 1] == pytest.approx(TRUE_M, abs=0.003)
        assert found.offsets_m[forearm, 2] == pytest.approx(0.0, abs=0.003)


def test_the_hand_markers_keep_their_positions_in_the_static_pose():
    places = dress.wear(range_of_motion.perform(subject.FPS), dress.places("deniz", 1))
    first = body_model(places, subject.FPS, subject.STATIC_S)
    found = refine_elbows(first, places)
    for hand, part in ((9, "left_forearm"), (10, "right_forearm")):
        before, after = (model.offsets_m[NAMES.index(part)] + model.marker_places_m[hand] for model in (first, found))
        np.testing.assert_allclose(after, before, atol=1e-12)


def test_a_circle_is_fitted_despite_outliers_but_not_to_a_short_arc():
    angle = np.radians(np.linspace(0.0, 100.0, 80))
    points = np.array([0.01, -0.3]) + 0.26 * np.column_stack([np.sin(angle), -np.cos(angle)])
    points[::9] += 0.05
    points[3] = np.nan
    start = np.array([0.0, -0.28])
    np.testing.assert_allclose(circle_centre(points, start), [0.01, -0.3], atol=0.001)
    few = points[np.degrees(angle) < LEAST_ARC_DEG / 2]
    assert (circle_centre(few, start) == start).all()
