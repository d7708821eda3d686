"""Praat's TextGrids: interval tiers that cover the record, unlabelled stretches included."""

from __future__ import annotations

from pathlib import Path

from praatio import textgrid
from praatio.data_classes.interval_tier import IntervalTier

from cospeech.data import tables
from cospeech.errors import UserError

Spans = list[tuple[float, float, str]]


def read(path: str | Path) -> dict[str, Spans]:
    """Return the spans (start, end, label) of every interval tier, in seconds.

    Raises
    ------
    UserError : where the file is no readable TextGrid.
    """
    try:
        grid = textgrid.openTextgrid(str(path), includeEmptyIntervals=False, duplicateNamesMode="rename")
    except Exception as error:  # what a damaged file raises inside the library is anybody's guess
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged, or no TextGrid ({reason}); save it again in Praat") from error
    return {
        tier.name: [(float(row.start), float(row.end), row.label) for row in tier.entries]
        for tier in grid.tiers
        if isinstance(tier, IntervalTier)
    }


def write(path: str | Path, tier: str, spans: Spans, duration_s: float) -> None:
    """Write spans (start, end, label) in seconds, in order, as the one tier of a TextGrid of the record's length."""
    grid = textgrid.Textgrid(0, duration_s)
    grid.addTier(IntervalTier(tier, spans, 0, duration_s))
    with tables.replacing(path) as temporary:
        grid.save(str(temporary), format="long_textgrid", includeBlankSpaces=True)
