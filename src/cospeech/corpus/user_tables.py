"""Read user-supplied tables (Parquet or CSV), which replace an intermediate result of the pipeline.

A table written by another program has no schema name, version or checksum, and may lack the raw columns next to the
normalised ones. Its columns must have our names (which include the unit), its time grid must be uniform and start
with the record, and its values must lie within the ranges in ``data_schema/`` and have the size that follows from
their definition. docs/tables.md describes the tables for users. A Parquet file with our metadata is validated
completely, including its checksum.
"""

from __future__ import annotations

import difflib
import io
import re
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from cospeech.data import segments, tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import delimited, plain_text
from cospeech.formats.foreign import check_size
from cospeech.motion import skeleton

GRID_TOLERANCE = 0.01
"""Largest deviation of a time from the uniform time grid, in frames."""

ROUNDING_S = 0.0005 + 1e-9
"""Largest change of a time that is rounded to milliseconds."""

MIN_ARM_ANGLE_DEG = 2 * np.pi
"""If no arm angle of a record exceeds this value, the angles must be in radians."""

MAX_DISPLACEMENT_M = 50.0
"""If the hips are displaced by more than this, the displacement cannot be in metres."""

MAX_MEAN, MAX_DEVIATION = 0.5, 2.0
"""Largest mean of an intensity with mean 0, and largest standard deviation (or its inverse) of one with variance 1.

Both leave room for tables that were normalised over all records of a speaker, or that are part of a longer table.
"""

MAX_LAG_S = 0.025
"""The pitch period of a voice of 40 Hz: no period deviates from the mean by more."""

MIN_STEPS = 10
MIN_RATIO, MAX_RATIO = 0.1, 3.0
"""Expected ratio of derivatives to differences between frames, and the number of differences that show it.

Per second it would be the frame rate, 40 for frames of 25 ms. Regression over five frames, common in speech
recognition, yields 0.2 for noise and up to 1 for smooth features.
"""

MAX_TIME_S = 1e6
"""No record lasts eleven days."""

MELODY_S = 0.01
"""Frame period of a melody, in seconds."""

TIME_GRID_HZ = 1000
"""Frame rate of gesture segments that are given by their times alone."""


def read(path: str | Path, schema: str, extra: tuple[str, ...] = (), optional: tuple[str, ...] = ()) -> pd.DataFrame:
    """Read a user-supplied table and drop the columns that are not in the schema.

    Parameters
    ----------
    path : the Parquet or CSV file.
    schema : name of its schema.
    extra : columns that match the schema's pattern and are required as well.
    optional : columns that may be missing, although the schema requires them; they are then null.

    Raises
    ------
    UserError : if the file is missing, damaged or too large, lacks a column, or has a column in another unit.
    """
    frame = load(path, schema)
    table = tables.schema(schema)
    needed = [column.name for column in table.columns if not column.nullable and column.name not in optional]
    required = [*needed, *extra]
    for name in required:
        if name not in frame.columns:
            foreign = [column for column in map(str, frame.columns) if column not in required]
            raise UserError(f"{path}: column '{name}' is missing{_rename_hint(name, foreign)}")
    known = frame[[name for name in frame.columns if table.column(name) is not None]].copy()
    for column in table.columns:
        if column.name not in known.columns:
            known[column.name] = np.nan
        elif column.type == "string":  # a record or label 1 may be stored as a number
            known[column.name] = known[column.name].astype(object).map(_name)
    return known


def load(path: str | Path, schema: str) -> pd.DataFrame:
    """Read a user-supplied Parquet or CSV file with all its columns; see ``read``.

    The schema tells the separator of a CSV file, and the units of columns that a Parquet file shares with it.
    """
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    check_size(Path(path).stat().st_size, str(path))
    return _read_csv(path, schema) if Path(path).suffix.lower() in (".csv", ".tsv") else _read_parquet(path, schema)


def _name(value: object) -> object:
    if isinstance(value, str):
        return value.strip()
    if isinstance(value, (int, np.integer)):
        return str(value)
    return str(int(value)) if isinstance(value, (float, np.floating)) and value == np.round(value) else value


def _rename_hint(name: str, columns: list[str]) -> str:
    near = difflib.get_close_matches(name, columns, n=1)
    return f"; if it is '{near[0]}', rename it and convert it to the unit in the name" if near else "; add it"


def _suggestion(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean '{near[0]}'?" if near else f"; expected one of {', '.join(known[:12])}"


def _read_csv(path: str | Path, schema: str) -> pd.DataFrame:
    text = plain_text.read(path, max_bytes=None)
    known = [column.name for column in tables.schema(schema).columns]
    separator, skipped = delimited.separator_of(text, known)
    body = "\n".join(text.splitlines()[skipped + 1 : skipped + 11])
    decimal = "," if separator != "," and re.search(r"\d,\d", body) and not re.search(r"\d\.\d", body) else "."
    strings = {column.name: str for column in tables.schema(schema).columns if column.type == "string"}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # rows longer than the header would only cause a warning, and be shifted
            frame = pd.read_csv(
                io.StringIO(text), sep=separator, decimal=decimal, skiprows=skipped, index_col=False,
                low_memory=False, dtype=strings, skipinitialspace=True,
            )  # fmt: skip
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as CSV ({reason}); export it again") from error
    return frame.rename(columns=lambda name: str(name).strip()).dropna(how="all", ignore_index=True)


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
    fps = 1 / frame_period(supplied, path)
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
        As in ``read``, and if the table contains NaN or a constant feature, has a non-uniform time grid, a frame
        period other than ``frame_s`` or no frames at the start of the record, or if a feature is in another unit.
    """
    supplied = read(path, "prosody")
    columns = [column.name for column in tables.schema("prosody").columns]
    features = [name for name in columns if name not in ("frame", "time_s", "intensity_log", "lag_s")]
    numbers = _numbers(supplied, features, path)
    period_s = frame_period(supplied, path)
    if abs(period_s / frame_s - 1) > GRID_TOLERANCE / 100:
        raise UserError(
            f"{path}: its frame period is {period_s:.6g} s, but speech.frame_s is {frame_s}; make them agree"
        )
    for name in ("intensity", "pitch_gain"):
        if np.ptp(numbers[name].to_numpy()) == 0:
            raise UserError(f"{path}: column '{name}' is constant, so this is not speech; check how it was computed")
    _check_units(numbers, path)
    table = supplied[columns].assign(**{name: numbers[name] for name in features})
    table["frame"] = np.arange(len(table))
    table["time_s"] = segments.frame_times(len(table), 1 / frame_s)
    tables.validate(table, "prosody", str(path))
    return table


def _check_units(numbers: pd.DataFrame, path: str | Path) -> None:
    """Raise UserError if prosody features do not have the properties that follow from their definition."""
    intensity, lag, gain = (numbers[name].to_numpy() for name in ("intensity", "pitch_lag", "pitch_gain"))
    with np.errstate(over="ignore"):  # the deviation of numbers beyond all measure is infinite, and rejected
        mean, deviation = float(intensity.mean()), float(intensity.std())
    if abs(mean) > MAX_MEAN or not 1 / MAX_DEVIATION <= deviation <= MAX_DEVIATION:
        raise UserError(
            f"{path}: column 'intensity' has mean {mean:.3g} and standard deviation {deviation:.3g}, expected 0 "
            f"(within {MAX_MEAN}) and 1 (from {1 / MAX_DEVIATION} to {MAX_DEVIATION:g}); subtract its mean and "
            "divide by its standard deviation, whether it is in decibels or a log energy"
        )
    furthest = float(lag[np.abs(lag).argmax()])
    if abs(furthest) > MAX_LAG_S:
        raise UserError(
            f"{path}: column 'pitch_lag' reaches {furthest:.4g}, expected at most {MAX_LAG_S} s from 0; it is the "
            "pitch period in seconds (1 / hertz) minus its mean over the voiced frames"
        )
    if lag.any() and ((lag >= 0).all() or (lag <= 0).all()):
        never = "negative" if lag.max() > 0 else "positive"
        raise UserError(
            f"{path}: column 'pitch_lag' is never {never} (mean {lag[lag != 0].mean():.3g} s), expected a mean of 0 "
            "over the voiced frames; subtract the mean pitch period, and put 0 in unvoiced frames"
        )
    if np.abs(gain).max() > 1 + 1e-6:
        worst = float(gain[np.abs(gain).argmax()])
        raise UserError(
            f"{path}: column 'pitch_gain' reaches {worst:.4g}, expected -1 to 1; it is an autocorrelation, neither a "
            "percentage nor decibels"
        )
    for name in ("intensity", "pitch_lag", "pitch_gain"):
        _check_difference(numbers[name].to_numpy(), numbers[f"d_{name}"].to_numpy(), f"d_{name}", path)


def _check_difference(values: Floats, differences: Floats, name: str, path: str | Path) -> None:
    """Raise UserError if ``differences`` are not of the size of differences of ``values`` per frame.

    Only frames in which both change are compared, and by the median of their ratio: so derivatives that are smoothed,
    rounded, or set to 0 where voicing begins or ends, are accepted.
    """
    steps = np.diff(values)
    moving = steps != 0
    if moving.sum() < MIN_STEPS:
        return
    both = moving & (differences[1:] != 0)
    ratio = float(np.median(np.abs(differences[1:][both] / steps[both]))) if both.any() else 0.0
    if not MIN_RATIO <= ratio <= MAX_RATIO:
        raise UserError(
            f"{path}: column '{name}' is {ratio:.3g} times the change of '{name[2:]}' from frame to frame, "
            f"expected 1 (from {MIN_RATIO} to {MAX_RATIO:g}); take the difference from the previous frame, "
            "not per second"
        )


def melody(path: str | Path) -> pd.DataFrame:
    """Return a user-supplied melody, with its frames and times renumbered.

    Raises
    ------
    UserError
        As in ``read``, and if the table lacks numbers, or has another frame period than ``MELODY_S``.
    """
    supplied = read(path, "melody")
    names = ["intensity_db", "pitch", "d_pitch", "intensity"]
    numbers = _numbers(supplied, names, path)
    period_s = frame_period(supplied, path)
    if abs(period_s / MELODY_S - 1) > GRID_TOLERANCE / 100:
        raise UserError(f"{path}: its frame period is {period_s:.6g} s, expected {MELODY_S} s; compute it at 100 Hz")
    pitch_hz = pd.to_numeric(supplied["f0_hz"], errors="coerce").astype(float)
    table = supplied[[column.name for column in tables.schema("melody").columns]].assign(f0_hz=pitch_hz, **numbers)
    table = table.assign(
        active=table["active"].astype(bool), frame=np.arange(len(table)),
        time_s=segments.frame_times(len(table), 1 / MELODY_S),
    )  # fmt: skip
    tables.validate(table, "melody", str(path))
    return table


def gestures(path: str | Path, record: str, labels: list[str]) -> pd.DataFrame:
    """Return the gesture segments of ``record`` from a user-supplied segment table.

    The columns ``start_s``, ``end_s`` and ``label`` are enough. If the table has a column ``record`` with several
    records, only the rows of ``record`` are used. Without frame numbers, times are rounded to milliseconds.

    Raises
    ------
    UserError
        As in ``read``, and if segments leave a gap or overlap, labels are unknown, or frames and times disagree.
    """
    supplied = read(path, "segments", optional=("record", "segment", "start_frame", "end_frame"))
    named = supplied["record"].dropna().unique()
    if len(named) > 1 or record in named:
        supplied = supplied[supplied["record"] == record]
    if len(supplied) == 0:
        raise UserError(f"{path}: contains no segment of record '{record}'; check its column 'record'")
    supplied = supplied.reset_index(drop=True)
    unknown = supplied[~supplied["label"].isin(labels)]
    if len(unknown):
        name = str(unknown["label"].iloc[0])
        raise UserError(f"{path}: segment {unknown.index[0]}: unknown label '{name}'{_suggestion(name, labels)}")
    if supplied[["start_frame", "end_frame"]].isna().all(axis=None):
        return _segments_by_time(supplied, record, path)
    numbers = _numbers(supplied, ["start_frame", "end_frame", "start_s", "end_s"], path, "segment")
    table = supplied.assign(record=record, segment=np.arange(len(supplied)), **numbers)
    tables.validate(table, "segments", str(path))
    table = table.astype({"start_frame": np.int64, "end_frame": np.int64})
    segments.check(table, str(path))
    frames, seconds = table[["start_frame", "end_frame"]].to_numpy(), table[["start_s", "end_s"]].to_numpy()
    _check_times(seconds, path)
    period_s = float(seconds[-1, 1] / frames[-1, 1])
    disagree = (np.abs(frames * period_s - seconds) > period_s / 2).any(axis=1) | (period_s <= 0)
    if disagree.any():
        row = int(np.flatnonzero(disagree)[0])
        raise UserError(f"{path}: segment {row}: its frames and times disagree; use one frame rate for all segments")
    n_frames = int(table["end_frame"].iloc[-1])
    return segments.from_starts(record, table["start_frame"], table["label"], n_frames, round(1 / period_s, 6))


def _check_times(times_s: Floats, path: str | Path) -> None:
    if np.abs(times_s).max() > MAX_TIME_S:
        raise UserError(f"{path}: its times exceed {MAX_TIME_S:g} s; convert them to seconds")


def syllables(path: str | Path, record: str) -> pd.DataFrame:
    """Return the syllables of ``record`` from a user-supplied table.

    If the table has a column ``record`` with several records, only the rows of ``record`` are used. Rise and fall of
    the pitch may be missing.

    Raises
    ------
    UserError
        As in ``read``, and if a syllable ends before it starts, has its peak outside, or overlaps the next one.
    """
    supplied = read(path, "syllables", optional=("record", "syllable"))
    named = supplied["record"].dropna().unique()
    if len(named) > 1 or record in named:
        supplied = supplied[supplied["record"] == record]
    times = _numbers(supplied, ["start_s", "peak_s", "end_s", "known_s", "intensity_db"], path, "syllable")
    pitches = ["f0_hz", "f0_rise_hz", "f0_fall_hz"]
    table = supplied.reset_index(drop=True).assign(record=record, syllable=np.arange(len(times)), **times)
    table[pitches] = table[pitches].apply(pd.to_numeric, errors="coerce").astype(float)
    tables.validate(table, "syllables", str(path))
    start, peak, end = (times[name].to_numpy() for name in ("start_s", "peak_s", "end_s"))
    wrong = (start > peak) | (peak > end) | (end > np.append(start[1:], np.inf) + ROUNDING_S)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise UserError(
            f"{path}: syllable {row} ({start[row]:.3f}-{end[row]:.3f} s, peak at {peak[row]:.3f} s) does not contain "
            "its peak, or overlaps the next one; syllables must be in order of time, without overlaps"
        )
    return table


def _segments_by_time(supplied: pd.DataFrame, record: str, path: str | Path) -> pd.DataFrame:
    """Return segments that are given by their times alone, on a grid of milliseconds."""
    times = _numbers(supplied, ["start_s", "end_s"], path, "segment")
    _check_times(times.to_numpy(), path)
    edges = np.round(times.to_numpy() * TIME_GRID_HZ).astype(np.int64)
    order = np.argsort(edges[:, 0], kind="stable")
    edges, labels = edges[order], supplied["label"].to_numpy()[order]
    if edges[0, 0] != 0:
        raise UserError(
            f"{path}: its first segment starts at {edges[0, 0] / TIME_GRID_HZ:.3f} s, not at 0; label the time "
            "before it, or let the times count from the start of the record"
        )
    following = np.append(edges[1:, 0], edges[-1, 1])
    for row in np.flatnonzero((edges[:, 1] <= edges[:, 0]) | (np.abs(following - edges[:, 1]) > 1)):
        start, end, after = edges[row, 0], edges[row, 1], following[row]
        problem = "ends before it starts" if end < start else "is empty" if end == start else None
        problem = problem or ("overlaps the next one" if end > after else "leaves a gap to the next one")
        raise UserError(
            f"{path}: segment {order[row]}, '{labels[row]}' at {start / TIME_GRID_HZ:.3f}-{end / TIME_GRID_HZ:.3f} "
            f"s, {problem}; segments must cover the whole record"
        )
    return segments.from_starts(record, edges[:, 0], labels, int(edges[-1, 1]), TIME_GRID_HZ)


def _numbers(frame: pd.DataFrame, columns: list[str], path: str | Path, row_name: str = "frame") -> pd.DataFrame:
    """Return ``columns`` as finite floats; raise UserError for a missing or non-numeric value."""
    numbers = frame[columns].apply(pd.to_numeric, errors="coerce").astype(float)
    missing = np.argwhere(~np.isfinite(numbers.to_numpy()))
    if len(missing):
        row, column = missing[0]
        joint = columns[column].rsplit("_", 2)[0] if columns[column].endswith("_deg") else None
        what = f"joint '{joint}'" if joint else f"column '{columns[column]}'"
        raise UserError(f"{path}: {what} is missing (NaN) or not a number in {row_name} {row}; fill or cut the gap")
    return numbers.reset_index(drop=True)


def frame_period(frame: pd.DataFrame, path: str | Path) -> float:
    """Return the frame period in seconds; times must start at 0 and be uniform, and frame numbers be consecutive."""
    times = _numbers(frame, ["time_s"], path)["time_s"].to_numpy()
    count = _numbers(frame, ["frame"], path)["frame"].to_numpy()
    if len(times) < 2:
        raise UserError(f"{path}: contains only {len(times)} frame(s); use a whole record")
    period_s = _nominal_period(times)
    rounded_s = min(ROUNDING_S, period_s / 10)
    apart = np.abs(times - times[0] - np.arange(len(times)) * period_s)
    irregular = apart > max(GRID_TOLERANCE * period_s, 2 * rounded_s)
    if period_s <= 0 or irregular.any() or (np.diff(count) != 1).any():
        row = int(np.flatnonzero(irregular | (np.append(1, np.diff(count)) != 1))[0]) if period_s > 0 else 0
        raise UserError(
            f"{path}: frames are missing or not uniform at row {row} (time_s, frame); resample them to a uniform grid"
        )
    if not -GRID_TOLERANCE <= times[0] / period_s <= 1 + GRID_TOLERANCE:
        raise UserError(
            f"{path}: its first frame is at {times[0]:.6g} s, so the frames before it are missing; add them, or, if "
            f"the record starts there, let time_s start at {period_s / 2:.6g} s"
        )
    return period_s


def _nominal_period(times: Floats) -> float:
    """Return the frame period of uniform times in seconds, also if they were rounded to milliseconds."""
    period_s = float((times[-1] - times[0]) / (len(times) - 1))
    counted = np.arange(len(times))
    if period_s <= 0 or np.abs(times - times[0] - counted * period_s).max() <= GRID_TOLERANCE * period_s / 100:
        return period_s
    rates = (round(1 / period_s), round(1.001 / period_s) / 1.001)  # whole numbers, or those of television
    nominal = [1 / rate for rate in rates if rate > 0]
    fitting = [one for one in nominal if np.abs(times - times[0] - counted * one).max() <= 2 * ROUNDING_S]
    return fitting[0] if fitting else period_s
