"""The films of the studio: markers are at their true positions, limbs occlude them, and bytes are reproducible."""

import numpy as np
import pytest

from cospeech.geometry.camera import project
from cospeech.motion import skeleton
from cospeech.motion.markers import NAMES, RADIUS_M
from cospeech.studio import dress, film, rig, stage

AWAY_M = np.array([60.0, 0.0, -20.0])
LEFT_ARM, LEFT_FOREARM = skeleton.JOINTS.index("left_arm"), skeleton.JOINTS.index("left_forearm")


@pytest.fixture(scope="module")
def scene():
    angles = np.zeros((2, len(skeleton.JOINTS), 3))
    angles[1, LEFT_ARM] = (-40.0, 10.0, 20.0)
    angles[1, LEFT_FOREARM] = (-80.0, 0.0, 0.0)
    motion = skeleton.motion_table(np.zeros((2, 3)), angles, rig.FPS)
    return stage.limbs(motion), dress.wear(motion, dress.places("ada", 1))


@pytest.mark.parametrize("width_px", [1392, 696])
def test_centroid_of_a_whole_marker_is_its_projected_centre(width_px, scene):
    limbs, markers = scene
    alone = limbs + AWAY_M  # no body in view, so that nothing occludes or touches a marker
    camera = rig.cameras(width_px, 3)[2]
    point = markers[:1] + AWAY_M
    point[0, NAMES.index("left_hand")] = (0.4, 1.2, 0.3)
    planes, seen = next(film.frames(camera, alone[:1], point, 1, noise=0.0))
    truth = project(camera, point[0, NAMES.index("left_hand")])
    red = np.clip(planes[2].astype(float) - 128.0, 0.0, None)
    rows, columns = np.indices(red.shape)
    found = np.array([(columns * red).sum(), (rows * red).sum()]) / red.sum()
    assert np.hypot(*(found - truth)) < 0.1
    distance = np.linalg.norm(point[0, NAMES.index("left_hand")] - camera.place_m)
    assert seen[NAMES.index("left_hand")] == pytest.approx(
        np.pi * (camera.focal_px[0] * RADIUS_M / distance) ** 2, rel=0.05
    )


def test_the_body_occludes_the_marker_behind_it(scene):
    limbs, markers = scene
    _, seen = next(film.frames(rig.cameras(696, 3)[2], limbs[:1], markers[:1], 1))
    assert seen[NAMES.index("back")] == 0
    assert seen[NAMES.index("chest")] > 0


def test_films_are_reproducible_and_close_to_the_drawn_planes(scene, tmp_path):
    camera = rig.cameras(348, 3)[1]
    drawn = [planes.copy() for planes, _ in film.frames(camera, *scene, 1)]
    for name in ("a.mkv", "b.mkv"):
        film.encode(tmp_path / name, (planes for planes, _ in film.frames(camera, *scene, 1)), rig.FPS)
    assert (tmp_path / "a.mkv").read_bytes() == (tmp_path / "b.mkv").read_bytes()
    read = list(film.decode(tmp_path / "a.mkv"))
    assert len(read) == len(drawn)
    assert np.abs(np.array(read).astype(int) - np.array(drawn)).mean() < 1.5
