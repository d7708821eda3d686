"""The files that a person fills: clicks on the markers of the first frame, and corrections of any frame.

Both are CSV with the columns frame, camera, marker, x_px, y_px.
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
    UserError : where the file is missing or no such table, or a row names no frame, camera or marker of the take,
        lies outside its picture, or repeats another.
    """
    try:
        table = pd.read_csv(path, comment="#", dtype={"camera": str, "marker": str})
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; make it, or leave it out of the config") from error
    except (ValueError, pd.errors.ParserError) as error:
        raise UserError(f"{path}: no table of clicks ({str(error).splitlines()[0]})") from error
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
            raise UserError(f"{where}: frame {frame:g} is none of the take's; they are 0 to {n_frames - 1}")
        width, height = sizes[camera]
        if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
            raise UserError(f"{where}: ({x:g}, {y:g}) lies outside the picture of {width}x{height}; click it anew")
    if table.duplicated(["frame", "camera", "marker"]).any():
        row = int(np.flatnonzero(table.duplicated(["frame", "camera", "marker"]))[0]) + 2
        raise UserError(f"{path}: line {row} repeats a marker of an earlier line; keep one of them")
    return table[COLUMNS].astype({"frame": int})


def by_frame(table: pd.DataFrame, cameras: Sequence[Camera]) -> dict[int, list[tuple[int, int, float, float]]]:
    """Return the clicks of each frame as (marker, view, x, y)."""
    names = [camera.name for camera in cameras]
    found: dict[int, list[tuple[int, int, float, float]]] = {}
    for frame, camera, marker, x, y in table[COLUMNS].itertuples(index=False):
        found.setdefault(frame, []).append((NAMES.index(marker), names.index(camera), x, y))
    return found
