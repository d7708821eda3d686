"""The speed of the hands is that of the wrists, and its correlation says how well two bodies move together."""

import numpy as np
import pytest

from cospeech.evaluation import hand_speed
from cospeech.motion import skeleton

FPS = 20.0
FOREARM_M = 0.25


def speed(motion):
    return hand_speed.smoothed(hand_speed.speeds(hand_speed.wrists(motion), FPS), FPS)


def swinging(deg_per_frame, joint="left_forearm"):
    """A body with one forearm that turns by these angles from frame to frame."""
    motion = skeleton.standing(len(deg_per_frame) + 1, FPS)
    motion[f"{joint}_x_deg"] = np.concatenate([[0.0], np.cumsum(deg_per_frame)])
    return motion


def test_the_speed_is_that_of_the_wrists_on_average_over_half_a_second():
    turns = np.full(60, 3.0)
    found = speed(swinging(turns))
    chord_m = 2 * FOREARM_M * np.sin(np.radians(3.0) / 2)
    np.testing.assert_allclose(found, chord_m * FPS / 2)  # the other hand is still
    once = np.zeros(60)
    once[30] = 3.0
    found = speed(swinging(once))
    moving = np.flatnonzero(found > 1e-9)
    assert (moving[0], moving[-1]) == (25, 35)
    np.testing.assert_allclose(found[moving], chord_m * FPS / 2 / 11)


def test_a_body_that_walks_with_still_hands_has_still_hands():
    motion = skeleton.standing(40, FPS)
    motion["root_x_m"] = np.linspace(0.0, 3.0, 40)
    assert speed(motion).max() < 1e-12


@pytest.mark.parametrize("n_frames", [1, 2])
def test_records_of_one_or_two_frames_have_a_speed(n_frames):
    assert speed(skeleton.standing(n_frames, FPS)).tolist() == [0.0] * n_frames
