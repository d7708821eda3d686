"""Manual input: files of clicks on the markers in the first frame, and of corrections in any frame.

Both are CSV files with the columns frame, camera, marker, x_px, y_px.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.motion.markers import NAMES

COLUMNS = ["frame", "camera", "marker", "x_px", "y_px"]


def read(path: str | Path, cameras: Sequence[Camera], n_frames: int) -> pd.DataFrame:
    """Return the rows of a file of clicks.

    Raises
    ------
    UserError : if the file is missing or is not such a table, or if a row names an unknown frame, camera or marker,
        lies outside the image, or repeats another row.
    """
    try:
        table = pd.read_csv(path, comment="#", dtype={"camera": str, "marker": str})
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; create it, or remove it from the configuration") from error
    except (ValueError, pd.errors.ParserError) as error:
        raise UserError(
            f"{path}: not a CSV table ({str(error).splitlines()[0]}); the columns are {', '.join(COLUMNS)}"
        ) from error
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        raise UserError(f"{path}: column {missing[0]} is missing; the columns are {', '.join(COLUMNS)}")
    sizes = {camera.name: camera.size_px for camera in cameras}
    for name in ("frame", "x_px", "y_px"):
        table[name] = pd.to_numeric(table[name], errors="coerce")
    for row, (frame, camera, marker, x, y) in enumerate(table[COLUMNS].itertuples(index=False), start=2):
        where = f"{path}: line {row}"
        if camera not in sizes:
            raise UserError(f"{where}: no camera '{camera}'; the rig has {', '.join(sizes)}")
        if marker not in NAMES:
            raise UserError(f"{where}: no marker '{marker}'; the markers are {', '.join(NAMES)}")
        if not (0 <= frame < n_frames and frame == np.floor(frame)):
            raise UserError(f"{where}: no frame {frame:g}; the frames of the take are 0 to {n_frames - 1}")
        width, height = sizes[camera]
        if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
            raise UserError(f"{where}: ({x:g}, {y:g}) lies outside the {width}x{height} image; click again")
    if table.duplicated(["frame", "camera", "marker"]).any():
        row = int(np.flatnonzero(table.duplicated(["frame", "camera", "marker"]))[0]) + 2
        raise UserError(
            f"{path}: line {row} repeats an earlier line (same frame, camera, marker); remove one of them"
        )
    return table[COLUMNS].astype({"frame": int})


def by_frame(table: pd.DataFrame, cameras: Sequence[Camera]) -> dict[int, list[tuple[int, int, float, float]]]:
    """Return the clicks of each frame as (marker, view, x, y)."""
    names = [camera.name for camera in cameras]
    found: dict[int, list[tuple[int, int, float, float]]] = {}
    for frame, camera, marker, x, y in table[COLUMNS].itertuples(index=False):
        found.setdefault(frame, []).append((NAMES.index(marker), names.index(camera), x, y))
    return found
