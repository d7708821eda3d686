"""Gesture annotations: read from ELAN, Praat or CSV, and exported to ELAN and Praat for manual correction.

Times are relative to the start of the record, even if the record is an excerpt of a longer recording. The exported
files follow the same convention. The times of ELAN files whose media have an offset, and of TextGrids that do not
start at 0, are adapted if it is clear how.
"""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.segments import Spans
from cospeech.errors import UserError
from cospeech.formats import delimited, elan, textgrid
from cospeech.formats.plain_text import shown
from cospeech.formats.tiers import Interval

TIER = "gesture"
"""Name of the tier in exported files; also the tier that is read from a file with several tiers."""

ROUNDING_S = 0.0005 + 1e-9
"""Largest change of a time when rounded to milliseconds, the resolution of ELAN."""

CSV_COLUMNS = ("start_s", "end_s", "gesture")
CSV_TIER = "tier"
"""Optional column of a CSV file with several tiers."""

SOUNDS = (".wav", ".mp3", ".flac", ".ogg", ".opus", ".m4a", ".aac", ".aif", ".aiff")
"""Endings of sound files, for ELAN files that do not state the type of their media."""


class Recording(NamedTuple):
    """What an annotation file has to agree with.

    Attributes
    ----------
    record : name of the annotated record.
    duration_s : duration of the record in seconds.
    sound : file name of its sound; None if it has none.
    start_s : where the record begins in that sound, in seconds.
    tolerance_s : largest difference in duration between motion and sound, in seconds.
    """

    record: str
    duration_s: float
    sound: str | None = None
    start_s: float = 0.0
    tolerance_s: float = 0.0


class Source(NamedTuple):
    """The chosen tier of a file: its name, its intervals, and notes on how their times were adapted."""

    tier: str
    intervals: list[Interval]
    notes: list[str]


def read(path: str | Path, recording: Recording, labels: list[str], tier: str | None = None) -> pd.DataFrame:
    """Return the annotations table (schema ``annotations``) of a manually annotated file.

    If the times of the file had to be adapted, the table has a column ``note`` that says how.

    Parameters
    ----------
    path : ELAN .eaf, Praat .TextGrid, or .csv or .tsv with the columns start_s, end_s, gesture and perhaps tier.
    recording : the annotated record.
    labels : the gesture classes of the configuration.
    tier : the tier to read; None: the tier ``TIER``, or else the only one with labels.

    Raises
    ------
    UserError
        If the file is missing or cannot be read, if it has no such tier, or if a span is empty, overlaps another one,
        extends past the end of the record or has an unknown label.
    """
    readers: dict[str, Callable[[str | Path, Recording, str | None], Source]] = {
        ".eaf": _read_elan,
        ".textgrid": _read_textgrid,
        ".csv": _read_csv,
        ".tsv": _read_csv,
    }
    reader = readers.get(Path(path).suffix.lower())
    if reader is None:
        raise UserError(f"{path}: unknown annotation format; use .eaf, .TextGrid, .csv or .tsv")
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    source = reader(path, recording, tier)
    composed = {_composed(label): label for label in labels}
    intervals = sorted(
        interval._replace(label=composed.get(_composed(interval.label), interval.label.strip()))
        for interval in source.intervals
        if interval.label.strip()
    )
    check(intervals, recording.duration_s, labels, f"{path}: tier '{source.tier}'" if source.tier else str(path))
    spans: Spans = []
    for start, end, label, _ in intervals:
        begin = max(start, spans[-1][1] if spans else 0.0)
        if begin < end:
            spans.append((begin, end, label))
    found = table(recording.record, spans, recording.duration_s, "person")
    return found.assign(note="; ".join(source.notes)) if source.notes else found


def add_notes(records: pd.DataFrame, annotations: pd.DataFrame) -> pd.DataFrame:
    """Return the record table with the notes of the annotations table added to those of the records."""
    if "note" not in annotations.columns:
        return records
    notes = annotations.dropna(subset="note").groupby("record")["note"].first()
    joined = [
        "; ".join(note for note in (row.note, notes.get(row.record)) if isinstance(note, str)) or None
        for row in records[["record", "note"]].itertuples()
    ]
    return records.assign(note=pd.Series(joined, index=records.index, dtype=object))


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
    check([Interval(*span, "") for span in spans], duration_s, labels, f"planted examples of '{record}'")
    return table(record, spans, duration_s, "studio")


def check(intervals: list[Interval], duration_s: float, labels: list[str], where: str) -> None:
    """Raise UserError for the first invalid one of ``intervals``, which are sorted; ``where`` names their source.

    Neighbours may overlap, and the first and last interval extend past the ends of the record, by rounding errors.
    """
    previous = Interval(0.0, 0.0, "", "")
    for interval in intervals:
        start, end, label, _ = interval
        place = f"{where}{', ' * bool(interval.place)}{interval.place}: '{shown(label)}' at {start:.3f}-{end:.3f} s"
        if label not in labels:
            near = difflib.get_close_matches(label, labels, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"expected one of {', '.join(labels)}"
            raise UserError(f"{place}: unknown label; {hint}")
        if not (np.isfinite([start, end]).all() and -ROUNDING_S <= start < end):
            raise UserError(f"{place}: a span must start at 0 s or later and end after it starts; correct its times")
        if start >= duration_s or end > duration_s + ROUNDING_S:
            raise UserError(
                f"{place}: extends past the end of the record at {duration_s:.3f} s; shorten or delete it"
            )
        if start < previous.end_s - ROUNDING_S:
            raise UserError(
                f"{place}: overlaps '{shown(previous.label)}' at {previous.start_s:.3f}-{previous.end_s:.3f} s; "
                "move the end of one to the start of the other"
            )
        previous = interval


def _composed(text: str) -> str:
    """Return a name in one of the ways in which Unicode writes accented letters."""
    return unicodedata.normalize("NFC", text.strip())


def _choose_tier(tiers: list[str], labelled: list[str], asked: str | None, path: str | Path) -> str | None:
    """Return the tier to read: the one asked for, or ``TIER``, or the only labelled one; None if none has labels."""
    wanted = asked or TIER
    same = [name for name in tiers if _composed(name) == _composed(wanted)]
    if len(same) > 1:
        raise UserError(f"{path}: has two tiers called '{wanted}'; rename one of them")
    if same:
        return same[0]
    if asked:
        near = difflib.get_close_matches(asked, tiers, n=1)
        hint = f"did you mean '{shown(near[0])}'?" if near else "correct corpus.annotations.tier"
        has = f"its tiers are {shown(', '.join(tiers), 200)}" if tiers else "it has no tiers"
        raise UserError(f"{path}: has no tier '{asked}'; {has}; {hint}")
    if len(labelled) > 1:
        raise UserError(
            f"{path}: has the tiers {shown(', '.join(labelled), 200)}; name the one with the gestures in "
            f"corpus.annotations.tier, or rename it to '{TIER}'"
        )
    return labelled[0] if labelled else None


def _read_elan(path: str | Path, recording: Recording, asked: str | None) -> Source:
    document = elan.Document(path)
    tier = _choose_tier(document.tiers, document.labelled, asked, path)
    if tier is None:
        return Source("", [], [])
    intervals, placed = document.read_tier(tier)
    notes = [f"boundaries without a time in {Path(path).name} placed evenly"] if placed else []
    origin_s, why = _media_origin(document.media, recording, path)
    if abs(origin_s - recording.start_s) <= ROUNDING_S:
        origin_s = 0.0  # the annotations begin where the record begins
    elif origin_s and recording.start_s:
        raise UserError(
            f"{path}: its times begin at {origin_s:.3f} s of the sound ({why}), but the record begins at "
            f"{recording.start_s:.3f} s (start_s); set the offset of the media in ELAN to {recording.start_s:.3f} s, "
            "or to 0 if the file is linked to the sound of the record alone"
        )
    if origin_s:
        intervals = [
            interval._replace(start_s=interval.start_s + origin_s, end_s=interval.end_s + origin_s)
            for interval in intervals
        ]
        notes.append(f"annotations moved by {origin_s:+.3f} s ({why})")
    return Source(tier, intervals, notes)


def _media_origin(media: list[elan.Media], recording: Recording, path: str | Path) -> tuple[float, str]:
    """Return the time in the sound at which the times of an ELAN file begin, and why.

    What counts is the record's own sound, if it is linked; or else any sound; or else any film.
    """
    own = [one for one in media if recording.sound and one.name == Path(recording.sound).name]
    sounds = [one for one in media if one.mime_type.startswith("audio") or one.name.lower().endswith(SOUNDS)]
    counted = own or sounds or media
    if not counted:
        return 0.0, ""
    first = counted[0]
    for other in counted:
        if other.origin_s != first.origin_s:
            raise UserError(
                f"{path}: TIME_ORIGIN is {first.origin_s:.3f} s for {first.name} and {other.origin_s:.3f} s for "
                f"{other.name}, and neither is known to be the sound of record '{recording.record}'; link its sound "
                "in ELAN, or give all media one offset"
            )
    others = [f"{one.origin_s:.3f} s for {one.name}" for one in media if one.origin_s != first.origin_s]
    ignored = f"; not {', '.join(others)}" if others else ""
    return first.origin_s, f"TIME_ORIGIN of {first.name or 'the media'} in {Path(path).name}{ignored}"


def _read_textgrid(path: str | Path, recording: Recording, asked: str | None) -> Source:
    grid = textgrid.read(path)
    labelled = [name for name, rows in grid.tiers if rows and any(row.label.strip() for row in rows)]
    tier = _choose_tier([name for name, _ in grid.tiers], labelled, asked, path)
    if tier is None:
        return Source("", [], [])
    intervals = dict(grid.tiers)[tier]
    if intervals is None:
        raise UserError(f"{path}: tier '{tier}' has points, not intervals; mark the gestures in an interval tier")
    length_s = grid.end_s - grid.start_s
    excess_s, tolerance_s = length_s - recording.duration_s, recording.tolerance_s + ROUNDING_S
    past = any(row.label.strip() and row.end_s > recording.duration_s + ROUNDING_S for row in intervals)
    if abs(grid.start_s) <= ROUNDING_S and (excess_s <= tolerance_s or past):
        return Source(tier, intervals, [])  # a span past the end of the record is reported by itself
    if abs(excess_s) > tolerance_s:
        raise UserError(
            f"{path}: the TextGrid runs from {grid.start_s:.3f} to {grid.end_s:.3f} s and the record from 0 to "
            f"{recording.duration_s:.3f} s; cut it in Praat, or shift its times, so that it covers the record"
        )
    moved = [
        interval._replace(start_s=interval.start_s - grid.start_s, end_s=interval.end_s - grid.start_s)
        for interval in intervals
    ]
    note = f"annotations moved by {-grid.start_s:+.3f} s ({Path(path).name} starts at {grid.start_s:.3f} s)"
    return Source(tier, moved, [note])


def _read_csv(path: str | Path, _: Recording, asked: str | None) -> Source:
    sheet = delimited.read(path, (*CSV_COLUMNS, CSV_TIER))
    for column in CSV_COLUMNS:
        if column not in sheet.columns:
            if column in map(str.lower, sheet.columns):
                raise UserError(f"{path}: write the column name '{column}' in lower case")
            name = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}.get(
                sheet.separator, f"'{sheet.separator}'"
            )
            raise UserError(
                f"{path}: column '{column}' is missing (columns are separated by {name}); expected the columns "
                f"{', '.join(CSV_COLUMNS)}"
            )
    times = delimited.parse_times(sheet, CSV_COLUMNS[:2], path)
    tiers: dict[str, list[Interval]] = {}
    for row, (line, cells) in zip(times, sheet.rows, strict=True):
        for column in CSV_COLUMNS:
            if column not in cells or not (cells[column] or column == CSV_COLUMNS[2]):
                raise UserError(f"{path}: line {line} has nothing in column '{column}'; complete or delete the line")
        interval = Interval(row["start_s"], row["end_s"], cells["gesture"], f"line {line}")
        tiers.setdefault(cells.get(CSV_TIER, ""), []).append(interval)
    if CSV_TIER not in sheet.columns:
        return Source("", tiers.get("", []), [])
    labelled = [name for name, rows in tiers.items() if any(row.label for row in rows)]
    tier = _choose_tier(list(tiers), labelled, asked, path)
    return Source(tier or "", tiers.get(tier or "", []), [])


def segment_spans(segments: pd.DataFrame) -> Spans:
    """Return the spans (start, end, label) in a segment table of one record."""
    return list(zip(segments["start_s"], segments["end_s"], segments["label"], strict=True))
