"""Labelled spans of gesture: in from ELAN, Praat or CSV, out to ELAN and Praat for a person to correct.

Times count from the start of the record, in an excerpt too, as in the files that ``export`` writes.
"""

from __future__ import annotations

import csv
import difflib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.data.segments import Spans
from cospeech.errors import UserError
from cospeech.formats import elan, textgrid

TIER = "gesture"
"""The tier of the exported files, and the one that is read where a file has several."""

ROUNDING_S = 0.0005 + 1e-9
"""What rounding to milliseconds moves a time by: ELAN keeps no finer ones."""

CSV_COLUMNS = ("start_s", "end_s", "gesture")


def read(path: str | Path, record: str, duration_s: float, labels: list[str]) -> pd.DataFrame:
    """Return the annotations table of a file that a person labelled.

    Parameters
    ----------
    path : ELAN .eaf, Praat .TextGrid, or .csv with the columns start_s, end_s, gesture.
    record : the record that it labels.
    duration_s : length of the record.
    labels : the gesture classes of the configuration.

    Raises
    ------
    UserError : missing or damaged file; a span past the end, overlapping, empty or with an unknown label.
    """
    readers: dict[str, Callable[[str | Path], Spans]] = {
        ".eaf": lambda path: _tier(elan.read(path), path),
        ".textgrid": lambda path: _tier(textgrid.read(path), path),
        ".csv": _read_csv,
    }
    reader = readers.get(Path(path).suffix.lower())
    if reader is None:
        raise UserError(f"{path}: annotations come as .eaf, .TextGrid or .csv; export them as one of these")
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    spans = sorted((start, end, label.strip()) for start, end, label in reader(path) if label.strip())
    check(spans, duration_s, labels, str(path))
    return table(record, spans, duration_s, "person")


def table(record: str, spans: Spans, duration_s: float, origin: str) -> pd.DataFrame:
    """Return the annotations table of spans (start, end, label), each cut at the end of the record."""
    return pd.DataFrame(
        {
            "record": pd.Series([record] * len(spans), dtype="str"),
            "start_s": pd.Series([start for start, _, _ in spans], dtype=float),
            "end_s": pd.Series([min(end, duration_s) for _, end, _ in spans], dtype=float),
            "gesture": pd.Series([label for _, _, label in spans], dtype="str"),
            "origin": pd.Series([origin] * len(spans), dtype="str"),
        }
    )


def of_record(planted: pd.DataFrame | None, record: str, duration_s: float, labels: list[str]) -> pd.DataFrame:
    """Return the rows of ``record`` in the annotations of many records; an empty table where there are none."""
    if planted is None:
        return table(record, [], duration_s, "person")
    rows = planted[planted["record"] == record].sort_values("start_s", ignore_index=True)
    spans = list(zip(rows["start_s"], rows["end_s"], rows["gesture"], strict=True))
    check(spans, duration_s, labels, f"planted examples of '{record}'")
    return table(record, spans, duration_s, "studio")


def check(spans: Spans, duration_s: float, labels: list[str], where: str) -> None:
    """Raise UserError at the first span, in order of time, that no record of this length can have."""
    before: tuple[float, float, str] = (0.0, 0.0, "")
    for start, end, label in spans:
        place = f"{where}: '{label}' at {start:.3f}-{end:.3f} s"
        if label not in labels:
            near = difflib.get_close_matches(label, labels, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(labels)}"
            raise UserError(f"{place}: unknown label; {hint}")
        if not (np.isfinite([start, end]).all() and 0 <= start < end):
            raise UserError(f"{place}: a span must end after it starts, at 0 s or later; correct its times")
        if start >= duration_s or end > duration_s + ROUNDING_S:
            raise UserError(
                f"{place}: past the end of the record, which lasts {duration_s:.3f} s; shorten or delete it"
            )
        if start < before[1] - 1e-9:
            raise UserError(
                f"{place}: overlaps '{before[2]}' at {before[0]:.3f}-{before[1]:.3f} s; "
                "let one end where the other starts"
            )
        before = (start, end, label)


def _tier(tiers: dict[str, Spans], path: str | Path) -> Spans:
    """Return the spans of the tier called ``TIER``, or of the only tier that has any."""
    filled = [name for name, spans in tiers.items() if any(label.strip() for _, _, label in spans)]
    if TIER in tiers:
        return tiers[TIER]
    if len(filled) > 1:
        raise UserError(f"{path}: has the tiers {', '.join(filled)[:200]}; call the one with the gestures '{TIER}'")
    return tiers[filled[0]] if filled else []


def _read_csv(path: str | Path) -> Spans:
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [column for column in CSV_COLUMNS if column not in (reader.fieldnames or [])]
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as CSV ({reason}); write it anew") from error
    if missing:
        raise UserError(f"{path}: column '{missing[0]}' is missing; annotations have {', '.join(CSV_COLUMNS)}")
    spans = []
    for line, row in rows:
        if None in row or None in row.values():
            raise UserError(f"{path}: line {line} has not as many cells as the heading; correct it")
        start, end = (_seconds(row[column], path, line) for column in ("start_s", "end_s"))
        spans.append((start, end, row["gesture"]))
    return spans


def _seconds(text: str, path: str | Path, line: int) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{path}: line {line}: '{text[:20]}' is no number of seconds; correct it") from None


def spans_of(segments: pd.DataFrame) -> Spans:
    """Return the spans of a segment table of one record."""
    return list(zip(segments["start_s"], segments["end_s"], segments["label"], strict=True))
