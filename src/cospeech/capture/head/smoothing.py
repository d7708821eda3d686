"""From measured poses to the table ``head_pose``: smoothing, and filling of short gaps.

The printed Kalman filter (4.6-4.7) lags behind. The smoother of Rauch, Tung and Striebel with its model does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

import numpy as np
import pandas as pd

from cospeech.capture.head.estimate import Measurement
from cospeech.data.arrays import Flags, Floats
from cospeech.geometry.kalman import difference_model, filter_and_smooth

ANGLE_SD_DEG, ANGLE_ACCELERATION = 0.2, 250.0
"""Standard deviation of a measured angle; of the angular acceleration of a head, degrees/s^2."""

PLACE_SD_M, PLACE_ACCELERATION = 0.0005, 2.0
"""Standard deviation of a measured displacement; of the acceleration of a head, m/s^2."""

VALUE_SHARE = 0.1
"""Noise of a value itself, as a share of that of its first difference."""

START_SD = 1e3
"""Standard deviation of the state before the first frame, relative to that of a measurement."""


class Smoothing(Enum):
    """What is done to the measured angles: the smoother, the printed filter, or nothing."""

    SMOOTHER = "smoother"
    KALMAN = "kalman"
    NONE = "none"


def pose_table(
    measured: Sequence[Measurement], centre_m: Floats, fps: float, smoothing: Smoothing, longest_hidden_s: float
) -> pd.DataFrame:
    """Return the poses of a film as a table ``head_pose``.

    Frames without a measurement are ``predicted`` in gaps between measured frames that last up to
    ``longest_hidden_s``, and ``lost`` elsewhere.

    Parameters
    ----------
    measured : one per frame.
    centre_m : (3,) the point of the reference frame whose displacement is reported, in the centre of the head.
    """
    angles = np.array([one.angles_deg for one in measured]).reshape(-1, 3)
    shifts = np.array(
        [np.full(3, np.nan) if one.pose is None else one.pose.points(centre_m) - centre_m for one in measured]
    ).reshape(-1, 3)
    tracked = np.isfinite(angles[:, 0])
    filled = _short_gaps(tracked, int(longest_hidden_s * fps + 1e-9))
    known = tracked | filled
    angles = smoothed_angles(angles, fps, smoothing)
    shifts = _smoothed(shifts, PLACE_SD_M, PLACE_ACCELERATION / fps**2, smoothing)
    angles[~known], shifts[~known] = np.nan, np.nan
    return pd.DataFrame(
        {
            "frame": np.arange(len(measured)),
            "time_s": (np.arange(len(measured)) + 0.5) / fps,
            **{f"{axis}_deg": angles[:, number] for number, axis in enumerate("xyz")},
            **{f"t{axis}_m": shifts[:, number] for number, axis in enumerate("xyz")},
            "n_points": [one.n_points for one in measured],
            "residual_mm": [1000.0 * one.residual_m for one in measured],
            "status": np.where(tracked, "tracked", np.where(filled, "predicted", "lost")),
        }
    )


def smoothed_angles(angles_deg: Floats, fps: float, smoothing: Smoothing) -> Floats:
    """Return measured angles (T, 3) in degrees filtered or smoothed; gaps (NaN) are filled whatever is chosen."""
    return _smoothed(angles_deg, ANGLE_SD_DEG, ANGLE_ACCELERATION / fps**2, smoothing)


def _short_gaps(tracked: Flags, longest: int) -> Flags:
    """Return which frames (T,) lie in gaps of at most ``longest`` frames between tracked ones."""
    filled = np.zeros(len(tracked), dtype=bool)
    places = np.flatnonzero(tracked)
    for before, after in pairwise(places.tolist()):
        if after - before - 1 <= longest:
            filled[before + 1 : after] = True
    return filled


def _smoothed(values: Floats, sd: float, change_sd: float, smoothing: Smoothing) -> Floats:
    """Return values (T, 3) filtered or smoothed; gaps are filled whatever is chosen."""
    present = np.isfinite(values[:, 0])
    if not present.any():
        return values.copy()
    first = values[present][0]
    transition, noise = difference_model(VALUE_SHARE * change_sd, change_sd)
    filtered, smoothed, _ = filter_and_smooth(
        values - first, np.full(len(values), sd**2), transition, noise, np.diag(np.full(2, (START_SD * sd) ** 2))
    )
    if smoothing is Smoothing.KALMAN:
        return filtered + first
    if smoothing is Smoothing.NONE:
        return np.where(present[:, None], values, smoothed + first)
    return smoothed + first
