"""Gesture annotations: read from ELAN, Praat or CSV, and exported to ELAN and Praat for manual correction.

Times are relative to the start of the record, even if the record is an excerpt of a longer recording. The exported
files follow the same convention.
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
"""Name of the tier in exported files; also the tier that is read from a file with several tiers."""

ROUNDING_S = 0.0005 + 1e-9
"""Largest change of a time when rounded to milliseconds, the resolution of ELAN."""

CSV_COLUMNS = ("start_s", "end_s", "gesture")


def read(path: str | Path, record: str, duration_s: float, labels: list[str]) -> pd.DataFrame:
    """Return the annotations table (schema ``annotations``) of a manually annotated file.

    Parameters
    ----------
    path : ELAN .eaf, Praat .TextGrid, or .csv with the columns start_s, end_s, gesture.
    record : name of the annotated record.
    duration_s : duration of the record in seconds.
    labels : the gesture classes of the configuration.

    Raises
    ------
    UserError
        If the file is missing or damaged, or if a span is empty, overlaps another one, extends past the end of the
        record or has an unknown label.
    """
    readers: dict[str, Callable[[str | Path], Spans]] = {
        ".eaf": lambda path: _select_tier(elan.read(path), path),
        ".textgrid": lambda path: _select_tier(textgrid.read(path), path),
        ".csv": _read_csv,
    }
    reader = readers.get(Path(path).suffix.lower())
    if reader is None:
        raise UserError(f"{path}: unknown annotation format; use .eaf, .TextGrid or .csv")
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    spans = sorted((start, end, label.strip()) for start, end, label in reader(path) if label.strip())
    check(spans, duration_s, labels, str(path))
    return table(record, spans, duration_s, "person")


def table(record: str, spans: Spans, duration_s: float, origin: str) -> pd.DataFrame:
    """Return the annotations table of spans (start, end, label), clipped to the end of the record."""
    return pd.DataFrame(
        {
            "record": pd.Series([record] * len(spans), dtype="str"),
            "start_s": pd.Series([start for start, _, _ in spans], dtype=float),
            "end_s": pd.Series([min(end, duration_s) for _, end, _ in spans], dtype=float),
            "gesture": pd.Series([label for _, _, label in spans], dtype="str"),
            "origin": pd.Series([origin] * len(spans), dtype="str"),
        }
    )


def select_record(planted: pd.DataFrame | None, record: str, duration_s: float, labels: list[str]) -> pd.DataFrame:
    """Return the rows of ``record`` from the planted annotations of all records; empty if there are none."""
    if planted is None:
        return table(record, [], duration_s, "person")
    rows = planted[planted["record"] == record].sort_values("start_s", ignore_index=True)
    spans = list(zip(rows["start_s"], rows["end_s"], rows["gesture"], strict=True))
    check(spans, duration_s, labels, f"planted examples of '{record}'")
    return table(record, spans, duration_s, "studio")


def check(spans: Spans, duration_s: float, labels: list[str], where: str) -> None:
    """Raise UserError for the first invalid one of ``spans``, which are sorted by time; ``where`` names them."""
    previous: tuple[float, float, str] = (0.0, 0.0, "")
    for start, end, label in spans:
        place = f"{where}: '{label}' at {start:.3f}-{end:.3f} s"
        if label not in labels:
            near = difflib.get_close_matches(label, labels, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"expected one of {', '.join(labels)}"
            raise UserError(f"{place}: unknown label; {hint}")
        if not (np.isfinite([start, end]).all() and 0 <= start < end):
            raise UserError(f"{place}: a span must start at 0 s or later and end after it starts; correct its times")
        if start >= duration_s or end > duration_s + ROUNDING_S:
            raise UserError(
                f"{place}: extends past the end of the record at {duration_s:.3f} s; shorten or delete it"
            )
        if start < previous[1] - 1e-9:
            raise UserError(
                f"{place}: overlaps '{previous[2]}' at {previous[0]:.3f}-{previous[1]:.3f} s; "
                "move the end of one to the start of the other"
            )
        previous = (start, end, label)


def _select_tier(tiers: dict[str, Spans], path: str | Path) -> Spans:
    """Return the spans of the tier named ``TIER``, or else of the only tier that is not empty."""
    filled = [name for name, spans in tiers.items() if any(label.strip() for _, _, label in spans)]
    if TIER in tiers:
        return tiers[TIER]
    if len(filled) > 1:
        raise UserError(
            f"{path}: has the tiers {', '.join(filled)[:200]}; rename the one with the gestures to '{TIER}'"
        )
    return tiers[filled[0]] if filled else []


def _read_csv(path: str | Path) -> Spans:
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [column for column in CSV_COLUMNS if column not in (reader.fieldnames or [])]
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be read as CSV ({reason}); export it again") from error
    if missing:
        raise UserError(f"{path}: column '{missing[0]}' is missing; expected the columns {', '.join(CSV_COLUMNS)}")
    spans = []
    for line, row in rows:
        if None in row or None in row.values():
            raise UserError(f"{path}: line {line} does not have as many fields as the header; correct it")
        start, end = (_parse_seconds(row[column], path, line) for column in ("start_s", "end_s"))
        spans.append((start, end, row["gesture"]))
    return spans


def _parse_seconds(text: str, path: str | Path, line: int) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{path}: line {line}: '{text[:20]}' is not a number of seconds; correct it") from None


def segment_spans(segments: pd.DataFrame) -> Spans:
    """Return the spans (start, end, label) in a segment table of one record."""
    return list(zip(segments["start_s"], segments["end_s"], segments["label"], strict=True))
