"""Hands and head at keywords and accents (Sargin 2006, 3.5), from planted gestures."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.markov.mixture_hmm import MixtureHMM, Training
from cospeech.markov.spotting import Segment
from cospeech.synthesis.directions import animation
from cospeech.synthesis.directions.animation import Event

FPS = 30.0
HANDS = ["left_x_m", "left_y_m", "right_x_m", "right_y_m"]


def test_the_head_moves_at_the_printed_speed_to_the_middle_of_an_accent_and_back():
    times_s = np.arange(0.0, 2.0, 0.01)
    moved = animation.head_px([Event(0.5, 0.9, "accent"), Event(1.2, 1.3, "accent")], times_s)
    assert moved.max() == pytest.approx(25.0 * 0.2)
    assert moved[times_s > 1.0].max() == pytest.approx(25.0 * 0.05)
    during = (times_s > 0.51) & (times_s < 0.69)
    np.testing.assert_allclose(np.diff(moved[during]) / 0.01, 25.0)
    assert not moved[(times_s < 0.5) | (times_s > 1.31)].any()


def test_the_course_of_a_hand_passes_the_means_in_the_middle_of_its_states():
    """Expected durations of 2, 4 and 2 frames put the middles at 1/8, 1/2 and 7/8 of the gesture."""
    mean = np.array([[0.1, 0.0], [0.2, 0.4], [0.1, 0.0]])
    model = MixtureHMM(np.array([0.5, 0.75, 0.5]), np.ones((3, 1)), mean[:, None], np.ones((3, 1, 2)))
    found = animation.course(model, 8000)
    np.testing.assert_allclose(found[[1000, 4000, 7000]], mean, atol=1e-3)
    np.testing.assert_allclose(found[[0, -1]], 0.0, atol=1e-3)


@pytest.fixture(scope="module")
def models():
    """Models of planted gestures: hands rise by 0.2 m, and the left one moves to the left at 'left'."""
    rng = np.random.default_rng(1)
    rise = np.sin(np.linspace(0.0, np.pi, 20))
    frames, gestures = np.zeros((600, 4)), []
    for number in range(15):
        label, first = ("left", "right", "straight")[number % 3], 40 * number
        rising = [1, 3] if label == "straight" else [1] if label == "left" else [3]
        frames[first : first + 20, rising] = 0.2 * rise[:, None]
        if label == "left":
            frames[first : first + 20, 0] = 0.3 * rise
        gestures.append(Segment("a", first, first + 20, label))
    table = pd.DataFrame(frames + rng.normal(0.0, 0.005, frames.shape), columns=HANDS)
    return animation.hand_models({"a": table}, gestures, 5, Training(10, 1e-3, 0.01), seed=1)


def test_each_keyword_moves_its_hands_while_it_lasts(models):
    spoken = [Event(1.0, 1.5, "left"), Event(2.0, 2.5, "right"), Event(3.0, 3.5, "straight")]
    found = animation.animate("a", 4.0, spoken, [Event(0.2, 0.4, "accent")], models, FPS)
    tables.validate(found, "direction_animation", "animation")
    moved = found[HANDS].abs().groupby(found["keyword"].fillna("none")).max()
    np.testing.assert_array_equal(moved.loc["none"], 0.0)
    np.testing.assert_allclose(moved.loc["left"], [0.3, 0.2, 0.0, 0.0], atol=0.04)
    np.testing.assert_allclose(moved.loc["right"], [0.0, 0.0, 0.0, 0.2], atol=0.04)
    np.testing.assert_allclose(moved.loc["straight"], [0.0, 0.2, 0.0, 0.2], atol=0.04)
    assert found.loc[found["keyword"] == "left", "time_s"].agg(["min", "max"]).between(1.0, 1.5).all()
