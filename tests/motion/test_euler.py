"""Euler angles of the same rotations, without jumps, and the same angles for the same pose."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.motion import euler, skeleton

ARM = skeleton.JOINTS.index("left_arm")


def body(arm_deg):
    """Rotations (T, J, 3, 3) of a body that moves its left arm alone, by angles (T, 3) as x, y, z."""
    angles = np.zeros((len(arm_deg), len(skeleton.JOINTS), 3))
    angles[:, ARM] = arm_deg
    return skeleton.rotations(angles)


def test_an_arm_that_passes_through_the_gimbal_lock_is_continuous():
    # to the side, through the gimbal lock to above the head, and back
    lift = np.concatenate([np.linspace(5, 160, 60), np.linspace(160, 5, 60)])
    planted = np.column_stack([np.full(120, -7.0), np.full(120, 12.0), lift])
    found = euler.least_change(body(planted))[:, ARM]
    assert np.abs(np.diff(skeleton.euler(body(planted))[:, ARM], axis=0)).max() > 150  # the fixed choice jumps
    np.testing.assert_allclose(found, planted, atol=1e-6)


def test_the_same_pose_has_the_same_angles_however_the_arm_came_there():
    rest, stay = np.array([-10.0, 5.0, 8.0]), 400
    over_the_side = np.column_stack([np.full(50, -10.0), np.full(50, 5.0), np.linspace(8, 150, 50)])
    # on from above the head, down in front of the body, to the same rest
    above = np.array([170.0, 185.0, 30.0])  # the second triple of (-10, 5, 150)
    down = above + np.linspace(0, 1, 50)[:, None] * (rest - above)
    path = np.vstack([over_the_side, down, np.tile(rest, (stay, 1))])
    found = euler.least_change(body(path))[:, ARM]
    np.testing.assert_allclose(found[-1], rest, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_rotations_are_kept_and_angles_stay_within_half_a_turn_of_the_middle(seed):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-400, 400, (50, len(skeleton.JOINTS), 3))
    matrices = skeleton.rotations(angles)
    found = euler.least_change(matrices)
    np.testing.assert_allclose(skeleton.rotations(found), matrices, atol=1e-9)
    middle = np.array([[euler.MIDDLE_X.get(joint, 0.0), 0, 0] for joint in skeleton.JOINTS])
    assert (np.abs(found - middle) <= 180 + 1e-9).all()


@pytest.mark.parametrize("seed", range(20))
def test_the_path_is_the_cheapest_of_all(seed):
    rng = np.random.default_rng(seed)
    both = rng.uniform(-180, 180, (6, 2, 2, 3))

    def cost(joint, path):
        taken = both[np.arange(6), joint, path]
        return (np.diff(taken, axis=0) ** 2).sum() + euler.AWAY * (taken**2).sum()

    chosen = euler._cheapest_path(both)
    for joint in range(2):
        best = min(itertools.product((0, 1), repeat=6), key=lambda path: cost(joint, np.array(path)))
        assert cost(joint, chosen[:, joint]) == pytest.approx(cost(joint, np.array(best)))


def test_a_single_frame_has_the_triple_nearest_to_the_middle():
    matrices = body([[-100.0, 20.0, 10.0]])
    np.testing.assert_allclose(euler.least_change(matrices)[0, ARM], [-100, 20, 10], atol=1e-9)


@given(st.integers(0, 10_000))
def test_followed_angles_are_the_same_rotations_in_small_steps(seed):
    rng = np.random.default_rng(seed)
    # A smooth curve through the gimbal lock: the arm swings out to the side and beyond while it twists.
    time = np.linspace(0, 1, 100)[:, None]
    smooth = np.stack([200 * time, 300 * time, 60 + 60 * time], axis=-1) * rng.uniform(0.3, 1, 3)
    canonical = skeleton.euler(skeleton.rotations(smooth))
    found = euler.follow(canonical)
    assert skeleton.rotations(found) == pytest.approx(skeleton.rotations(smooth), abs=1e-9)
    assert np.abs(np.diff(found, axis=0)).max() < 10
    assert np.abs(np.diff(found, axis=0)).max() <= np.abs(np.diff(canonical, axis=0)).max() + 1e-9
