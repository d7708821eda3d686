"""Co-occurrence of events and gestures: planted coupling, independent events, and the automatic correlation."""

import numpy as np
import pandas as pd
import pytest

from cospeech.evaluation import co_occurrence
from cospeech.evaluation.co_occurrence import Settings

SETTINGS = Settings(shifts=100, level=0.95)
DURATION_S = 1500.0


def draw(rng, number, shortest_s, longest_s):
    start = np.sort(rng.uniform(0.0, DURATION_S - longest_s, number))
    return np.column_stack([start, start + rng.uniform(shortest_s, longest_s, number)])


def measured(events, gestures, seed=1):
    found = co_occurrence.table("accents", "head", events, gestures, DURATION_S, SETTINGS, seed)
    return found.set_index("measure")


def test_independent_events_that_overlap_correlate_almost_perfectly():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        found = measured(draw(rng, 122, 0.1, 0.3), draw(rng, 400, 0.4, 1.0))
        assert found.loc["start_r", "value"] > 0.999
        assert found.loc["start_r", "chance_low"] > 0.994  # more than what was published as evidence


def test_planted_coupling_exceeds_the_shifted_gestures_and_independence_does_not():
    rng = np.random.default_rng(2)
    accents = draw(rng, 300, 0.1, 0.3)
    nods = accents[rng.random(300) < 0.65] + 0.08 * rng.standard_normal() + np.array([0.0, 0.3])
    found = measured(accents, nods)
    assert found.loc["overlap", "value"] == pytest.approx(0.65, abs=0.1)
    assert found.loc["overlap", "value"] > found.loc["overlap", "chance_high"]
    assert found.loc["overlap", "p_value"] == pytest.approx(1 / 101)
    p_values = [
        measured(draw(rng, 100, 0.1, 0.3), draw(rng, 70, 0.4, 0.6), seed).loc["overlap", "p_value"]
        for seed in range(30)
    ]
    assert np.mean(np.array(p_values) <= 0.1) < 0.35  # uniform: 3 of 30, more than 9 with probability 0.001


def test_the_planted_lag_and_its_spread_are_found():
    rng = np.random.default_rng(3)
    accents = draw(rng, 400, 0.2, 0.3)
    starts = accents[:, 0] - 0.1 + 0.04 * rng.standard_normal(400)
    found = measured(accents, np.column_stack([starts, starts + 0.6]))
    # Gestures of neighbouring accents are sometimes the nearer partners, which widens the spread.
    assert found.loc["onset_mean_s", "value"] == pytest.approx(-0.1, abs=0.03)
    assert found.loc["onset_sd_s", "value"] < 0.6 * found.loc["onset_sd_s", "chance_low"]


def test_shifted_gestures_keep_their_durations_and_intervals():
    rng = np.random.default_rng(4)
    gestures = draw(rng, 20, 0.4, 1.0)
    moved = co_occurrence.shifted(gestures, 700.0, DURATION_S)
    assert np.allclose(np.diff(moved), np.diff(gestures))
    assert np.allclose((moved[:, 0] - gestures[:, 0]) % DURATION_S, 700.0)


def test_without_gestures_nothing_overlaps_and_nothing_else_is_defined():
    found = measured(draw(np.random.default_rng(5), 10, 0.1, 0.3), np.zeros((0, 2)))
    assert found.loc["overlap", "value"] == 0.0
    assert found.loc["overlap", "p_value"] == 1.0
    assert found["value"].drop("overlap").isna().all()
    assert found.loc["gesture_overlap", "number"] == 0


def test_events_that_all_overlap_one_gesture_have_no_correlation():
    found = co_occurrence.measures(np.array([[1.0, 1.2], [1.4, 1.6]]), np.array([[0.5, 2.0]]))
    assert found[:2].tolist() == [1.0, 1.0]
    assert np.isnan(found[2:4]).all()
    assert found[4:] == pytest.approx([-0.7, np.std([0.5, 0.9], ddof=1)])


def test_shifts_without_any_overlap_count_for_chance():
    events, gestures = np.array([[100.0, 100.2], [200.0, 200.2]]), np.array([[100.0, 100.5], [200.0, 200.5]])
    found = measured(events, gestures)
    assert found.loc["overlap", "value"] == 1.0
    assert found.loc["overlap", "chance"] < 0.02  # 0.7 s of 1500 s for each gesture


def test_records_follow_one_another_on_one_clock():
    records = pd.DataFrame({"record": ["a", "b"], "start_s": [0.0, 10.0]})
    events = pd.DataFrame({"record": ["b", "a"], "start_s": [1.0, 2.0], "end_s": [1.5, 3.0]})
    assert co_occurrence.on_one_clock(events, records).tolist() == [[11.0, 11.5], [2.0, 3.0]]
