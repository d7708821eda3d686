"""The geometry of the body against textbook formulas."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.motion import skeleton

angle = st.floats(-179, 179)
middle = st.floats(-85, 85)


def turn(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


@given(angle, angle, middle)
@settings(max_examples=60)
def test_rotation_is_rx_rz_ry(x, y, z):
    found = skeleton.rotations(np.array([x, y, z]))
    np.testing.assert_allclose(found, turn("x", x) @ turn("z", z) @ turn("y", y), atol=1e-12)


@given(angle, angle, middle)
@settings(max_examples=60)
def test_euler_inverts_rotations(x, y, z):
    given_angles = np.array([[x, y, z]])
    np.testing.assert_allclose(skeleton.euler(skeleton.rotations(given_angles)), given_angles, atol=1e-8)


def placed(**angles_deg):
    angles = np.zeros((1, len(skeleton.JOINTS), 3))
    for name, value in angles_deg.items():
        angles[0, skeleton.JOINTS.index(name)] = value
    return {name: points[0] for name, points in skeleton.forward(np.zeros((1, 3)), angles).items()}


def test_at_zero_the_arms_hang_and_the_feet_stand():
    body = placed()
    for side in ("left", "right"):
        assert body[f"{side}_hand"][1] == pytest.approx(body[f"{side}_arm"][1] - 0.54)
        assert body[f"{side}_hand"][0] == body[f"{side}_arm"][0]
        assert 0 <= body[f"{side}_foot_tip"][1] < 0.1
    assert body["left_arm"][0] > 0 > body["right_arm"][0]


def test_negative_x_lifts_an_arm_forward_and_bends_the_forearm_forward():
    body = placed(left_arm=(-90, 0, 0))
    np.testing.assert_allclose(body["left_hand"] - body["left_arm"], [0, 0, 0.54], atol=1e-12)
    body = placed(left_forearm=(-90, 0, 0))
    np.testing.assert_allclose(body["left_hand"] - body["left_forearm"], [0, 0, 0.25], atol=1e-12)


def test_z_lifts_the_left_arm_to_the_left():
    body = placed(left_arm=(0, 0, 90), right_arm=(0, 0, -90))
    np.testing.assert_allclose(body["left_hand"] - body["left_arm"], [0.54, 0, 0], atol=1e-12)
    np.testing.assert_allclose(body["right_hand"] - body["right_arm"], [-0.54, 0, 0], atol=1e-12)


def test_bones_keep_their_length_and_the_root_carries_all():
    rng = np.random.default_rng(1)
    angles = rng.uniform(-80, 80, (5, len(skeleton.JOINTS), 3))
    root = rng.normal(size=(5, 3))
    body, still = skeleton.forward(root, angles), skeleton.forward(np.zeros((5, 3)), angles)
    for joint in skeleton.BODY[1:]:
        lengths = np.linalg.norm(body[joint.name] - body[joint.parent], axis=1)
        np.testing.assert_allclose(lengths, np.linalg.norm(joint.offset_m), atol=1e-12)
        np.testing.assert_allclose(body[joint.name] - still[joint.name], root, atol=1e-12)


def test_motion_table_holds_what_went_in():
    rng = np.random.default_rng(2)
    angles, root = rng.uniform(-80, 80, (4, len(skeleton.JOINTS), 3)), rng.normal(size=(4, 3))
    table = skeleton.motion_table(root, angles, 29.97)
    np.testing.assert_array_equal(skeleton.angles(table), angles)
    assert skeleton.frame_rate(table) == pytest.approx(29.97)
    assert table["time_s"].iloc[1] == pytest.approx(1.5 / 29.97)
