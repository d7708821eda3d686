"""Rotations, compared with those of scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from cospeech.geometry import rotation

ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]
turns = arrays(float, (7, 3), elements=st.floats(-3.0, 3.0))
angles = arrays(float, (2, 3, 3), elements=st.floats(-360.0, 360.0))


@given(angles, st.sampled_from([*ORDERS, "XY", "ZX", "Y"]))
def test_matrices_of_euler_angles_are_those_of_scipy(values, order):
    values = values[..., : len(order)]
    expected = Rotation.from_euler(order, values.reshape(-1, len(order)), degrees=True).as_matrix()
    assert rotation.from_euler(order, values) == pytest.approx(expected.reshape(2, 3, 3, 3), abs=1e-13)


@given(angles, st.sampled_from(ORDERS))
def test_euler_angles_turn_as_the_matrices_they_are_of(values, order):
    matrices = rotation.from_euler(order, values)
    found = rotation.to_euler(order, matrices)
    assert np.abs(found[..., 1]).max() <= 90.0
    assert rotation.from_euler(order, found) == pytest.approx(matrices, abs=1e-8)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_those_of_scipy_away_from_the_lock(order):
    values = np.random.default_rng(1).uniform(-89.0, 89.0, (500, 3))
    assert rotation.to_euler(order, rotation.from_euler(order, values)) == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("second", [90.0, -90.0])
def test_at_the_lock_the_last_angle_is_zero_and_the_turn_is_kept(order, second):
    matrices = rotation.from_euler(order, np.array([[20.0, second, 50.0]]))
    found = rotation.to_euler(order, matrices)
    assert found[0, 2] == 0.0
    assert rotation.from_euler(order, found) == pytest.approx(matrices, abs=1e-12)


@given(turns, st.sampled_from([1.0, 1e-9, 1e-160, 0.0]))
def test_matrices_of_rotation_vectors_are_those_of_scipy(vectors, scale):
    expected = Rotation.from_rotvec(scale * vectors).as_matrix()
    assert rotation.from_vectors(scale * vectors) == pytest.approx(expected, abs=1e-13)


@given(turns, st.sampled_from([1.0, 1e-6, 0.0]))
def test_rotation_vectors_come_back(vectors, scale):
    """Up to half a turn; a longer vector comes back as the shorter one of the same rotation."""
    vectors = scale * vectors
    found = rotation.to_vectors(rotation.from_vectors(vectors))
    expected = Rotation.from_rotvec(vectors).as_rotvec()
    assert found == pytest.approx(expected, abs=1e-12)


def test_half_turns_are_recovered_as_accurately_as_small_ones():
    axes = np.random.default_rng(2).normal(size=(100, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    for angle in (np.pi, np.pi - 1e-9, 1e-9):
        found = rotation.to_vectors(rotation.from_vectors(angle * axes))
        assert np.abs(np.sum(found * axes, axis=1)) == pytest.approx(angle, abs=1e-12)


def test_how_much_a_matrix_turns():
    matrices = rotation.from_euler("X", np.array([[0.0], [30.0], [-120.0], [180.0]]))
    assert rotation.angles_deg(matrices) == pytest.approx([0.0, 30.0, 120.0, 180.0], abs=1e-9)


@given(turns, st.sampled_from([1.0, 1e-6, 0.0]))
def test_quaternions_are_those_of_scipy_and_come_back(vectors, scale):
    expected = Rotation.from_rotvec(scale * vectors)
    found = rotation.to_quaternions(expected.as_matrix().reshape(7, 1, 3, 3))
    assert found[:, 0] == pytest.approx(expected.as_quat(canonical=True, scalar_first=True), abs=1e-12)
    assert rotation.from_quaternions(found)[:, 0] == pytest.approx(expected.as_matrix(), abs=1e-12)
