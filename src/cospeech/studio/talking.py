"""A talking head in front of a stereo camera: its pose, blinking eyes, and a mouth that opens with the voice."""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.motion import head
from cospeech.studio.face import Acting, pivoted
from cospeech.studio.motion import wander

SWAY_M, SWAY_HZ = (0.004, 0.001, 0.003), (0.03, 0.2)
"""Size and range of frequencies of the sway of a seated person along each axis."""

NEUTRAL_S = 0.5
"""Time in which the sway begins, so that the first frame is the reference for all others."""

BLINK_EVERY_S, BLINK_S = (1.5, 6.0), 0.25
"""Range of the time between two blinks, and the duration of one."""

LOUD_DB, RANGE_DB = -22.0, 25.0
"""Level of the voice in decibels re full scale at which the mouth is open, and by which it is lower in a shut one."""

SMOOTHED_S = 0.08
"""Width of the window over which the level of the voice is averaged."""


def poses(angles_deg: Floats, fps: float, record: str, seed: int) -> pd.DataFrame:
    """Return the true poses of a head as a table (schema ``head_pose``).

    Parameters
    ----------
    angles_deg : (T, 3) angles x, y and z of R = Rx Ry Rz, neutral in the first frame.
    fps : frames per second.
    """
    table = head.table(angles_deg, fps)
    times_s = table["time_s"].to_numpy()
    rng = random_source(seed, "seat", record)
    sway = np.column_stack([metres * wander(times_s, *SWAY_HZ, rng) for metres in SWAY_M])
    begun = np.clip((times_s - times_s[0]) / NEUTRAL_S, 0.0, 1.0)
    table[["tx_m", "ty_m", "tz_m"]] = pivoted(angles_deg) + sway * begun[:, None]
    return table.assign(n_points=0, residual_mm=np.nan, status="tracked")


def acting(poses: pd.DataFrame, samples: Floats, rate_hz: float, record: str, seed: int) -> Acting:
    """Return what a head does while it speaks.

    Parameters
    ----------
    poses : its poses (schema ``head_pose``) in T frames.
    samples, rate_hz : (n,) sound of its voice, full scale 1, and sampling rate.
    """
    times_s = poses["time_s"].to_numpy()
    return Acting(
        poses[head.COLUMNS].to_numpy(),
        poses[["tx_m", "ty_m", "tz_m"]].to_numpy(),
        blinks(times_s, random_source(seed, "blinks", record)),
        opening(samples, rate_hz, times_s),
    )


def blinks(times_s: Floats, rng: np.random.Generator) -> Floats:
    """Return how far the eyes are shut, 0 to 1, at ascending times (T,)."""
    shut = np.zeros(len(times_s))
    at = float(rng.uniform(*BLINK_EVERY_S))
    while at < times_s[-1]:
        u = (times_s - at) / BLINK_S
        shut = np.maximum(shut, np.where((u > 0.0) & (u < 1.0), np.sin(np.pi * np.clip(u, 0.0, 1.0)) ** 2, 0.0))
        at += float(rng.uniform(*BLINK_EVERY_S))
    return shut


def opening(samples: Floats, rate_hz: float, times_s: Floats) -> Floats:
    """Return how far the mouth is open, 0 to 1, at times (T,): it follows the level of the voice in decibels."""
    power = np.concatenate([[0.0], np.cumsum(np.asarray(samples, dtype=float) ** 2)])
    edges = np.stack([times_s - SMOOTHED_S / 2, times_s + SMOOTHED_S / 2])
    first, last = np.clip(np.round(edges * rate_hz).astype(int), 0, len(samples))
    level_db = 10.0 * np.log10((power[last] - power[first]) / np.maximum(last - first, 1) + 1e-12)
    return np.clip(1.0 + (level_db - LOUD_DB) / RANGE_DB, 0.0, 1.0)
