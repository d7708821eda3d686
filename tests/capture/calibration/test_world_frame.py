"""World frame: each kind of fact recovers a known similarity, and insufficient facts are rejected."""

import numpy as np
import pytest
from planted_rig import plant
from scipy.spatial.transform import Rotation

from cospeech.capture.calibration import world_frame
from cospeech.errors import UserError
from cospeech.geometry.camera import project
from cospeech.geometry.rigid import Similarity

AWAY = Similarity(0.4, Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix(), np.array([0.2, 1.5, -0.7]))


@pytest.fixture
def rig():
    truth, points, _ = plant(0, n_points=50)
    return truth, points, AWAY.cameras(truth), AWAY.points(points)


def distance(camera, other):
    return np.linalg.norm(camera.place_m - other.place_m)


def test_projections_do_not_depend_on_the_frame(rig):
    truth, points, moved, moved_points = rig
    for camera, away in zip(truth, moved, strict=True):
        np.testing.assert_allclose(project(away, moved_points), project(camera, points), atol=1e-8)


def stated(places_m):
    return [{"camera": name, "place_m": place} for name, place in places_m.items()]


NOWHERE = np.empty((0, 3)), np.empty(0, dtype=int)
MARKS_M = ([0, 0, 0], [0, 1.5, 0], [0.7, 1.5, 0], [0, 1.5, 0.7])


def touch(noise_m=0.0005):
    """Return facts, and positions (N, 3) in the frame ``AWAY`` of a spot that rests for 20 frames on each mark."""
    rng = np.random.default_rng(4)
    rests = np.repeat(np.array(MARKS_M, dtype=float), 20, axis=0)
    roaming = rng.uniform(-1, 1, (40, 3))
    points_m = np.concatenate([rests + rng.normal(0, noise_m, rests.shape), roaming])
    facts = [{"from_frame": 20 * k, "to_frame": 20 * k + 19, "place_m": mark} for k, mark in enumerate(MARKS_M)]
    return facts, AWAY.points(points_m), np.arange(len(points_m))


def test_touched_points_define_the_world_frame(rig):
    """With 0.5 mm of noise per frame, an outlier and gaps, points within 1 m are accurate to half a millimetre."""
    facts, points, frames = touch()
    points[3] += 0.003
    points[[25, 44]] = np.nan
    truth, points_m, moved, moved_points = rig
    change = world_frame.from_facts(moved, facts, points, frames)
    assert np.linalg.norm(change.points(moved_points) - points_m, axis=1).max() < 0.0005
    for camera, back in zip(truth, change.cameras(moved), strict=True):
        assert np.linalg.norm(back.place_m - camera.place_m) < 0.001


def test_invalid_touched_points_are_reported(rig):
    facts, points, frames = touch()
    wandering = points.copy()
    wandering[40:60] += AWAY.scale * np.linspace(0, 0.08, 20)[:, None] * [1, 0, 0]
    with pytest.raises(UserError, match=r"frames 40 to 59: the spot moves by 3\d mm"):
        world_frame.from_facts(rig[2], facts, wandering, frames)
    unseen = points.copy()
    unseen[62:80] = np.nan
    with pytest.raises(UserError, match="frames 60 to 79: two cameras see the spot in 2 of these frames"):
        world_frame.from_facts(rig[2], facts, unseen, frames)
    wrong = [*facts[:3], facts[3] | {"place_m": [0, 1.5, 0.9]}]
    with pytest.raises(UserError, match=r"frames 60 to 79: \d+ mm away from the stated position"):
        world_frame.from_facts(rig[2], wrong, points, frames)
    with pytest.raises(UserError, match="2 positions are stated"):
        world_frame.from_facts(rig[2], facts[:2], points, frames)


def test_camera_positions_define_the_world_frame(rig):
    truth, points, moved, moved_points = rig
    change = world_frame.from_facts(
        moved, stated({camera.name: camera.place_m.tolist() for camera in truth[:4]}), *NOWHERE
    )
    np.testing.assert_allclose(change.points(moved_points), points, atol=1e-9)
    for camera, back in zip(truth, change.cameras(moved), strict=True):
        np.testing.assert_allclose(back.pose, camera.pose, atol=1e-9)


def test_a_distance_sets_the_scale(rig):
    truth, _, moved, _ = rig
    facts = [{"distance_m": distance(truth[0], truth[4]), "between": ["c1", "c5"]}]
    back = world_frame.from_facts(moved, facts, *NOWHERE).cameras(moved)
    assert distance(back[1], back[2]) == pytest.approx(distance(truth[1], truth[2]))


@pytest.mark.parametrize(
    ("facts", "reason"),
    [
        (stated({"c1": [0, 0, 0], "c2": [1, 0, 0]}), "at least three"),
        (stated({"c1": [0, 0, 0], "c2": [1, 0, 0], "c3": [2, 0, 0]}), "lie on a line"),
        (stated({"c1": [0, 0, 0], "c2": [1, 0, 0], "c9": [2, 1, 0]}), "camera c9, but the rig has c1"),
        (stated({"c1": [0, 0, 0], "c2": [1, 0, 0], "c3": [0, 1, 0]}), r"camera c.: \d+ mm away"),
        ([{"distance_m": 2.0, "between": ["c1", "c7"]}], "camera c7"),
        (
            [*stated({"c1": [0, 0, 0]}), {"distance_m": 2.0, "between": ["c1", "c2"]}],
            "do not define one metric scale",
        ),
        ([], "do not define one metric scale"),
    ],
)
def test_insufficient_facts_are_rejected(rig, facts, reason):
    with pytest.raises(UserError, match=reason):
        world_frame.from_facts(rig[2], facts, *NOWHERE)
