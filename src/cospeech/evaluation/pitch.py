"""Recovery of the planted pitch and voicing: by the printed features, and by the pitch track."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats

GROSS = 0.2
"""Relative error of the period above which an error of pitch is gross, such as an octave."""


def errors(
    planted: pd.DataFrame, measured: pd.DataFrame, voiced_gain: float, track: pd.DataFrame
) -> list[dict[str, Any]]:
    """Return the errors of pitch and voicing in one record, over its prosody frames.

    Rows: voicing_errors (share of frames whose pitch gain tells their voicing wrong), track_voicing_errors (the same
    for the pitch track) and track_gross_errors (share of gross errors among the frames that are voiced and tracked as
    such). ``recovery.pitch`` returns the gross errors of the printed features.

    Parameters
    ----------
    planted : time_s, lag_s (null in unvoiced frames).
    measured : pitch_gain; the prosody table of the record.
    voiced_gain : pitch gain above which a frame is voiced.
    track : time_s, f0_hz; the pitch table of the record, with frames of any period.
    """
    n_frames = min(len(planted), len(measured))
    true_s = planted["lag_s"].to_numpy(dtype=float)[:n_frames]
    gain = measured["pitch_gain"].to_numpy()[:n_frames]
    found_s = 1.0 / _at(track, planted["time_s"].to_numpy()[:n_frames])
    voiced = ~np.isnan(true_s)
    both = voiced & ~np.isnan(found_s)
    rows = [
        {"quantity": "voicing_errors", "value": float(np.mean((gain > voiced_gain) != voiced)), "n": n_frames},
        {"quantity": "track_voicing_errors", "value": float(np.mean(np.isnan(found_s) == voiced)), "n": n_frames},
    ]
    if both.any():
        off = np.abs(found_s[both] / true_s[both] - 1)
        rows.append({"quantity": "track_gross_errors", "value": float(np.mean(off > GROSS)), "n": int(both.sum())})
    return rows


def _at(track: pd.DataFrame, time_s: Floats) -> Floats:
    """Return the pitch of the track's frame with the centre nearest to each time."""
    centre_s = track["time_s"].to_numpy()
    after = np.clip(np.searchsorted(centre_s, time_s), 1, len(centre_s) - 1)
    nearest = after - (time_s - centre_s[after - 1] < centre_s[after] - time_s)
    return np.asarray(track["f0_hz"].to_numpy(dtype=float)[nearest])
