"""Angles of the head: their signs, their composition of neck and head, and bodies that follow them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cospeech.data import tables
from cospeech.motion import head, skeleton


def body(n_frames=50, fps=20.0, seed=0, spread=12.0):
    angles = np.random.default_rng(seed).normal(0.0, spread, (n_frames, len(skeleton.JOINTS), 3))
    return skeleton.motion_table(np.zeros((n_frames, 3)), angles, fps)


def nose_and_crown(motion):
    """The directions of the nose and of the crown relative to the chest, (T, 3) each."""
    turned, _ = skeleton.chain(np.zeros((len(motion), 3)), skeleton.angles(motion))
    chest, own = (turned[:, skeleton.JOINTS.index(name)] for name in ("chest", "head"))
    relative = np.swapaxes(chest, -1, -2) @ own
    return relative @ [0.0, 0.0, 1.0], relative @ [0.0, 1.0, 0.0]


@pytest.mark.parametrize(
    ("axis", "place"),
    [("x", 0), ("y", 1), ("z", 2)],
)
def test_positive_angles_nod_down_turn_left_and_tilt_right(axis, place):
    angles = np.zeros((1, 3))
    angles[0, place] = 20.0
    moved = head.moved(body(1, spread=0.0), head.table(angles, 20.0))
    nose, crown = nose_and_crown(moved)
    sine = np.sin(np.radians(20.0))
    assert {"x": -nose[0, 1], "y": nose[0, 0], "z": -crown[0, 0]}[axis] == pytest.approx(sine)


def test_angles_of_a_body_are_those_that_its_head_was_given():
    given = np.random.default_rng(1).uniform(-60.0, 60.0, (50, 3))
    moved = head.moved(body(), head.table(given, 20.0))
    np.testing.assert_allclose(head.angles(moved), given, atol=1e-9)
    found = head.of_body(moved)
    tables.validate(found, "head", "x")
    assert head.frame_rate(found) == 20.0
    others = [name for name in skeleton.columns() if not name.startswith(("neck_", "head_"))]
    assert moved[others].equals(body()[others])


def test_neck_and_head_are_composed_as_rotations():
    motion = body(seed=2, spread=30.0)
    neck, own = (
        Rotation.from_euler("XZY", skeleton.angles(motion, (name,))[:, 0][:, [0, 2, 1]], degrees=True)
        for name in ("neck", "head")
    )
    np.testing.assert_allclose(head.angles(motion), (neck * own).as_euler("XYZ", degrees=True), atol=1e-9)


def test_neck_and_head_share_a_rotation_equally():
    moved = head.moved(body(1, spread=0.0), head.table(np.array([[0.0, 30.0, 0.0]]), 20.0))
    np.testing.assert_allclose(skeleton.angles(moved, head.JOINTS)[0], [[0, 15, 0], [0, 15, 0]], atol=1e-9)


def test_frames_between_and_without_angles_are_interpolated():
    given = head.table(np.array([[0.0, 0, 0], [10, 20, 30], [np.nan] * 3, [30, 0, 0]]), 10.0)
    found = head.at_times(given, np.array([0.0, 0.1, 0.25, 9.0]))
    np.testing.assert_allclose(found, [[0, 0, 0], [5, 10, 15], [20, 10, 15], [30, 0, 0]])
