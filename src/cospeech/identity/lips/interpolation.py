"""Lip features at the rate of the sound features (Sargin 2006, 2.2)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from cospeech.data.arrays import Floats

COEFFICIENTS = 50
COLUMNS = [f"d{n}" for n in range(1, COEFFICIENTS + 1)]


def at_rate(lips: pd.DataFrame, times_s: Floats) -> Floats:
    """Return the lip features of one clip at ``times_s`` (T,), (T, 50), by natural cubic splines.

    Parameters
    ----------
    lips : table of lip features (schema ``lips``) of one clip.
    times_s : times in seconds; before the first and after the last frame of the film, its features are repeated.
    """
    known_s = lips["time_s"].to_numpy(dtype=float)
    features = lips[COLUMNS].to_numpy(dtype=float)
    if len(known_s) == 1:
        return np.repeat(features, len(times_s), axis=0)
    return np.asarray(CubicSpline(known_s, features, bc_type="natural")(np.clip(times_s, known_s[0], known_s[-1])))
