"""C3D files (c3d.org), the exchange format of motion capture laboratories, by way of the library ezc3d.

A marker is lost where its residual is -1, a coordinate is NaN, or all three are exactly zero. The unit is the free
text POINT:UNITS; files without it are rejected, because their sizes cannot be known.
"""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from cospeech.data import tables
from cospeech.data.trajectories import METRES, Trajectories, without_zeros
from cospeech.errors import UserError

SECTION, MAGIC, BIG_ENDIAN = 512, 0x50, 86
"""Bytes in a section; the second byte of every C3D file; the processor type with big-endian numbers."""


def write(trajectories: Trajectories, path: str | Path) -> None:
    """Write trajectories in millimetres, as is customary, with a residual of -1 in gaps."""
    names, places, fps = trajectories
    lost = np.any(np.isnan(places), axis=2).T
    points = np.ones((4, len(names), len(places)))
    points[:3] = np.where(lost, np.nan, places.transpose(2, 1, 0) / METRES["mm"])
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [fps]
    point["UNITS"]["value"] = ["mm"]
    point["LABELS"]["value"] = list(names)
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Y"])
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(lost, -1.0, 0.0)[None]
    with tables.replacing(path) as temporary:
        file.write(os.fspath(temporary))


def read(path: str | Path) -> Trajectories:
    """Read the markers of a C3D file; positions in metres, NaN where a marker is lost.

    Raises
    ------
    UserError : if the file is missing or damaged, or has no markers, no known unit or no frame rate.
    """
    announced = _announced(path)
    file = _open(path)
    point = file["parameters"]["POINT"]
    units = [str(unit).strip() for unit in point.get("UNITS", {}).get("value", [])]
    unit = next(iter(units), "")
    if not unit:
        raise UserError(
            f"{path}: does not say its unit (POINT:UNITS is empty); set it to m, cm or mm, and save it again"
        )
    if unit.lower() not in METRES:
        raise UserError(f"{path}: unknown unit '{unit[:20]}' in POINT:UNITS; set it to one of {', '.join(METRES)}")
    points = file["data"]["points"]
    _, n_markers, n_frames = points.shape
    if n_frames < announced:
        raise UserError(
            f"{path}: announces {announced} frames and holds {n_frames}: truncated; copy or export it again"
        )
    names = tuple(str(name).strip() for name in point["LABELS"]["value"])[:n_markers]
    if n_markers == 0 or n_frames == 0 or len(names) < n_markers:
        raise UserError(f"{path}: {n_frames} frames of {n_markers} markers with {len(names)} names; export it again")
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"{path}: two markers are called '{name}'; give each marker its own name")
    fps = float(next(iter(point["RATE"]["value"]), 0.0))
    if not fps >= 1.0:
        raise UserError(f"{path}: a frame rate of {fps:g} Hz (POINT:RATE); set it and save the file again")
    lost = (file["data"]["meta_points"]["residuals"][0] < 0) | ~np.isfinite(points[:3]).all(axis=0)
    places = np.where(lost, np.nan, points[:3] * METRES[unit.lower()]).transpose(2, 1, 0)
    return Trajectories(names, without_zeros(places), fps)


def _announced(path: str | Path) -> int:
    """Return the number of frames in the header of the file, which ezc3d replaces by the number that it finds."""
    try:
        with Path(path).open("rb") as file:
            start = file.read(SECTION)
            file.seek(SECTION * max(start[0] - 1, 0) if start else 0)
            parameters = file.read(4)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    if len(start) < SECTION or start[1] != MAGIC or len(parameters) < 4:
        raise UserError(f"{path}: is not a C3D file, or truncated; name a C3D file, or copy it again")
    first, last = struct.unpack_from(">HH" if parameters[3] == BIG_ENDIAN else "<HH", start, 6)
    return last - first + 1


def _open(path: str | Path) -> Any:
    """Return the file as read by ezc3d, after a trial in a separate process, as damaged files can crash ezc3d."""
    trial = [sys.executable, "-I", "-c", "import sys, ezc3d; ezc3d.c3d(sys.argv[1])", os.fspath(path)]
    tried = subprocess.run(trial, capture_output=True, text=True, errors="replace", check=False)
    if tried.returncode != 0:
        said = tried.stderr.strip().splitlines()
        reason = said[-1].strip()[:80] if tried.returncode > 0 and said else "it crashes the reader"
        raise UserError(f"{path}: damaged ({reason}); copy or export it again")
    return ezc3d.c3d(os.fspath(path))
