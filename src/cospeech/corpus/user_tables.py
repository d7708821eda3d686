"""Tables of the user's own (Parquet or CSV) enter in the middle of the pipeline: read leniently, checked strictly.

Another program writes no schema, version or checksum of ours, and need not write the raw columns beside the
normalised ones. What it writes must have our names (they carry the unit), stand on an even time grid and keep to the
ranges of ``data_schema/``. A Parquet file that says it is ours is held to all of that and its checksum.
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
from cospeech.motion import skeleton

UNEVEN = 0.01
"""Largest deviation of a frame from the even time grid, in frames."""

RADIANS = 2 * np.pi
"""A record of gestures whose angles all stay below this many degrees was written in radians."""

FARTHEST_M = 50.0
"""Displacement of the hips beyond which a motion table was not written in metres."""


def read(path: str | Path, schema: str, further: tuple[str, ...] = ()) -> pd.DataFrame:
    """Read a table of the user's own; columns that the schema does not know are left out.

    ``further`` names columns of the schema's pattern that must be there too.

    Raises
    ------
    UserError : missing or damaged file, a column in another unit, missing columns, text among numbers.
    """
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    frame = _read_csv(path) if Path(path).suffix.lower() == ".csv" else _read_parquet(path, schema)
    table = tables.schema(schema)
    required = [*(column.name for column in table.columns if not column.nullable), *further]
    for name in required:
        if name not in frame.columns:
            foreign = [column for column in map(str, frame.columns) if column not in required]
            raise UserError(f"{path}: column '{name}' is missing{_near(name, foreign)}")
    known = frame[[name for name in frame.columns if table.column(name) is not None]].copy()
    for column in table.columns:
        if column.name not in known.columns:
            known[column.name] = np.nan
    return known


def _near(name: str, columns: list[str]) -> str:
    near = difflib.get_close_matches(name, columns, n=1)
    return f"; is it '{near[0]}'? Then rename it, and convert it to the unit" if near else "; add it"


def _known(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean '{near[0]}'?" if near else f"; known are {', '.join(known[:12])}"


def _read_csv(path: str | Path) -> pd.DataFrame:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # rows longer than the heading would only be warned of, and shifted
            return pd.read_csv(path, encoding="utf-8-sig", index_col=False, low_memory=False)
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as CSV ({reason}); write it anew") from error


def _read_parquet(path: str | Path, schema: str) -> pd.DataFrame:
    try:
        arrow = pq.read_table(path, page_checksum_verification=True)
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged or no Parquet file ({reason}); write it anew") from error
    if b"schema_version" in (arrow.schema.metadata or {}):
        return tables.read(path, schema)
    for field in arrow.schema:
        column = tables.schema(schema).column(field.name)
        unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        if column is not None and unit and unit != column.unit:
            raise UserError(f"{path}: column '{field.name}' is in '{unit}', expected '{column.unit}'; convert it")
    return arrow.to_pandas(ignore_metadata=True)


def motion(path: str | Path) -> tuple[pd.DataFrame, list[str]]:
    """Return a motion table of the user's own and notes; joints that it leaves out stay at zero angles.

    Raises
    ------
    UserError : as ``read``; and NaN, unknown joints, arms missing, an uneven time grid, radians or centimetres.
    """
    delivered = read(path, "motion", tuple(skeleton.angle_columns(skeleton.ARM_JOINTS)))
    given = [name for name in delivered.columns if name.endswith("_deg")]
    for name in given:
        if name not in skeleton.angle_columns():
            raise UserError(f"{path}: unknown joint column '{name}'{_known(name, skeleton.angle_columns())}")
    numbers = _numbers(delivered, [*skeleton.ROOT_COLUMNS, *given], path)
    fps = 1 / _step(delivered, path)
    if np.abs(numbers[skeleton.angle_columns(skeleton.ARM_JOINTS)].to_numpy()).max() < RADIANS:
        raise UserError(f"{path}: no arm angle exceeds 2 pi degrees; they seem to be radians: write degrees")
    if np.abs(numbers[list(skeleton.ROOT_COLUMNS)].to_numpy()).max() > FARTHEST_M:
        raise UserError(
            f"{path}: the hips move more than {FARTHEST_M:.0f} m; write metres, from where they are at rest"
        )
    angles = numbers.reindex(columns=skeleton.angle_columns(), fill_value=0.0).to_numpy(dtype=float)
    root = numbers[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float)
    still = [joint for joint in skeleton.JOINTS if f"{joint}_x_deg" not in given]
    notes = [f"joints at zero angles, as the table lacks them: {', '.join(still)}"] if still else []
    return skeleton.motion_table(root, angles.reshape(len(root), -1, 3), fps), notes


def prosody(path: str | Path, frame_s: float) -> pd.DataFrame:
    """Return a prosody table of the user's own, at the frames of the configuration.

    Raises
    ------
    UserError : as ``read``; and NaN, an uneven time grid or one that differs from ``frame_s``, a constant feature.
    """
    delivered = read(path, "prosody")
    columns = [column.name for column in tables.schema("prosody").columns]
    features = [name for name in columns if name not in ("frame", "time_s", "intensity_log", "lag_s")]
    numbers = _numbers(delivered, features, path)
    step = _step(delivered, path)
    if abs(step / frame_s - 1) > UNEVEN / 100:
        raise UserError(f"{path}: its frames are {step:.6g} s apart, speech.frame_s says {frame_s}; make them agree")
    for name in ("intensity", "pitch_gain"):
        if np.ptp(numbers[name].to_numpy()) == 0:
            raise UserError(f"{path}: column '{name}' never changes, so it is no speech; check how it was made")
    table = delivered[columns].assign(**{name: numbers[name] for name in features})
    table["frame"] = np.arange(len(table))
    table["time_s"] = segments.frame_times(len(table), 1 / frame_s)
    tables.validate(table, "prosody", str(path))
    return table


def gestures(path: str | Path, record: str, labels: list[str]) -> pd.DataFrame:
    """Return the complete gesture segments of ``record`` from a segment table of the user's own.

    The table may hold several records, then its rows of ``record`` count.

    Raises
    ------
    UserError : as ``read``; and gaps, overlaps, unknown labels, frames and times that disagree.
    """
    delivered = read(path, "segments")
    if len(delivered["record"].unique()) > 1 or (delivered["record"] == record).any():
        delivered = delivered[delivered["record"] == record]
    if len(delivered) == 0:
        raise UserError(f"{path}: holds no segment of record '{record}'; check its column 'record'")
    delivered = delivered.reset_index(drop=True)
    numbers = _numbers(delivered, ["start_frame", "end_frame", "start_s", "end_s"], path)
    table = delivered.assign(record=record, segment=np.arange(len(delivered)), **numbers)
    tables.validate(table, "segments", str(path))
    table = table.astype({"start_frame": np.int64, "end_frame": np.int64})
    segments.check(table, str(path))
    unknown = table[~table["label"].isin(labels)]
    if len(unknown):
        name = str(unknown["label"].iloc[0])
        raise UserError(f"{path}: segment {unknown.index[0]}: unknown label '{name}'{_known(name, labels)}")
    frames, seconds = table[["start_frame", "end_frame"]].to_numpy(), table[["start_s", "end_s"]].to_numpy()
    step = float(seconds[-1, 1] / frames[-1, 1])
    wrong = (np.abs(frames * step - seconds) > step / 2).any(axis=1) | (step <= 0)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise UserError(f"{path}: segment {row}: its frames and its times disagree; one frame rate for all of them")
    n_frames = int(table["end_frame"].iloc[-1])
    return segments.from_starts(record, table["start_frame"], table["label"], n_frames, round(1 / step, 6))


def _numbers(frame: pd.DataFrame, columns: list[str], path: str | Path) -> pd.DataFrame:
    """Return ``columns`` as floats, every one of them there."""
    numbers = frame[columns].apply(pd.to_numeric, errors="coerce").astype(float)
    missing = np.argwhere(~np.isfinite(numbers.to_numpy()))
    if len(missing):
        row, column = missing[0]
        joint = columns[column].rsplit("_", 2)[0] if columns[column].endswith("_deg") else None
        what = f"joint '{joint}'" if joint else f"column '{columns[column]}'"
        raise UserError(f"{path}: {what} is missing (NaN) or no number in frame {row}; fill or cut the gap")
    return numbers.reset_index(drop=True)


def _step(frame: pd.DataFrame, path: str | Path) -> float:
    """Return the distance of frames in seconds; the times must be even and the frames count up by one."""
    times = _numbers(frame, ["time_s"], path)["time_s"].to_numpy()
    count = _numbers(frame, ["frame"], path)["frame"].to_numpy()
    if len(times) < 2:
        raise UserError(f"{path}: holds {len(times)} frames; name a whole record")
    step = float((times[-1] - times[0]) / (len(times) - 1))
    off = np.abs(times - times[0] - np.arange(len(times)) * step) > UNEVEN * step
    if step <= 0 or off.any() or (np.diff(count) != 1).any():
        row = int(np.flatnonzero(off | (np.append(1, np.diff(count)) != 1))[0]) if step > 0 else 0
        raise UserError(
            f"{path}: frames are uneven or missing at row {row} (time_s, frame); bring them on an even grid"
        )
    return step
