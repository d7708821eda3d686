"""TRC files (Motion Analysis; OpenSim, Pose2Sim): marker trajectories as tab-separated text.

Five header lines (path, names and values of fields, names of markers, names of coordinates) are followed by one line
per frame: its number, its time, and x, y, z of each marker. The fields of a lost marker are empty; on reading, "nan"
and three exact zeros, which other programs write, also mean lost. Commas instead of tabs, as spreadsheets save them,
are accepted.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.data.trajectories import METRES, Trajectories, without_zeros
from cospeech.errors import UserError

FIELDS = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)

LATE, DRIFT = 0.1, 0.001
"""Tolerance of the time of a frame: in frames, and in frames per frame before it (29.97 Hz called 30)."""


def write(trajectories: Trajectories, path: str | Path) -> None:
    """Write trajectories in metres, with frames counted from 1, times from 0, as is customary, and empty gaps.

    Raises
    ------
    UserError : if the name of a marker is empty or contains a tab or a line break.
    """
    names, places, fps = trajectories
    for name in names:
        if not name or name != " ".join(name.split()):
            raise UserError(f"{path}: a TRC file cannot hold the marker name {name!r}; rename the marker")
    counts = (f"{fps:.12g}", f"{fps:.12g}", len(places), len(names), "m", f"{fps:.12g}", 1, len(places))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}",
        "\t".join(FIELDS),
        "\t".join(map(str, counts)),
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{number}" for number in range(1, len(names) + 1) for axis in "XYZ"),
    ]
    for frame, row in enumerate(places.reshape(len(places), -1)):
        fields = ["" if np.isnan(value) else f"{value:.6f}" for value in row]
        lines.append("\t".join([str(frame + 1), f"{frame / fps:.6f}", *fields]))
    with tables.replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def read(path: str | Path) -> Trajectories:
    """Read a TRC file; positions in metres, NaN where a marker is lost.

    Raises
    ------
    UserError : if the file is missing, truncated or malformed, if its unit is unknown, or if its frames are not
        consecutive.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    lines = text.splitlines()
    if not text.startswith("PathFileType"):
        raise UserError(f"{path}: is not a TRC file (it does not begin with PathFileType); name a TRC file")
    if len(lines) < 6:
        raise UserError(f"{path}: is truncated in its header; copy or export it again")
    mark = "\t" if "\t" in lines[0] else ","
    fps, n_frames, n_markers, metres = _header(lines[1].split(mark), lines[2].split(mark), str(path))
    names = _names(lines[3].split(mark), n_markers, str(path))
    filled = [(number, line) for number, line in enumerate(lines[5:], start=6) if line.strip(" \t,")]
    if len(filled) != n_frames:
        raise UserError(
            f"{path}: announces {n_frames} frames and holds {len(filled)}: empty or truncated; copy it again"
        )
    rows = np.array([_row(line.split(mark), 2 + 3 * n_markers, f"{path}: line {number}") for number, line in filled])
    _check_times(rows[:, 0], rows[:, 1], fps, str(path))
    places = rows[:, 2:].reshape(n_frames, n_markers, 3) * metres
    return Trajectories(names, without_zeros(places), fps)


def _header(fields: list[str], values: list[str], where: str) -> tuple[float, int, int, float]:
    """Return the frame rate, the numbers of frames and markers, and the unit in metres."""
    given = dict(zip((field.strip() for field in fields), (value.strip() for value in values), strict=False))
    try:
        fps, n_frames, n_markers = float(given["DataRate"]), int(given["NumFrames"]), int(given["NumMarkers"])
    except (KeyError, ValueError):
        raise UserError(
            f"{where}: lines 2 and 3 do not say DataRate, NumFrames, NumMarkers; export it again"
        ) from None
    if not (1.0 <= fps <= 10000.0 and n_frames > 0 and n_markers > 0):
        raise UserError(f"{where}: {n_frames} frames of {n_markers} markers at {fps:g} Hz; export it again")
    unit = given.get("Units", "")
    if unit not in METRES:
        raise UserError(f"{where}: unknown unit '{unit[:20]}'; set Units in line 3 to one of {', '.join(METRES)}")
    return fps, n_frames, n_markers, METRES[unit]


def _names(fields: list[str], n_markers: int, where: str) -> tuple[str, ...]:
    names = tuple(field.strip() for field in fields[2 : 2 + 3 * n_markers : 3])
    spare = [field.strip() for index, field in enumerate(fields[2:]) if index % 3 or index >= 3 * n_markers]
    if len(names) != n_markers or not all(names) or any(spare):
        raise UserError(
            f"{where}: line 4 does not name {n_markers} markers, each over three columns; export it again"
        )
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"{where}: two markers are called '{name}'; give each marker its own name")
    return names


def _row(fields: list[str], n_fields: int, where: str) -> list[float]:
    """Return the numbers of one line, NaN for empty fields."""
    if any(field.strip() for field in fields[n_fields:]):
        raise UserError(f"{where}: has more than {n_fields} values; copy or export the file again")
    padded = fields[:n_fields] + [""] * (n_fields - len(fields))
    try:
        numbers = [float(field) if field.strip() else np.nan for field in padded]
    except ValueError as error:
        raise UserError(f"{where}: has a value that is not a number ({str(error)[:60]}); correct it") from None
    if np.isinf(numbers).any():
        raise UserError(f"{where}: holds an infinite number; correct it, or leave the field empty where lost")
    return numbers


def _check_times(frames: Floats, times_s: Floats, fps: float, where: str) -> None:
    wrong = np.flatnonzero(np.diff(frames) != 1)
    if np.isnan(frames).any() or len(wrong):
        row = int(np.flatnonzero(np.isnan(frames))[0] if np.isnan(frames).any() else wrong[0] + 1)
        raise UserError(
            f"{where}: frame {row} (from 0) is not numbered one more than the one before; export it again"
        )
    count = np.arange(len(times_s))
    off = np.flatnonzero(~(np.abs((times_s - times_s[0]) * fps - count) <= LATE + DRIFT * count))
    if len(off):
        row = int(off[0])
        raise UserError(f"{where}: the time of frame {row} (from 0) contradicts {fps:g} Hz; correct DataRate")
