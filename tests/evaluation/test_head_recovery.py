"""Errors of captured heads, agreement of patterns and the lag between head and melody, on planted cases."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables
from cospeech.evaluation import head_recovery
from cospeech.geometry import rotation


def poses(angles_deg, places_m=None, status="tracked"):
    n_frames = len(angles_deg)
    places_m = np.zeros((n_frames, 3)) if places_m is None else places_m
    return pd.DataFrame(
        {"frame": np.arange(n_frames), "time_s": segments.frame_times(n_frames, 30.0)}
        | {f"{axis}_deg": angles_deg[:, place] for place, axis in enumerate("xyz")}
        | {f"t{axis}_m": places_m[:, place] for place, axis in enumerate("xyz")}
        | {"n_points": 100, "residual_mm": 0.1, "status": status}
    )


def test_poses_are_compared_relative_to_the_reference_frame():
    rng = np.random.default_rng(0)
    true = rng.uniform(-30, 30, (50, 3))  # and so the reference is not neutral
    places = rng.normal(0.0, 0.02, (50, 3))
    turned = rotation.from_euler("XYZ", true)
    seen = rotation.to_euler("XYZ", turned @ turned[0].T)
    found = head_recovery.captured(poses(true, places), poses(seen, places - places[0])).set_index("quantity")
    assert found["largest"].max() < 1e-6
    tables.validate(found.reset_index().assign(actor="a", record="r"), "head_capture", "x")


def test_errors_of_each_axis_are_those_that_were_added():
    true = np.zeros((40, 3))
    seen, places = true.copy(), np.zeros((40, 3))
    seen[10:, 1] += 2.0
    places[:20, 2] += 0.004
    places -= places[0]
    seen[5] = np.nan
    status = np.where(np.isnan(seen[:, 0]), "lost", "tracked")
    found = head_recovery.captured(poses(true), poses(seen, places, status)).set_index("quantity")
    assert found.loc["x", "largest"] == pytest.approx(0, abs=1e-9)
    assert found.loc["y", "mean"] == pytest.approx(2.0 * 30 / 39)
    assert found.loc["rotation", "largest"] == pytest.approx(2.0)
    assert found.loc["position", "largest"] == pytest.approx(4.0)
    assert (found["n_frames"] == 40).all()
    assert (found["n_tracked"] == 39).all()


def movements(rng, n=60):
    lengths = rng.integers(40, 120, n)
    labels = rng.choice(["r1", "r2", "r3"], n)
    labels[1:][labels[1:] == labels[:-1]] = "none"
    starts = np.append(0, np.cumsum(lengths)[:-1])
    return segments.from_starts("x", starts, labels, int(lengths.sum()), 100.0)


def shifted(table, lag, labels, rng=None, share=1.0):
    starts = np.maximum(table["start_frame"].to_numpy() - lag, 0)
    starts[0] = 0
    given = table["label"].map(labels).to_numpy(dtype=object)
    if rng is not None:
        loose = rng.random(len(given)) > share
        given[loose] = rng.choice(list(labels.values()), loose.sum())
    return segments.from_starts("x", starts, given, int(table["end_frame"].iloc[-1]), 100.0)


LABELS = {"r1": "nod", "r2": "turn_left", "r3": "tilt_left", "none": "rest"}


@pytest.mark.parametrize("lag", [-20, 0, 7, 24])
def test_the_lag_is_found_within_a_hundredth_of_a_second(lag):
    rng = np.random.default_rng(lag + 100)
    melodies = {record: movements(rng) for record in "ab"}
    heads = {record: shifted(table, lag, LABELS, rng, 0.8) for record, table in melodies.items()}
    rows = head_recovery.lags("found", heads, melodies)
    assert rows[-1]["value"] == pytest.approx(lag / 100, abs=0.012)
    tables.validate(head_recovery.table([row | {"actor": "a"} for row in rows]), "head_recovery", "x")


def test_information_is_that_of_counts_by_hand():
    one = segments.from_labels("x", ["a"] * 50 + ["b"] * 50, 50.0)
    assert head_recovery.lags("found", {"x": one}, {"x": one})[50]["value"] == pytest.approx(1.0)
    other = segments.from_labels("x", ["a", "b"] * 50, 50.0)
    assert head_recovery.lags("found", {"x": one}, {"x": other})[50]["value"] == pytest.approx(0.0, abs=1e-12)


def test_agreement_is_one_under_other_names_and_near_zero_by_chance():
    rng = np.random.default_rng(3)
    planted = movements(rng, 200)
    renamed = planted.assign(label=planted["label"].map(LABELS))
    [row] = head_recovery.agreement("head_ami", planted, renamed)
    assert row["value"] == pytest.approx(1.0)
    [row] = head_recovery.agreement("head_ami", planted, planted.assign(label=rng.permutation(planted["label"])))
    assert abs(row["value"]) < 0.06


def test_the_planted_lag_is_that_of_coupled_patterns():
    joints = pd.DataFrame({"lag_s": [0.1, 0.3, 9.0], "coupled": [True, True, False]})
    assert head_recovery.planted_lag(joints)[0]["value"] == pytest.approx(0.2)
