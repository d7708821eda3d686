"""Motion statistics of motions with known speed, acceleration and jerk."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.evaluation import motion
from cospeech.motion import skeleton

FPS = 50.0


def table(root_m=None, angles=None, fps=FPS, n_frames=400):
    root = np.zeros((n_frames, 3)) if root_m is None else root_m
    turned = np.zeros((len(root), len(skeleton.JOINTS), 3)) if angles is None else angles
    return skeleton.motion_table(root, turned, fps)


def swinging(amplitude_deg, rate_hz, n_frames=400, fps=FPS):
    """A forearm that swings about the elbow: the hand moves on a circle with the forearm as radius."""
    angles = np.zeros((n_frames, len(skeleton.JOINTS), 3))
    phase = 2 * np.pi * rate_hz * np.arange(n_frames) / fps
    angles[:, skeleton.JOINTS.index("left_forearm"), 0] = -45 + amplitude_deg * np.sin(phase)
    return table(angles=angles, fps=fps)


def test_constant_velocity_has_no_acceleration():
    root = np.outer(np.arange(400) / FPS, [0.3, 0.0, 0.4])
    found = motion.magnitudes(table(root))
    for joint in motion.JOINTS:
        np.testing.assert_allclose(found["speed", joint], 0.5, atol=1e-9)
        np.testing.assert_allclose(found["acceleration", joint], 0, atol=1e-7)
        np.testing.assert_allclose(found["jerk", joint], 0, atol=1e-5)
        assert [len(found[quantity, joint]) for quantity in motion.UNITS] == [399, 398, 397]


def test_free_fall_and_a_constant_jerk():
    time_s = np.arange(400) / FPS
    fall = np.column_stack([0 * time_s, -0.5 * 9.81 * time_s**2, 0 * time_s])
    np.testing.assert_allclose(motion.magnitudes(table(fall))["acceleration", "left_hand"], 9.81, atol=1e-6)
    cubic = np.column_stack([time_s**3, 0 * time_s, 0 * time_s])
    np.testing.assert_allclose(motion.magnitudes(table(cubic))["jerk", "left_hand"], 6.0, atol=1e-4)


def test_the_speed_of_a_swinging_hand_is_radius_times_angular_speed():
    amplitude, rate = 10.0, 0.5
    found = motion.magnitudes(swinging(amplitude, rate))
    radius = abs(skeleton.OFFSET_M["left_hand"][1])
    fastest = radius * math.radians(amplitude) * 2 * math.pi * rate
    assert found["speed", "left_hand"].max() == pytest.approx(fastest, rel=1e-3)
    assert found["speed", "left_forearm"].max() == pytest.approx(0, abs=1e-12)  # the elbow does not move


def test_hellinger_of_simple_distributions():
    assert motion.hellinger(np.array([1.0, 0.0]), np.array([0.0, 1.0])) == 1
    assert motion.hellinger(np.array([0.5, 0.5]), np.array([0.5, 0.5])) == 0
    expected = math.sqrt(1 - (math.sqrt(0.5 * 0.9) + math.sqrt(0.5 * 0.1)))
    assert motion.hellinger(np.array([0.5, 0.5]), np.array([0.9, 0.1])) == pytest.approx(expected)


SHARES = st.lists(st.floats(0.001, 1), min_size=5, max_size=5).map(lambda x: np.array(x) / sum(x))


@given(SHARES, SHARES, SHARES)
def test_hellinger_is_a_metric(p, q, r):
    d = motion.hellinger
    assert 0 <= d(p, q) <= 1
    assert d(p, q) == d(q, p)
    assert d(p, p) == pytest.approx(0, abs=1e-7)
    assert d(p, r) <= d(p, q) + d(q, r) + 1e-7


def test_values_beyond_the_last_edge_are_in_the_last_bin():
    edges = np.linspace(0, 1, 5)
    assert motion.histogram(np.array([0.0, 0.25, 0.99, 1.0, 7.0]), edges).tolist() == [0.2, 0.2, 0, 0.6]


ACTORS = {"a1": "a", "a2": "a", "b1": "b", "b2": "b"}


def motions():
    found = {}
    for place, record in enumerate(ACTORS):
        found[motion.ORIGINAL, record] = swinging(20 + 2 * place, 0.5)
        found["same", record] = swinging(20 + 2 * place, 0.5)
        found["still", record] = table()
    return found


def test_statistics_distinguish_systems(tmp_path):
    statistics, histograms = motion.statistics(motions(), ACTORS, 40)
    wrist = statistics[(statistics["joint"] == "left_hand") & (statistics["quantity"] == "speed")]
    distance = wrist.groupby("system")["hellinger"].mean()
    assert math.isnan(distance[motion.ORIGINAL])
    assert distance["same"] == pytest.approx(0, abs=1e-7)
    assert 0 < distance[motion.OTHER_ORIGINAL] < distance["still"]
    assert set(statistics["fps"]) == {FPS}
    assert statistics.groupby("quantity")["unit"].first().to_dict() == motion.UNITS
    total = histograms.groupby(["system", "actor", "quantity", "joint"])["share"].sum()
    np.testing.assert_allclose(total, 1)
    for name, found in (("motion_statistics", statistics), ("motion_histograms", histograms)):
        tables.write(found, tmp_path / "t.parquet", name, corpus="virtual", config_hash="0")


def test_another_original_is_the_mean_over_the_other_records_of_the_actor():
    statistics, _ = motion.statistics(motions(), ACTORS, 40)
    where = (statistics["joint"] == "left_hand") & (statistics["quantity"] == "speed")
    other = statistics[where & (statistics["system"] == motion.OTHER_ORIGINAL)].set_index("record")["hellinger"]
    # With two records per actor, each is compared only with the other.
    assert other["a1"] == other["a2"]
    assert other["b1"] == other["b2"]


def test_different_frame_rates_are_rejected():
    mixed = motions() | {("same", "b2"): swinging(20, 0.5, fps=25.0)}
    with pytest.raises(UserError, match=r"record 'b2' \(same\) has 25 frames/s"):
        motion.statistics(mixed, ACTORS, 40)


def test_motionless_originals_still_have_bins():
    still = {(motion.ORIGINAL, "a1"): table(), (motion.ORIGINAL, "a2"): table()}
    statistics, _ = motion.statistics(still, {"a1": "a", "a2": "a"}, 10)
    assert (statistics["mean"] == 0).all()
    assert pd.notna(statistics.loc[statistics["system"] == motion.OTHER_ORIGINAL, "hellinger"]).all()


def test_a_system_that_made_no_motion_of_one_record_is_left_out():
    known = motion.statistics(motions(), ACTORS, 40)
    failed = {("failed", record): table()[: 0 if record == "b1" else None] for record in ACTORS}
    for found, expected in zip(motion.statistics(motions() | failed, ACTORS, 40), known, strict=True):
        pd.testing.assert_frame_equal(found, expected)


def test_the_last_bin_begins_within_the_fastest_half_percent():
    values = np.arange(1001.0)
    quantities = {(quantity, joint): values for quantity in motion.UNITS for joint in motion.JOINTS}
    edges = motion.bin_edges([quantities], 10)
    assert all(found[-1] == pytest.approx(995) for found in edges.values())
