"""Marker positions as an array (T, M, 3), with NaN where a marker is lost, and as a ``markers_3d`` table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.segments import frame_times

AXES = ["x_m", "y_m", "z_m"]

SEEN = ("seen", "corrected")
"""The statuses of positions that were measured and not predicted."""


class Trajectories(NamedTuple):
    """Markers of a file: names (M,), positions (T, M, 3) in metres, NaN where lost, and frames per second.

    Names may occur more than once in files of other systems. ``notes`` say how a file was interpreted.
    """

    names: tuple[str, ...]
    places_m: Floats
    fps: float
    notes: tuple[str, ...] = ()


def without_zeros(places_m: Floats) -> Floats:
    """Return positions (T, M, 3) with NaN where a marker is lost: a coordinate is NaN, or all three are zero."""
    lost = np.any(np.isnan(places_m), axis=2) | np.all(places_m == 0.0, axis=2)
    return np.where(lost[:, :, None], np.nan, places_m)


def frame_rate(table: pd.DataFrame) -> float:
    """Return the frame rate of a ``markers_3d`` table in frames per second, from its first row."""
    frame, time_s = table[["frame", "time_s"]].iloc[0].to_numpy(dtype=float)
    return round((frame + 0.5) / time_s, 6)


def to_array(table: pd.DataFrame, names: Sequence[str]) -> Floats:
    """Return the positions (T, M, 3) of the markers ``names`` in metres, NaN where the table has none."""
    known = table[table["marker"].isin(list(names))]
    places = np.full((int(table["frame"].max()) + 1, len(names), 3), np.nan)
    which = known["marker"].map({name: index for index, name in enumerate(names)}).to_numpy(dtype=int)
    places[known["frame"].to_numpy(), which] = known[AXES].to_numpy(dtype=float)
    return places


def from_table(table: pd.DataFrame, names: Sequence[str]) -> Trajectories:
    """Return the trajectories of the markers ``names`` in a ``markers_3d`` table."""
    return Trajectories(tuple(names), to_array(table, names), frame_rate(table))


def to_table(places_m: Floats, names: Sequence[str], fps: float) -> pd.DataFrame:
    """Return the ``markers_3d`` table of positions (T, M, 3) in metres from another system, NaN where lost."""
    n_frames, n_markers = places_m.shape[:2]
    flat = places_m.reshape(-1, 3)
    lost = np.any(np.isnan(flat), axis=1)
    frames = np.repeat(np.arange(n_frames), n_markers)
    columns = {
        "frame": frames,
        "time_s": frame_times(n_frames, fps)[frames],
        "marker": list(names) * n_frames,
        **dict(zip(AXES, np.where(lost[:, None], np.nan, flat).T, strict=True)),
        "n_views": pd.array([pd.NA] * len(flat), dtype="Int64"),
        "residual_px": np.full(len(flat), np.nan),
        "status": np.where(lost, "lost", "seen"),
    }
    return pd.DataFrame(columns)
