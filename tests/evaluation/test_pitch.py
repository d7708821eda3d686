"""Errors of pitch and voicing are counted over the frames that their definitions name."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import pitch, recovery

STEP_S = 0.025


def values(planted_s, gain, track_hz, track_step_s=0.01):
    time_s = (np.arange(len(planted_s)) + 0.5) * STEP_S
    planted = pd.DataFrame({"time_s": time_s, "lag_s": planted_s})
    measured = pd.DataFrame({"pitch_gain": gain})
    track = pd.DataFrame({"time_s": (np.arange(len(track_hz)) + 0.5) * track_step_s, "f0_hz": track_hz})
    rows = pitch.errors(planted, measured, 0.4, track)
    tables.validate(recovery.table([row | {"actor": "a", "record": "a"} for row in rows]), "recovery", "x")
    return {row["quantity"]: row["value"] for row in rows}, {row["quantity"]: row["n"] for row in rows}


def test_each_error_is_counted_over_its_frames():
    planted_s = np.array([0.01, 0.01, 0.01, 0.01, np.nan, np.nan, np.nan, np.nan])
    gain = [0.9, 0.41, 0.4, 0.9, 0.5, 0.3, 0.3, 0.3]  # wrong in frames 2 and 4
    # With frames of the same period: one gross error, one at its limit, one missing, one false.
    found, n = values(planted_s, gain, [100, 100 / 1.21, 100 / 1.19, np.nan, 90, np.nan, np.nan, np.nan], STEP_S)
    assert found == pytest.approx(
        {"voicing_errors": 2 / 8, "track_voicing_errors": 2 / 8, "track_gross_errors": 1 / 3}
    )
    assert n == {"voicing_errors": 8, "track_voicing_errors": 8, "track_gross_errors": 3}


def test_the_nearest_frame_of_the_track_counts():
    # The centres of the prosody frames, 12.5, 37.5, 62.5 and 87.5 ms, are nearest to frames 1, 3, 6 and 8.
    track_hz = np.full(10, np.nan)
    track_hz[[1, 3, 6, 8]] = 100
    found, _ = values(np.full(4, 0.01), np.ones(4), track_hz)
    assert found == {"voicing_errors": 0, "track_voicing_errors": 0, "track_gross_errors": 0}


def test_without_a_frame_that_is_voiced_in_both_there_is_no_gross_error():
    found, _ = values(np.full(2, np.nan), np.zeros(2), np.full(5, np.nan))
    assert found == {"voicing_errors": 0, "track_voicing_errors": 0}
