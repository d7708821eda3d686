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


@pytest.mark.parametrize(("rate_hz", "published"), [(0.5, 0.30), (5.0, 0.91)])
def test_random_beats_score_more_the_more_there_are_as_published(rate_hz, published):
    """Trials with the code of the field gave these values for beats at random times (sigma 0.3 s)."""
    beats_s = np.sort(np.random.default_rng(5).uniform(0.0, 4000.0, round(4000 * rate_hz)))
    assert beat_alignment.chance(beats_s, 4000.0) == pytest.approx(published, abs=0.01)


@pytest.mark.parametrize("seed", range(20))
def test_chance_is_the_mean_over_all_shifts(seed):
    rng = np.random.default_rng(seed)
    duration_s = 20.0
    beats_s = np.sort(rng.uniform(0.0, duration_s, rng.integers(1, 30)))
    onsets_s = rng.uniform(0.0, duration_s, 7)
    repeated = np.concatenate([beats_s - duration_s, beats_s, beats_s + duration_s])
    shifts_s = (np.arange(2000) + 0.5) / 2000 * duration_s
    means = [beat_alignment.alignment((onsets_s + shift_s) % duration_s, repeated) for shift_s in shifts_s]
    assert beat_alignment.chance(beats_s, duration_s) == pytest.approx(np.mean(means), abs=1e-3)
    assert beat_alignment.chance(np.empty(0), duration_s) == 0.0


def test_hands_that_beat_with_the_syllables_score_and_others_do_not():
    """A wrist slows down at every onset; half a beat later it is nowhere near them."""
    fps, onsets_s = 40.0, np.arange(2.0, 58.0, 2.0)
    time_s = (np.arange(round(60 * fps)) + 0.5) / fps
    speed = np.tile(1.2 - np.cos(np.pi * (time_s - 0.01)), (2, 1)).T  # slowest at even seconds
    with_them = beat_alignment.score(onsets_s, speed, fps, 0, len(speed))
    beside = beat_alignment.score(onsets_s + 1.0, speed, fps, 0, len(speed))
    found = beat_alignment.beats(speed[:, 0], fps)
    assert with_them == pytest.approx(1.0 - beat_alignment.chance(found, 60.0), abs=0.01)
    assert beside < -0.2


def test_what_cannot_be_scored_is_not_a_number():
    speed = np.ones((100, 2))
    assert math.isnan(beat_alignment.score(np.empty(0), speed, 25.0, 0, 100))
    assert math.isnan(beat_alignment.score(np.array([1.0]), speed, 25.0, 50, 50))
    assert beat_alignment.score(np.array([1.0]), speed, 25.0, 0, 100) == 0.0  # hands without a beat
