"""Distances between a synthesised head and the recorded one (Sargin 2006, 4.4.3), and correlation of their speeds.

The normalised distance is printed as a sum over frames, but the published values can only be means. The few frames in
which the angles of both heads nearly cancel dominate it; a ratio of two sums is given with it, which they do not.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry import rotation
from cospeech.motion.head import COLUMNS, EULER_ORDER, frame_rate

LAGS_S = tuple(round(0.1 * step, 1) for step in range(-10, 11))
"""Lags of the correlation of speeds in seconds."""

N_SHIFTS = 8
"""Number of shifts of a recorded head."""

FEWEST_FRAMES = 10
"""Number of common frames below which no score is defined."""


def scores(original: pd.DataFrame, made: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of a head: measure, lag_s (null where there is none) and value.

    Parameters
    ----------
    original, made : angles of the recorded and of the synthesised head of the same frames (schema ``head``). Frames
        in which one of them has no angles are left out.

    Returns
    -------
    normalised (eq. 4.20, as a mean), normalised_sums (ratio of the sums of its numerators and denominators),
    mahalanobis (eq. 4.21), euclidean (in degrees), speed_correlation (of the angular speeds), and speed_r, that at
    each of ``LAGS_S``: at a positive lag, the made head is compared with what the recorded one did earlier.
    """
    n_frames = min(len(original), len(made))
    true, own = (table[COLUMNS].to_numpy(dtype=float)[:n_frames] for table in (original, made))
    known = np.isfinite((true + own).sum(axis=1))
    rows = [(name, np.nan, value) for name, value in distances(true[known], own[known]).items()]
    fps = frame_rate(original)
    recorded, moved = speed(true, fps), speed(own, fps)
    rows.append(("speed_correlation", np.nan, _correlation(recorded, moved, 0)))
    rows += [("speed_r", lag_s, _correlation(recorded, moved, round(lag_s * fps))) for lag_s in LAGS_S]
    return pd.DataFrame(rows, columns=["measure", "lag_s", "value"])


def shifted(original: pd.DataFrame, least_s: float) -> list[pd.DataFrame]:
    """Return a recorded head at other moments: right statistics, wrong timing.

    Parameters
    ----------
    original : angles of the recorded head (schema ``head``).
    least_s : smallest circular shift in seconds, in either direction.

    Returns
    -------
    ``N_SHIFTS`` tables of the same frames, whose shifts are evenly spaced; none if the record is too short for any.
    """
    least, n_frames = round(least_s * frame_rate(original)), len(original)
    if least > n_frames - least:
        return []
    shifts = np.round(np.linspace(least, n_frames - least, N_SHIFTS)).astype(int)
    return [original.assign(**{name: np.roll(original[name], shift) for name in COLUMNS}) for shift in shifts]


def distances(true: Floats, own: Floats) -> dict[str, float]:
    """Return the distances of angles (T, 3) in degrees from the true ones by name; NaN with too few frames."""
    if len(true) < FEWEST_FRAMES:
        return dict.fromkeys(("normalised", "normalised_sums", "mahalanobis", "euclidean"), np.nan)
    apart, together = ((own - true) ** 2).sum(axis=1), ((own + true) ** 2).sum(axis=1)
    defined = together > 0.0
    weights = np.linalg.pinv(np.atleast_2d(np.cov(true.T)))
    return {
        "normalised": float((apart[defined] / together[defined]).mean()) if defined.any() else np.nan,
        "normalised_sums": float(apart.sum() / together.sum()) if defined.any() else np.nan,
        "mahalanobis": float(np.sqrt(np.einsum("ti,ij,tj->t", own - true, weights, own - true)).mean()),
        "euclidean": float(np.sqrt(apart).mean()),
    }


def speed(angles: Floats, fps: float) -> Floats:
    """Return the angular speed between the frames of angles (T, 3), (T - 1,), in degrees per second."""
    turned = rotation.from_euler(EULER_ORDER, angles)
    steps = np.swapaxes(turned[:-1], -1, -2) @ turned[1:]
    known = np.isfinite(steps.sum(axis=(1, 2)))
    speed = np.full(len(steps), np.nan)
    speed[known] = fps * rotation.angles_deg(steps[known])
    return speed


def _correlation(true: Floats, own: Floats, lag: int) -> float:
    """Return the correlation of the true speed with another one ``lag`` frames later; NaN if one does not vary."""
    first, second = (true[: len(true) - lag], own[lag:]) if lag >= 0 else (true[-lag:], own[:lag])
    known = np.isfinite(first + second)
    first, second = first[known], second[known]
    if len(first) < FEWEST_FRAMES or np.ptp(first) == 0.0 or np.ptp(second) < 1e-9:
        return float("nan")
    first, second = first - first.mean(), second - second.mean()
    return float(first @ second / np.sqrt((first @ first) * (second @ second)))
