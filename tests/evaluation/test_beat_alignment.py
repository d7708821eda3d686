"""Beats of the hands, their distance from onsets, and what beats at random times score."""

import math

import numpy as np
import pytest
from scipy.signal import argrelextrema

from cospeech.evaluation import beat_alignment
from cospeech.evaluation.beat_alignment import LEAST_SPEED, SIGMA_S


def by_pairs(onsets_s, beats_s):
    """The definition, pair by pair."""
    return np.mean([math.exp(-min((t - b) ** 2 for b in beats_s) / (2 * SIGMA_S**2)) for t in onsets_s])


@pytest.mark.parametrize("seed", range(50))
def test_the_alignment_equals_the_definition(seed):
    rng = np.random.default_rng(seed)
    onsets_s, beats_s = (np.sort(rng.uniform(0, 10, rng.integers(1, 20))) for _ in range(2))
    assert beat_alignment.alignment(onsets_s, beats_s) == pytest.approx(by_pairs(onsets_s, beats_s), abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("fps", [20.0, 30.0, 60.0])
def test_beats_are_those_of_the_usual_code(seed, fps):
    """``argrelextrema`` with the order of 7 frames at 30 frames/s, but without the ends, and above the threshold."""
    rng = np.random.default_rng(seed)
    speed = np.abs(np.cumsum(rng.normal(size=300))) + rng.uniform(0, 0.1, 300)
    order = round(7 / 30 * fps)
    (lowest,) = argrelextrema(speed, np.less, order=order)
    inner = [k for k in lowest if order <= k < 300 - order and speed[k] > LEAST_SPEED * speed.mean()]
    np.testing.assert_allclose(beat_alignment.beats(speed, fps), (np.array(inner) + 0.5) / fps)


def test_random_beats_score_more_the_more_there_are_as_published():
    """Trials with the code of the field gave .30 at 0.5 beats per second, and .91 at 5 (sigma 0.3 s)."""
    assert beat_alignment.chance(0.5) == pytest.approx(0.30, abs=0.005)
    assert beat_alignment.chance(5.0) == pytest.approx(0.91, abs=0.005)
    assert beat_alignment.chance(0.0) == 0.0


@pytest.mark.parametrize("rate_hz", [0.3, 1.0, 3.0])
def test_chance_is_the_mean_of_simulated_beats(rate_hz):
    rng = np.random.default_rng(round(10 * rate_hz))
    onsets_s = np.linspace(20.0, 3980.0, 5000)
    scores = []
    for _ in range(20):
        beats_s = np.sort(rng.uniform(0.0, 4000.0, rng.poisson(4000.0 * rate_hz)))
        scores.append(beat_alignment.alignment(onsets_s, beats_s))
    assert beat_alignment.chance(rate_hz) == pytest.approx(np.mean(scores), abs=4 * np.std(scores) / math.sqrt(20))


def test_hands_that_beat_with_the_syllables_score_and_others_do_not():
    """A wrist slows down at every onset; half a beat later it is nowhere near them."""
    fps, onsets_s = 40.0, np.arange(2.0, 58.0, 2.0)
    time_s = (np.arange(round(60 * fps)) + 0.5) / fps
    speed = np.tile(1.2 - np.cos(np.pi * (time_s - 0.01)), (2, 1)).T  # slowest at even seconds
    with_them = beat_alignment.score(onsets_s, speed, fps, 0, len(speed))
    beside = beat_alignment.score(onsets_s + 1.0, speed, fps, 0, len(speed))
    n_beats = len(beat_alignment.beats(speed[:, 0], fps))
    assert with_them == pytest.approx(1.0 - beat_alignment.chance(n_beats / 60.0), abs=0.01)
    assert beside < -0.2


def test_what_cannot_be_scored_is_not_a_number():
    speed = np.ones((100, 2))
    assert math.isnan(beat_alignment.score(np.empty(0), speed, 25.0, 0, 100))
    assert math.isnan(beat_alignment.score(np.array([1.0]), speed, 25.0, 50, 50))
    assert beat_alignment.score(np.array([1.0]), speed, 25.0, 0, 100) == 0.0  # hands without a beat
