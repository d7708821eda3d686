"""TRC files (Motion Analysis; OpenSim, Pose2Sim): marker trajectories as tab-separated text.

Five header lines (path, names and values of fields, names of markers, names of coordinates) are followed by one line
per frame: its number, its time, and x, y, z of each marker. The fields of a lost marker are empty; on reading, "nan"
and three exact zeros, which other programs write, also mean lost. Commas or semicolons instead of tabs and decimal
commas, as spreadsheets save them, spaces, as editors leave them, and lines of comments are accepted.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cospeech.data import frame_rates, tables, units
from cospeech.data.arrays import Floats
from cospeech.data.trajectories import Trajectories, without_zeros
from cospeech.data.units import METRES
from cospeech.errors import UserError
from cospeech.formats import foreign

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
"""Tolerance of the time of a frame: in frames, and in frames per frame before it (29.97 Hz called 30).

One unit of the last digit of the times is added, as they may be rounded to two decimals.
"""

MAX_FPS = 10000.0

FIELD_NAMES = {name.lower(): name for name in FIELDS}

COMMENTS = ("#", "//")
"""How lines of comments begin that people add."""


def write(trajectories: Trajectories, path: str | Path) -> None:
    """Write trajectories in metres, with frames counted from 1, times from 0, as is customary, and empty gaps.

    Raises
    ------
    UserError : if the name of a marker is empty or contains a tab or a line break.
    """
    names, places, fps = trajectories[:3]
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


def read(path: str | Path, unit: str | float | None = None) -> Trajectories:
    """Read a TRC file; positions in metres, NaN where a marker is lost.

    Parameters
    ----------
    path : the file.
    unit : unit of the positions, as in ``units.METRES`` or in metres; None: as the file says.

    Raises
    ------
    UserError : if the file is missing, truncated, malformed or too large, if its unit is unknown, or if its frames
        are not consecutive.
    """
    text = foreign.decode(foreign.read_bytes(path), path)
    filled = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip(" \t,;") and not line.lstrip().startswith(COMMENTS)
    ]
    if not filled or not filled[0][1].lower().startswith("pathfiletype"):
        raise UserError(f"{path}: is not a TRC file (it does not begin with PathFileType); name a TRC file")
    if len(filled) < 6:
        raise UserError(f"{path}: is truncated in its header; copy or export it again")
    lines = [line for _, line in filled[:5]]
    labels = [FIELD_NAMES.get(field.strip().lower(), "") for field in _fields(lines[1])]
    given = dict(zip(labels, map(str.strip, _fields(lines[2])), strict=False))
    stated_fps, announced, n_markers = _header(given, str(path))
    metres, notes = _metres(given.get("Units", ""), unit, str(path))
    names = _names(lines[3], n_markers, str(path))
    filled = filled[5:]
    n_frames = len(filled)
    if n_frames < announced:
        raise UserError(
            f"{path}: announces {announced} frames and holds {n_frames}: empty or truncated; copy or export it again"
        )
    if n_frames > announced + 1:
        raise UserError(
            f"{path}: announces {announced} frames and holds more, {n_frames}; correct NumFrames in line 3"
        )
    if n_frames > announced:
        notes.append(f"the file holds one frame more than the {announced} that it announces; all were read")
    rows, step_s = np.empty((n_frames, 2 + 3 * n_markers)), 1.0
    for row, (number, line) in enumerate(filled):
        fields = _row(line, rows.shape[1], f"{path}: line {number}")
        rows[row] = _numbers(fields, f"{path}: line {number}")
        step_s = min(step_s, 10.0 ** -len(fields[1].strip().partition(".")[2]))
    fps, rounded = _frame_rate(rows[:, 0], rows[:, 1], stated_fps, step_s, str(path))
    places = rows[:, 2:].reshape(n_frames, n_markers, 3) * metres
    return Trajectories(names, without_zeros(places), fps, (*notes, *rounded))


def _fields(line: str) -> list[str]:
    """Return the fields of a line, which are separated by tabs, semicolons, commas, or spaces."""
    separator = _separator(line)
    return line.split(separator) if separator else line.split()


def _separator(line: str) -> str | None:
    return next((separator for separator in "\t;," if separator in line), None)


def _header(given: dict[str, str], where: str) -> tuple[float, int, int]:
    """Return the frame rate and the numbers of frames and markers."""
    try:
        fps, n_frames, n_markers = float(given["DataRate"]), _whole(given["NumFrames"]), _whole(given["NumMarkers"])
    except (KeyError, ValueError):
        raise UserError(
            f"{where}: lines 2 and 3 do not say DataRate, NumFrames, NumMarkers; export it again"
        ) from None
    if not (1.0 <= fps <= MAX_FPS and n_frames > 0 and n_markers > 0):
        raise UserError(f"{where}: {n_frames} frames of {n_markers} markers at {fps:g} Hz; export it again")
    return fps, n_frames, n_markers


def _whole(text: str) -> int:
    return int(text.removesuffix(".0"))


def _metres(stated: str, declared: str | float | None, where: str) -> tuple[float, list[str]]:
    """Return the unit in metres, and a note if the declared unit replaces that of the file."""
    if declared is not None:
        return units.metres_per_unit(declared), units.replaced(stated, declared)
    metres = units.stated_metres(stated)
    if metres is None:
        unknown = f"unknown unit '{stated[:20]}'" if stated else "does not state its unit"
        raise UserError(
            f"{where}: {unknown}; set Units in line 3 to one of {', '.join(METRES)}, or state it "
            "in corpus.markers.unit"
        )
    return metres, []


def _names(line: str, n_markers: int, where: str) -> tuple[str, ...]:
    fields = _fields(line)
    if _separator(line):
        names = tuple(map(foreign.normalised, fields[2 : 2 + 3 * n_markers : 3]))
        spare = [field.strip() for index, field in enumerate(fields[2:]) if index % 3 or index >= 3 * n_markers]
    else:  # a name may contain single spaces if more of them separate it from the next
        if len(fields) != 2 + n_markers:
            fields = re.split(r" {2,}", line.strip())
        if len(fields) == 1 + n_markers:
            fields = [*fields[0].split(maxsplit=1), *fields[1:]]
        if len(fields) == 1 + n_markers:
            fields = [fields[0], *fields[1].split(maxsplit=1), *fields[2:]]
        names, spare = tuple(map(foreign.normalised, fields[2 : 2 + n_markers])), fields[2 + n_markers :]
    if len(names) != n_markers or not all(names) or any(spare):
        raise UserError(
            f"{where}: line 4 does not name {n_markers} markers, each over three columns; export it again"
        )
    return names


def _row(line: str, n_fields: int, where: str) -> list[str]:
    """Return the fields of one frame, with empty ones at its end if the line is shorter."""
    fields = _fields(line)
    separator = _separator(line)
    if separator in ("\t", ";"):
        fields = [field.replace(",", ".") for field in fields]
    if separator is None and len(fields) != n_fields:
        fields = line.split(" ")  # each tab was replaced by one space, and some fields are empty
        if not n_fields <= len(fields) <= n_fields + 1:
            raise UserError(
                f"{where}: has {len(line.split())} of {n_fields} values, separated by spaces; export it with tabs, "
                "so that the fields of lost markers can be recognised"
            )
    if any(field.strip() for field in fields[n_fields:]):
        raise UserError(f"{where}: has more than {n_fields} values; copy or export the file again")
    return fields[:n_fields] + [""] * (n_fields - len(fields))


def _numbers(fields: list[str], where: str) -> Floats:
    """Return the numbers of one line, NaN for empty fields."""
    try:
        numbers = np.array([float(field) if field.strip() else np.nan for field in fields])
    except ValueError as error:
        raise UserError(f"{where}: has a value that is not a number ({str(error)[:60]}); correct it") from None
    if np.isinf(numbers).any():
        raise UserError(f"{where}: holds an infinite number; correct it, or leave the field empty where lost")
    return numbers


def _frame_rate(frames: Floats, times_s: Floats, stated: float, step_s: float, where: str) -> tuple[float, list[str]]:
    """Return the frame rate after a check that frames and times agree with the stated one, and notes.

    A stated whole number is often the rounded rate of television (29.97, 59.94); then the times tell.

    Parameters
    ----------
    frames, times_s : (T,) number and time of each frame.
    stated : DataRate of the header.
    step_s : one unit of the last digit of the times.
    where : name of the file for error messages.
    """
    wrong = np.flatnonzero(np.diff(frames) != 1)
    if np.isnan(frames).any() or len(wrong):
        row = int(np.flatnonzero(np.isnan(frames))[0] if np.isnan(frames).any() else wrong[0] + 1)
        raise UserError(
            f"{where}: frame {row} (from 0) is not numbered one more than the one before; export it again"
        )
    if np.isnan(times_s).any():
        row = int(np.flatnonzero(np.isnan(times_s))[0])
        raise UserError(f"{where}: frame {row} (from 0) has no time; export it again")
    count, elapsed_s = np.arange(len(times_s)), times_s - times_s[0]
    measured = (len(times_s) - 1) / elapsed_s[-1] if elapsed_s[-1] > 1e-9 else np.nan  # also for times near 0
    off = np.flatnonzero(~(np.abs(elapsed_s * stated - count) <= LATE + DRIFT * count + step_s * stated))
    if len(off):
        row = int(off[0])
        raise UserError(
            f"{where}: the time of frame {row} (from 0) contradicts {stated:g} Hz; correct DataRate or the times, "
            f"which run at {measured:.4g} Hz"
        )
    for rate in frame_rates.NTSC:
        precise = step_s / elapsed_s[-1] < DRIFT / 4 if elapsed_s[-1] > 0 else False
        if precise and round(rate) == stated and abs(measured / rate - 1) < DRIFT / 4:
            return rate, [f"frame rate {stated:g} in the file taken as {rate:g}, at which its times run"]
    return stated, []
