"""Readings on the records of a run, on numbers that can be worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import head_readings
from cospeech.motion import head


@pytest.fixture(scope="module")
def found():
    states = {"branch": "g1", "state": [0, 1], "stay_probability": [0.9, 0.9], "feature": "x_deg"}
    active = np.arange(200) < 100
    pitch = np.where(active, np.arange(200) % 2 - 0.5, np.arange(200) % 2)
    f0_hz = np.where(active, 100.0 + 20.0 * (np.arange(200) % 2), np.nan)
    melody = pd.DataFrame({"active": active, "f0_hz": f0_hz, "pitch": pitch})
    angles = head.table(np.random.default_rng(0).normal(size=(50, 3)), 30.0)
    return head_readings.table(head_readings.readings(pd.DataFrame(states), melody, angles))


def test_the_rows_have_their_schema(found):
    tables.validate(found, "head_readings", "x")
    assert found["printed"].notna().all()


def test_the_diagonal_gives_nearly_all_frames_to_the_last_state(found):
    own = found.set_index("equation").loc["4.3"]
    assert own["as_printed"] == pytest.approx(100.0 / (1.0 + 0.9**20))
    assert own["as_read"] == pytest.approx(50.0)


def test_a_still_head_scores_the_number_of_frames_as_printed_and_one_as_read(found):
    own = found.set_index("equation").loc["4.20"]
    assert (own["as_printed"], own["as_read"]) == (pytest.approx(50.0), pytest.approx(1.0))


def test_the_mean_head_is_the_yardstick_of_the_mahalanobis_distance(found):
    own = found.set_index("equation").loc["4.21"]
    assert np.isnan(own["as_printed"])
    assert own["as_read"] == pytest.approx(1.6, abs=0.15)  # of a normal distribution about three axes


def test_beta_and_bic_choose_their_extremes():
    curves = pd.DataFrame({"n_patterns": [2, 3, 4], "beta": [1.0, 3.0, 2.0], "bic": [5.0, 4.0, 3.0]})
    both = pd.concat([curves.assign(stream=stream) for stream in ("head", "melody")])
    rows = head_readings.choices(both)
    assert [(row["as_printed"], row["as_read"]) for row in rows] == [(3.0, 4.0)] * 2


def test_flows_are_compared_on_the_same_film():
    rows = [
        {"width_px": width, "contrast": 1.0, "noise": 1.5, "depth": "disparity", "flow": flow, "mean_deg": error}
        for width, flow, error in (
            (640, "warped", 0.2), (640, "warped", 0.4), (640, "printed", 0.9), (320, "printed", 9.0)
        )
    ]  # fmt: skip
    [row] = head_readings.flows(pd.DataFrame(rows))
    assert (row["as_printed"], row["as_read"]) == (0.9, pytest.approx(0.3))


def test_noise_of_unit_variance_is_small_compared_with_a_pitch_in_hertz(found):
    own = found.set_index("equation").loc["4.1.2"]
    assert own["as_printed"] == pytest.approx(1.0 / 10.0)
    assert own["as_read"] == pytest.approx(1.0)
