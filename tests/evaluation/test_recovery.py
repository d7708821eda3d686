"""Recovery of planted and found sequences with known agreement, and tests of the planted process."""

import math

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import adjusted_mutual_info_score

from cospeech.data import segments, tables
from cospeech.evaluation import recovery

FRAME_S, FPS = 0.025, 40.0


def value(rows, quantity, **where):
    found = [row for row in rows if row["quantity"] == quantity and all(row[k] == v for k, v in where.items())]
    assert len(found) == 1
    return found[0]["value"]


def test_gestures_at_different_rates_are_compared_by_time():
    planted = segments.from_labels("r", np.repeat(["rest", "left"], [200, 200]), FPS)
    found = segments.from_labels("r", np.repeat(["rest", "left", "rest"], [90, 100, 10]), 20.0)
    rows = recovery.gestures(planted, found, FRAME_S)
    assert value(rows, "gesture_frames_right") == pytest.approx((180 + 180) / 400)
    assert value(rows, "gesture_phrase_ratio") == 1.5
    same = recovery.gestures(planted, planted, FRAME_S)
    assert [row["value"] for row in same] == [1, 1, 1]


def test_prosody_agreement_is_computed_over_frames():
    rng = np.random.default_rng(1)
    patterns = {record: np.repeat(rng.choice(["a", "b", "c"], 60), 20) for record in ("r1", "r2", "r3")}
    clusters = {r: np.where(rng.random(1200) < 0.8, np.char.add("p", p), "px") for r, p in patterns.items()}
    planted = pd.concat([segments.from_labels(r, p, FPS) for r, p in patterns.items()])
    found = pd.concat([segments.from_labels(r, c, FPS) for r, c in clusters.items()])
    rows = recovery.prosody(planted, found, held_out="r2")
    held_out = adjusted_mutual_info_score(patterns["r2"], clusters["r2"])
    assert value(rows, "prosody_ami", part="held_out") == pytest.approx(held_out)
    training = [np.concatenate([side["r1"], side["r3"]]) for side in (patterns, clusters)]
    assert value(rows, "prosody_ami", part="training") == pytest.approx(adjusted_mutual_info_score(*training))


def test_pitch_errors_are_computed_over_voiced_frames():
    time_s = segments.frame_times(100, FPS)
    planted = pd.DataFrame({"time_s": time_s, "lag_s": np.where(np.arange(100) < 60, 0.005, np.nan)})
    lag_s = np.full(100, 0.005 * 1.02)
    lag_s[:6] *= 2  # octave errors in a tenth of the voiced frames
    gain = np.where(np.arange(100) < 80, 0.9, 0.1)
    rows = recovery.pitch(planted, pd.DataFrame({"time_s": time_s, "lag_s": lag_s, "pitch_gain": gain}), 0.4)
    assert value(rows, "pitch_error") == pytest.approx(0.02)
    assert value(rows, "pitch_gross_errors") == pytest.approx(0.1)
    assert {row["n"] for row in rows} == {60}
    silent = planted.assign(lag_s=np.nan)
    assert recovery.pitch(silent, pd.DataFrame({"time_s": time_s, "lag_s": lag_s, "pitch_gain": gain}), 0.4) == []


GESTURES = ("rest", "left", "right")
TRANSITIONS = np.array([[0.0, 0.6, 0.4], [0.7, 0.1, 0.2], [0.5, 0.5, 0.0]])
DURATIONS = np.array([[0.1, 0.2, 0.4, 0.3], [0.4, 0.3, 0.2, 0.1], [0.25, 0.25, 0.25, 0.25]])  # in bins of 1 s


def model():
    pairs = [(a, b, TRANSITIONS[i, j]) for i, a in enumerate(GESTURES) for j, b in enumerate(GESTURES)]
    transitions = pd.DataFrame(pairs, columns=["from_gesture", "to_gesture", "probability"])
    bins = [(g, k + 1, float(k + 1), DURATIONS[i, k]) for i, g in enumerate(GESTURES) for k in range(4)]
    return transitions, pd.DataFrame(bins, columns=["gesture", "bin", "duration_s", "probability"])


def sample_phrases(rng, n_phrases=60, transitions=TRANSITIONS, durations=DURATIONS, record="r"):
    labels, starts, state, at = [], [], 0, 0
    for _ in range(n_phrases):
        labels.append(GESTURES[state])
        starts.append(at)
        at += 1 + rng.choice(4, p=durations[state])
        state = rng.choice(3, p=transitions[state])
    return segments.from_starts(record, starts, labels, at, 1.0)


def test_delays_are_those_of_voiced_syllables():
    peak_s = np.array([0.1, 0.4, 0.7, 1.0, 1.3])
    known_s = peak_s + np.array([0.1, 0.2, 0.3, 9.0, 0.2])
    table = pd.DataFrame({"peak_s": peak_s, "known_s": known_s, "f0_hz": [100.0, 120.0, 110.0, np.nan, 90.0]})
    rows = recovery.syllable_delays(table)
    assert [(row["quantity"], round(row["value"], 6), row["n"]) for row in rows] == [
        ("syllable_delay", 0.2, 4),
        ("syllable_delay_p90", 0.27, 4),
    ]
    assert recovery.syllable_delays(table[3:4]) == []


def test_p_values_of_the_planted_process_are_uniform():
    transitions, durations = model()
    p = {"transitions_p": [], "durations_p": []}
    for seed in range(60):
        rng = np.random.default_rng(seed)
        phrases = pd.concat([sample_phrases(rng, record=f"r{k}") for k in range(3)])
        for row in recovery.process(phrases, transitions, durations, seed):
            p[row["quantity"]].append(row["value"])
    for values in p.values():
        # p-values are uniform on (0, 1]: of 60, 3 are expected below 0.05; more than 10 have probability 3e-4.
        assert sum(value < 0.05 for value in values) <= 10
        assert 0.3 < np.mean(values) < 0.7


def test_a_different_process_is_detected():
    transitions, durations = model()
    rng = np.random.default_rng(1)
    other = sample_phrases(rng, 200, TRANSITIONS[[0, 2, 1]], DURATIONS[::-1])
    rows = recovery.process(other, transitions, durations, 1)
    assert value(rows, "transitions_p") < 0.01
    assert value(rows, "durations_p") < 0.01


def test_a_forbidden_transition_has_the_smallest_p_value():
    transitions, durations = model()
    phrases = segments.from_starts("r", [0, 2, 4, 6], ["rest", "rest", "left", "rest"], 8, 1.0)
    rows = recovery.process(phrases, transitions, durations, 1)
    assert value(rows, "transitions_p") == pytest.approx(1 / (recovery.SIMULATIONS + 1))


def test_a_record_with_one_phrase_has_no_p_value():
    transitions, durations = model()
    phrases = segments.from_starts("r", [0], ["rest"], 8, 1.0)
    assert all(math.isnan(row["value"]) for row in recovery.process(phrases, transitions, durations, 1))


def test_the_table_conforms_to_its_schema(tmp_path):
    rows = [
        {"quantity": "gesture_kappa", "actor": "a", "record": "r", "value": 0.9, "n": 10},
        {"quantity": "prosody_ami", "actor": "a", "record": "r", "clusters": 8, "states": 3, "part": "held_out",
         "value": 0.5, "n": 10},
        {"quantity": "durations_p", "actor": "a", "value": math.nan, "n": 0},
    ]  # fmt: skip
    tables.write(recovery.table(rows), tmp_path / "t.parquet", "recovery", corpus="virtual", config_hash="0")
    back = tables.read(tmp_path / "t.parquet", "recovery")
    assert back["clusters"].isna().tolist() == [True, False, True]
