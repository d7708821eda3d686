"""Metre and axes: the planted similarity is undone by each kind of fact, and facts that tell too little refused."""

import numpy as np
import pytest
from planted_rig import plant
from scipy.spatial.transform import Rotation

from cospeech.capture import axes
from cospeech.capture.camera import project
from cospeech.errors import UserError

AWAY = axes.Similarity(0.4, Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix(), np.array([0.2, 1.5, -0.7]))


@pytest.fixture
def rig():
    truth, points, _ = plant(0, n_points=50)
    return truth, points, AWAY.cameras(truth), AWAY.points(points)


def distance(camera, other):
    return np.linalg.norm(camera.place_m - other.place_m)


def test_pictures_stay_the_same_in_another_frame(rig):
    truth, points, moved, moved_points = rig
    for camera, away in zip(truth, moved, strict=True):
        np.testing.assert_allclose(project(away, moved_points), project(camera, points), atol=1e-8)


def test_measured_places_give_metre_and_axes(rig):
    truth, points, moved, moved_points = rig
    change = axes.stated(moved, {"places_m": {camera.name: camera.place_m.tolist() for camera in truth[:4]}})
    np.testing.assert_allclose(change.points(moved_points), points, atol=1e-9)
    for camera, back in zip(truth, change.cameras(moved), strict=True):
        np.testing.assert_allclose(back.pose, camera.pose, atol=1e-9)


def test_a_distance_gives_the_metre(rig):
    truth, _, moved, _ = rig
    facts = {"distance_m": distance(truth[0], truth[4]), "between": ["c1", "c5"]}
    back = axes.stated(moved, facts).cameras(moved)
    assert distance(back[1], back[2]) == pytest.approx(distance(truth[1], truth[2]))


def test_a_wand_gives_the_metre(rig):
    moved_points = rig[3]
    ends = np.stack([moved_points[:20], moved_points[:20] + 0.4 * 0.5 * np.array([0.6, 0.0, 0.8])], axis=1)
    ends[3] = np.nan
    assert axes.by_wand(ends, 0.5).scale == pytest.approx(1 / 0.4)
    with pytest.raises(UserError, match="never seen together"):
        axes.by_wand(np.full((4, 2, 3), np.nan), 0.5)


def test_three_points_give_the_axes(rig):
    stated = np.array([[0.1, 0.2, 0.3], [1.1, 0.2, 0.4], [0.1, 0.2, 2.3]])
    origin, left, ahead = AWAY.points(stated)
    change = axes.by_points(origin, left, ahead)
    np.testing.assert_allclose(change.points(AWAY.points(stated)), 0.4 * (stated - stated[0]), atol=1e-9)
    assert np.linalg.det(change.rotation) == pytest.approx(1)
    with pytest.raises(UserError, match="on a line"):
        axes.by_points(origin, origin + 2 * (ahead - origin), ahead)


@pytest.mark.parametrize(
    ("facts", "reason"),
    [
        ({"places_m": {"c1": [0, 0, 0], "c2": [1, 0, 0]}}, "at least three"),
        ({"places_m": {"c1": [0, 0, 0], "c2": [1, 0, 0], "c3": [2, 0, 0]}}, "lie on a line"),
        ({"places_m": {"c1": [0, 0, 0], "c2": [1, 0, 0], "c9": [2, 1, 0]}}, "camera c9, the rig has c1"),
        ({"distance_m": 2.0, "between": ["c1", "c7"]}, "camera c7"),
        ({}, "give no metre"),
    ],
)
def test_facts_that_tell_too_little_are_refused(rig, facts, reason):
    with pytest.raises(UserError, match=reason):
        axes.stated(rig[2], facts)
