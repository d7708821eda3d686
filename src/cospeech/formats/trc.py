"""TRC files (Motion Analysis; OpenSim, Pose2Sim): marker trajectories as tab-separated text.

Five lines of header (path, names and values of its fields, names of the markers, names of their coordinates), then
one line a frame: its number, its time, and x, y, z of each marker. A lost marker is an empty field; we also take
"nan" and three exact zeros for lost, as other programs write them. Commas in the place of tabs, as spreadsheets leave
them, are read.
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
"""How far the time of a frame may be off its number: in frames, and in frames a frame (29.97 Hz called 30)."""


def write(trajectories: Trajectories, path: str | Path) -> None:
    """Write trajectories in metres, frames counted from 1 and time from 0 as is custom, gaps as empty fields.

    Raises
    ------
    UserError : where a marker's name is empty or holds a tab or a line's end.
    """
    names, places, fps = trajectories
    for name in names:
        if not name or name != " ".join(name.split()):
            raise UserError(f"{path}: no TRC file can hold the marker name {name!r}; rename the marker")
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
    """Read a TRC file; places in metres, NaN where a marker is lost.

    Raises
    ------
    UserError : missing, truncated or malformed file, an unknown unit, frames that are not one after the other.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    lines = text.splitlines()
    if not text.startswith("PathFileType"):
        raise UserError(f"{path}: is no TRC file (it does not begin with PathFileType); name a TRC file")
    if len(lines) < 6:
        raise UserError(f"{path}: is cut off in its header; copy or export it again")
    mark = "\t" if "\t" in lines[0] else ","
    fps, n_frames, n_markers, metres = _header(lines[1].split(mark), lines[2].split(mark), str(path))
    names = _names(lines[3].split(mark), n_markers, str(path))
    filled = [(number, line) for number, line in enumerate(lines[5:], start=6) if line.strip(" \t,")]
    if len(filled) != n_frames:
        raise UserError(
            f"{path}: announces {n_frames} frames and holds {len(filled)}: empty or cut off; copy or export it again"
        )
    rows = np.array([_row(line.split(mark), 2 + 3 * n_markers, f"{path}: line {number}") for number, line in filled])
    _check_times(rows[:, 0], rows[:, 1], fps, str(path))
    places = rows[:, 2:].reshape(n_frames, n_markers, 3) * metres
    return Trajectories(names, without_zeros(places), fps)


def _header(fields: list[str], values: list[str], where: str) -> tuple[float, int, int, float]:
    """Return frame rate, number of frames and of markers, and the metres of the unit."""
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
        raise UserError(f"{where}: the unit is '{unit[:20]}', known are {', '.join(METRES)}; write Units in line 3")
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
            raise UserError(f"{where}: two markers are called '{name}'; give each its own name")
    return names


def _row(fields: list[str], n_fields: int, where: str) -> list[float]:
    """Return the numbers of one line; a place of which a coordinate is lost is lost."""
    if any(field.strip() for field in fields[n_fields:]):
        raise UserError(f"{where}: has more than {n_fields} values; copy or export the file again")
    padded = fields[:n_fields] + [""] * (n_fields - len(fields))
    try:
        numbers = [float(field) if field.strip() else np.nan for field in padded]
    except ValueError as error:
        raise UserError(f"{where}: holds no number ({str(error)[:60]}); correct it") from None
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
        raise UserError(f"{where}: the time of frame {row} (from 0) does not go with {fps:g} Hz; correct DataRate")
