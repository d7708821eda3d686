"""Read user-supplied tables (Parquet or CSV), which replace an intermediate result of the pipeline.

A table written by another program has no schema name, version or checksum, and may lack the raw columns next to the
normalised ones. Its columns must have our names (which include the unit), its time grid must be uniform, and its
values must lie within the ranges in ``data_schema/``. A Parquet file with our metadata is validated completely,
including its checksum.
"""

from __future__ import annotations

import difflib
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.formats.foreign import check_size
from cospeech.motion import skeleton

GRID_TOLERANCE = 0.01
"""Largest deviation of a time from the uniform time grid, in frames."""

MIN_ARM_ANGLE_DEG = 2 * np.pi
"""If no arm angle of a record exceeds this value, the angles must be in radians."""

MAX_DISPLACEMENT_M = 50.0
"""If the hips are displaced by more than this, the displacement cannot be in metres."""


def read(path: str | Path, schema: str, extra: tuple[str, ...] = ()) -> pd.DataFrame:
    """Read a user-supplied table and drop the columns that are not in the schema.

    ``extra`` names columns that match the schema's pattern and are required as well.

    Raises
    ------
    UserError : if the file is missing, damaged or too large, lacks a column, or has a column in another unit.
    """
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    check_size(Path(path).stat().st_size, str(path))
    frame = _read_csv(path) if Path(path).suffix.lower() == ".csv" else _read_parquet(path, schema)
    table = tables.schema(schema)
    required = [*(column.name for column in table.columns if not column.nullable), *extra]
    for name in required:
        if name not in frame.columns:
            foreign = [column for column in map(str, frame.columns) if column not in required]
            raise UserError(f"{path}: column '{name}' is missing{_rename_hint(name, foreign)}")
    known = frame[[name for name in frame.columns if table.column(name) is not None]].copy()
    for column in table.columns:
        if column.name not in known.columns:
            known[column.name] = np.nan
    return known


def _rename_hint(name: str, columns: list[str]) -> str:
    near = difflib.get_close_matches(name, columns, n=1)
    return f"; if it is '{near[0]}', rename it and convert it to the unit in the name" if near else "; add it"


def _suggestion(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean '{near[0]}'?" if near else f"; expected one of {', '.join(known[:12])}"


def _read_csv(path: str | Path) -> pd.DataFrame:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # rows longer than the header would only cause a warning, and be shifted
            return pd.read_csv(path, encoding="utf-8-sig", index_col=False, low_memory=False)
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as CSV ({reason}); export it again") from error


def _read_parquet(path: str | Path, schema: str) -> pd.DataFrame:
    try:
        size = pq.read_metadata(path)
        check_size(8 * size.num_rows * size.num_columns, str(path))
        arrow = pq.read_table(path, page_checksum_verification=True)
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged, or not a Parquet file ({reason}); export it again") from error
    if b"schema_version" in (arrow.schema.metadata or {}):
        return tables.read(path, schema)
    for field in arrow.schema:
        column = tables.schema(schema).column(field.name)
        unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        if column is not None and unit and unit != column.unit:
            raise UserError(f"{path}: column '{field.name}' is in '{unit}', expected '{column.unit}'; convert it")
    try:
        return arrow.to_pandas(ignore_metadata=True)
    except ValueError as error:  # names and texts are decoded only now
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as a table ({reason}); export it again") from error


def motion(path: str | Path) -> tuple[pd.DataFrame, list[str]]:
    """Return a user-supplied motion table, and notes; the angles of joints that it lacks are set to zero.

    Raises
    ------
    UserError
        As in ``read``, and if the table contains NaN, has unknown joints, lacks arm joints, is in radians or
        centimetres, or has a non-uniform time grid.
    """
    supplied = read(path, "motion", tuple(skeleton.angle_columns(skeleton.ARM_JOINTS)))
    given = [name for name in supplied.columns if name.endswith("_deg")]
    for name in given:
        if name not in skeleton.angle_columns():
            raise UserError(f"{path}: unknown joint column '{name}'{_suggestion(name, skeleton.angle_columns())}")
    numbers = _numbers(supplied, [*skeleton.ROOT_COLUMNS, *given], path)
    fps = 1 / _frame_period(supplied, path)
    if np.abs(numbers[skeleton.angle_columns(skeleton.ARM_JOINTS)].to_numpy()).max() < MIN_ARM_ANGLE_DEG:
        raise UserError(
            f"{path}: all arm angles are below 2 pi, so they seem to be in radians; convert them to degrees"
        )
    if np.abs(numbers[list(skeleton.ROOT_COLUMNS)].to_numpy()).max() > MAX_DISPLACEMENT_M:
        raise UserError(
            f"{path}: the hips are displaced by more than {MAX_DISPLACEMENT_M:.0f} m; convert to metres, relative to "
            "their position at rest"
        )
    angles = numbers.reindex(columns=skeleton.angle_columns(), fill_value=0.0).to_numpy(dtype=float)
    root = numbers[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float)
    still = [joint for joint in skeleton.JOINTS if f"{joint}_x_deg" not in given]
    notes = [f"joints at zero angles, as the table lacks them: {', '.join(still)}"] if still else []
    return skeleton.motion_table(root, angles.reshape(len(root), -1, 3), fps), notes


def prosody(path: str | Path, frame_s: float) -> pd.DataFrame:
    """Return a user-supplied prosody table, with its frames and times renumbered.

    Raises
    ------
    UserError
        As in ``read``, and if the table contains NaN or a constant feature, has a non-uniform time grid, or a frame
        period other than ``frame_s``.
    """
    supplied = read(path, "prosody")
    columns = [column.name for column in tables.schema("prosody").columns]
    features = [name for name in columns if name not in ("frame", "time_s", "intensity_log", "lag_s")]
    numbers = _numbers(supplied, features, path)
    period_s = _frame_period(supplied, path)
    if abs(period_s / frame_s - 1) > GRID_TOLERANCE / 100:
        raise UserError(
            f"{path}: its frame period is {period_s:.6g} s, but speech.frame_s is {frame_s}; make them agree"
        )
    for name in ("intensity", "pitch_gain"):
        if np.ptp(numbers[name].to_numpy()) == 0:
            raise UserError(f"{path}: column '{name}' is constant, so this is not speech; check how it was computed")
    table = supplied[columns].assign(**{name: numbers[name] for name in features})
    table["frame"] = np.arange(len(table))
    table["time_s"] = segments.frame_times(len(table), 1 / frame_s)
    tables.validate(table, "prosody", str(path))
    return table


def gestures(path: str | Path, record: str, labels: list[str]) -> pd.DataFrame:
    """Return the gesture segments of ``record`` from a user-supplied segment table.

    If the table contains several records, only the rows of ``record`` are used.

    Raises
    ------
    UserError
        As in ``read``, and if segments leave a gap or overlap, labels are unknown, or frames and times disagree.
    """
    supplied = read(path, "segments")
    if len(supplied["record"].unique()) > 1 or (supplied["record"] == record).any():
        supplied = supplied[supplied["record"] == record]
    if len(supplied) == 0:
        raise UserError(f"{path}: contains no segment of record '{record}'; check its column 'record'")
    supplied = supplied.reset_index(drop=True)
    numbers = _numbers(supplied, ["start_frame", "end_frame", "start_s", "end_s"], path)
    table = supplied.assign(record=record, segment=np.arange(len(supplied)), **numbers)
    tables.validate(table, "segments", str(path))
    table = table.astype({"start_frame": np.int64, "end_frame": np.int64})
    segments.check(table, str(path))
    unknown = table[~table["label"].isin(labels)]
    if len(unknown):
        name = str(unknown["label"].iloc[0])
        raise UserError(f"{path}: segment {unknown.index[0]}: unknown label '{name}'{_suggestion(name, labels)}")
    frames, seconds = table[["start_frame", "end_frame"]].to_numpy(), table[["start_s", "end_s"]].to_numpy()
    period_s = float(seconds[-1, 1] / frames[-1, 1])
    disagree = (np.abs(frames * period_s - seconds) > period_s / 2).any(axis=1) | (period_s <= 0)
    if disagree.any():
        row = int(np.flatnonzero(disagree)[0])
        raise UserError(f"{path}: segment {row}: its frames and times disagree; use one frame rate for all segments")
    n_frames = int(table["end_frame"].iloc[-1])
    return segments.from_starts(record, table["start_frame"], table["label"], n_frames, round(1 / period_s, 6))


def _numbers(frame: pd.DataFrame, columns: list[str], path: str | Path) -> pd.DataFrame:
    """Return ``columns`` as finite floats; raise UserError for a missing or non-numeric value."""
    numbers = frame[columns].apply(pd.to_numeric, errors="coerce").astype(float)
    missing = np.argwhere(~np.isfinite(numbers.to_numpy()))
    if len(missing):
        row, column = missing[0]
        joint = columns[column].rsplit("_", 2)[0] if columns[column].endswith("_deg") else None
        what = f"joint '{joint}'" if joint else f"column '{columns[column]}'"
        raise UserError(f"{path}: {what} is missing (NaN) or not a number in frame {row}; fill or cut the gap")
    return numbers.reset_index(drop=True)


def _frame_period(frame: pd.DataFrame, path: str | Path) -> float:
    """Return the frame period in seconds; times must be uniform and frame numbers consecutive."""
    times = _numbers(frame, ["time_s"], path)["time_s"].to_numpy()
    count = _numbers(frame, ["frame"], path)["frame"].to_numpy()
    if len(times) < 2:
        raise UserError(f"{path}: contains only {len(times)} frame(s); use a whole record")
    period_s = float((times[-1] - times[0]) / (len(times) - 1))
    irregular = np.abs(times - times[0] - np.arange(len(times)) * period_s) > GRID_TOLERANCE * period_s
    if period_s <= 0 or irregular.any() or (np.diff(count) != 1).any():
        row = int(np.flatnonzero(irregular | (np.append(1, np.diff(count)) != 1))[0]) if period_s > 0 else 0
        raise UserError(
            f"{path}: frames are missing or not uniform at row {row} (time_s, frame); resample them to a uniform grid"
        )
    return period_s
