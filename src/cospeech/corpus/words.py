"""Times of the words of a record, from Praat or CSV, as forced aligners and transcribers write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.errors import UserError
from cospeech.formats import delimited, textgrid
from cospeech.formats.plain_text import shown
from cospeech.formats.tiers import Interval

TIER = "words"
"""The tier that is read from a TextGrid with several tiers."""

COLUMNS = ("start_s", "end_s", "word")


def read(path: str | Path, record: str) -> pd.DataFrame:
    """Return the words (schema ``words``) in a file, in order of time.

    Parameters
    ----------
    path : a Praat .TextGrid, of which the tier ``TIER`` is read, or else the only tier with labels; or a .csv or .tsv
        file with the columns start_s, end_s and word.
    record : name of the record. Its times begin at 0.

    Raises
    ------
    UserError : if the file is missing or cannot be read, contains no word, or a word ends before it begins.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".textgrid", ".csv", ".tsv"):
        raise UserError(f"{path}: unknown format of words; use .TextGrid, .csv or .tsv")
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; correct the path")
    spoken = _in_textgrid(path) if ending == ".textgrid" else _in_csv(path)
    found = sorted(one._replace(label=one.label.strip()) for one in spoken if one.label.strip())
    if not found:
        raise UserError(f"{path}: contains no word; give a file with the times of words")
    for start_s, end_s, word, place in found:
        if not (np.isfinite([start_s, end_s]).all() and 0.0 <= start_s < end_s):
            raise UserError(
                f"{path}: {place}: '{shown(word)}' at {start_s:.3f}-{end_s:.3f} s; a word must start at 0 s or later "
                "and end after it starts"
            )
    columns = pd.DataFrame(found, columns=[*COLUMNS, "place"]).drop(columns="place")
    columns.insert(0, "record", record)
    return columns


def _in_textgrid(path: str | Path) -> list[Interval]:
    grid = textgrid.read(path)
    labelled = {name: rows for name, rows in grid.tiers if rows and any(row.label.strip() for row in rows)}
    if TIER in labelled:
        return labelled[TIER]
    if len(labelled) > 1:
        names = shown(", ".join(labelled), 200)
        raise UserError(f"{path}: has the tiers {names}; rename the one with the words to '{TIER}'")
    return next(iter(labelled.values()), [])


def _in_csv(path: str | Path) -> list[Interval]:
    sheet = delimited.read(path, COLUMNS)
    missing = [column for column in COLUMNS if column not in sheet.columns]
    if missing:
        raise UserError(f"{path}: has no column '{missing[0]}'; its columns must be {', '.join(COLUMNS)}")
    intervals = []
    for times, (line, cells) in zip(delimited.parse_times(sheet, COLUMNS[:2], path), sheet.rows, strict=True):
        if len(times) < 2 or not cells.get("word"):
            raise UserError(f"{path}: line {line} lacks a time or a word; complete or delete the line")
        intervals.append(Interval(times["start_s"], times["end_s"], cells["word"], f"line {line}"))
    return intervals
