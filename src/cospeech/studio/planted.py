"""Ground truth of a film as tables: the positions of the markers in 3D and in each view, and their visible pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera, project
from cospeech.motion.markers import NAMES


def in_views(cameras: Sequence[Camera], markers_m: Floats, seen: Floats) -> pd.DataFrame:
    """Return the table ``markers_2d`` of markers (T, 15, 3) in metres with ``seen`` (C, T, 15) visible pixels.

    A hidden marker has the status ``lost``, but its true position.
    """
    views = []
    for camera, shown in zip(cameras, seen, strict=True):
        pixels = project(camera, markers_m).reshape(-1, 2)
        count = np.rint(shown).astype(np.int64).ravel()
        view = _index(len(markers_m))
        view["camera"], view["x_px"], view["y_px"] = camera.name, pixels[:, 0], pixels[:, 1]
        view["n_pixels"], view["status"] = count, np.where(count > 0, "seen", "lost")
        views.append(view)
    table = pd.concat(views).sort_values(["frame", "camera"], kind="stable", ignore_index=True)
    return table[["frame", "camera", "marker", "x_px", "y_px", "n_pixels", "status"]]


def in_world(markers_m: Floats, seen: Floats, fps: float) -> pd.DataFrame:
    """Return the table ``markers_3d`` of markers (T, 15, 3) in metres with ``seen`` (C, T, 15) visible pixels."""
    table = _index(len(markers_m))
    table.insert(1, "time_s", (table["frame"] + 0.5) / fps)
    table[["x_m", "y_m", "z_m"]] = markers_m.reshape(-1, 3)
    table["n_views"] = (np.rint(seen) > 0).sum(axis=0).astype(np.int64).ravel()
    table["residual_px"] = np.nan
    table["status"] = "seen"
    return table


def _index(n_frames: int) -> pd.DataFrame:
    return pd.DataFrame({"frame": np.repeat(np.arange(n_frames), len(NAMES)), "marker": list(NAMES) * n_frames})
