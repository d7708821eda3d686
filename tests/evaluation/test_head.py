"""Distances between heads: the formulas written out, and what heads that know nothing of speech score."""

import numpy as np
import pandas as pd
import pytest

from cospeech.evaluation import head as scoring
from cospeech.motion import head


def table(angles):
    return head.table(np.asarray(angles, dtype=float), 30.0)


def walk(n_frames=400, seed=0):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(0, 0.6, (n_frames, 3)), axis=0) + rng.normal(0, 0.1, (n_frames, 3))


def value(found, measure, lag_s=np.nan):
    at = found["lag_s"].isna() if np.isnan(lag_s) else np.isclose(found["lag_s"], lag_s)
    return found.loc[(found["measure"] == measure) & at, "value"].item()


def test_distances_are_those_of_the_printed_sums():
    true, own = walk(seed=1), walk(seed=2)
    found = scoring.scores(table(true), table(own))
    inverse = np.linalg.inv(np.cov(true.T))
    printed = {"normalised": 0.0, "mahalanobis": 0.0, "euclidean": 0.0}
    for e, made in zip(true, own, strict=True):
        printed["normalised"] += (made - e) @ (made - e) / ((made + e) @ (made + e)) / len(true)
        printed["mahalanobis"] += np.sqrt((made - e) @ inverse @ (made - e)) / len(true)
        printed["euclidean"] += np.sqrt((made - e) @ (made - e)) / len(true)
    for measure, expected in printed.items():
        assert value(found, measure) == pytest.approx(expected)
    apart, together = ((own - true) ** 2).sum(), ((own + true) ** 2).sum()
    assert value(found, "normalised_sums") == pytest.approx(apart / together)


def test_a_shifted_recording_has_the_same_statistics_at_other_moments():
    true = walk(n_frames=600)
    moved = scoring.shifted(table(true), 5.0)
    assert len(moved) == scoring.N_SHIFTS
    starts = [int(np.flatnonzero((own[head.COLUMNS] == true[0]).all(axis=1))[0]) for own in moved]
    assert (starts[0], starts[-1]) == (150, 450)
    assert len(set(starts)) == scoring.N_SHIFTS
    for own in moved:
        assert sorted(own["y_deg"]) == sorted(true[:, 1])
    assert scoring.shifted(table(true[:299]), 5.0) == []


def test_speeds_of_the_same_head_correlate_and_those_of_a_shifted_one_do_not():
    true = table(walk(n_frames=3000))
    assert value(scoring.scores(true, true), "speed_correlation") == pytest.approx(1.0)
    for own in scoring.shifted(true, 5.0):
        assert abs(value(scoring.scores(true, own), "speed_correlation")) < 0.1


def test_a_head_that_does_not_move_has_a_normalised_distance_of_one():
    found = scoring.scores(table(walk()), table(np.zeros((400, 3))))
    assert value(found, "normalised") == pytest.approx(1.0)
    assert value(found, "normalised_sums") == pytest.approx(1.0)
    assert np.isnan(value(found, "speed_r", 0.0))


def test_a_constant_mean_head_has_the_mahalanobis_distance_of_three_gaussians():
    """The mean of a chi variable of three degrees of freedom, 2 sqrt(2 / pi), below the published values."""
    true = np.random.default_rng(3).normal(0.0, [9.0, 4.0, 2.0], (60_000, 3))
    found = scoring.distances(true, np.broadcast_to(true.mean(axis=0), true.shape))
    assert found["mahalanobis"] == pytest.approx(2 * np.sqrt(2 / np.pi), abs=0.01)


@pytest.mark.parametrize("lag", [-6, 0, 9])
def test_the_correlation_of_speeds_is_greatest_at_the_lag(lag):
    rng = np.random.default_rng(lag + 10)
    pace = np.convolve(rng.random(700), np.hanning(15), mode="same")
    true = np.cumsum(pace[:, None] * [0.5, 0.3, 0.1], axis=0)
    found = scoring.scores(table(true[50:650]), table(true[50 - lag : 650 - lag]))
    curve = found[found["measure"] == "speed_r"].set_index("lag_s")["value"]
    assert curve.idxmax() == pytest.approx(lag / 30.0)
    assert curve.max() > 0.999


def test_frames_without_angles_are_left_out_and_too_few_have_no_score():
    true, own = walk(seed=4), walk(seed=5)
    gaps = true.copy()
    gaps[100:140] = np.nan
    kept = np.r_[0:100, 140:400]
    found = scoring.scores(table(gaps), table(own))
    assert value(found, "euclidean") == pytest.approx(np.linalg.norm(own[kept] - true[kept], axis=1).mean())
    gaps[5:] = np.nan
    assert pd.isna(scoring.scores(table(gaps), table(own))["value"]).all()
