"""What becomes of measured poses: statuses, gaps, and the lag of the printed filter."""

import numpy as np
import pytest

from cospeech.capture.head.estimate import MISSING, Measurement
from cospeech.capture.head.pose import Pose
from cospeech.capture.head.smoothing import Smoothing, pose_table
from cospeech.data import tables
from cospeech.geometry.rotation import from_euler

FPS = 30.0


def measured(angles, shift=(0.01, 0.0, -0.02)):
    turns = from_euler("XYZ", angles)
    return [
        Measurement(Pose(turn, np.array(shift)), angle, 50, 1e-3) for turn, angle in zip(turns, angles, strict=True)
    ]


def swinging(n=120):
    time = np.arange(n) / FPS
    return np.stack([10 * np.sin(4 * time), 20 * np.sin(5 * time), 5 * np.cos(3 * time)], axis=1)


def table(poses, smoothing=Smoothing.SMOOTHER, longest_s=0.5):
    return pose_table(poses, np.zeros(3), FPS, smoothing, longest_s)


def test_short_gaps_are_predicted_and_long_ones_and_both_ends_are_lost():
    angles = swinging()
    poses = measured(angles)
    for frames in (range(4), range(20, 35), range(60, 76), range(118, 120)):
        for frame in frames:
            poses[frame] = MISSING
    found = table(poses)
    expected = np.full(120, "tracked", dtype=object)
    expected[:4] = expected[60:76] = expected[118:] = "lost"
    expected[20:35] = "predicted"
    assert found["status"].tolist() == expected.tolist()
    lost = found["status"] == "lost"
    assert found.loc[lost, ["x_deg", "ty_m"]].isna().all().all()
    assert found.loc[~lost, ["x_deg", "ty_m"]].notna().all().all()
    tables.validate(found, "head_pose", "poses")
    off = np.abs(found[["x_deg", "y_deg", "z_deg"]].to_numpy() - angles)
    assert np.nanmax(off[20:35]) < 6
    assert np.nanmax(off[4:18]) < 0.3


def test_the_smoother_follows_where_the_printed_filter_lags():
    angles = swinging()
    noisy = angles + np.random.default_rng(0).normal(0, 0.2, angles.shape)
    off = {
        one: np.abs(table(measured(noisy), one)[["x_deg", "y_deg", "z_deg"]].to_numpy() - angles)[10:-10].mean()
        for one in Smoothing
    }
    assert off[Smoothing.SMOOTHER] < 0.75 * off[Smoothing.NONE]
    assert off[Smoothing.SMOOTHER] < off[Smoothing.KALMAN]


def test_without_smoothing_the_measured_angles_stay():
    angles = swinging()
    found = table(measured(angles), Smoothing.NONE)
    assert found[["x_deg", "y_deg", "z_deg"]].to_numpy() == pytest.approx(angles, abs=1e-12)
    assert found[["tx_m", "ty_m", "tz_m"]].to_numpy() == pytest.approx(np.tile([0.01, 0.0, -0.02], (120, 1)))


def test_a_film_without_any_measurement_is_lost_everywhere():
    assert (table([MISSING] * 5)["status"] == "lost").all()
