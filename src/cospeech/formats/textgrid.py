"""TextGrid files of Praat: interval tiers that cover the whole record, including unlabelled intervals."""

from __future__ import annotations

from pathlib import Path

from praatio import textgrid
from praatio.data_classes.interval_tier import IntervalTier

from cospeech.data import tables
from cospeech.data.segments import Spans
from cospeech.errors import UserError


def read(path: str | Path) -> dict[str, Spans]:
    """Return the spans (start, end, label) of every interval tier, in seconds.

    Raises
    ------
    UserError : if the file is not a readable TextGrid.
    """
    try:
        grid = textgrid.openTextgrid(str(path), includeEmptyIntervals=False, duplicateNamesMode="rename")
    except Exception as error:  # damaged files make the library raise all kinds of errors
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged, or not a TextGrid ({reason}); save it again in Praat") from error
    return {
        tier.name: [(float(row.start), float(row.end), row.label) for row in tier.entries]
        for tier in grid.tiers
        if isinstance(tier, IntervalTier)
    }


def write(path: str | Path, tier: str, spans: Spans, duration_s: float) -> None:
    """Write spans (start, end, label) in seconds, in order, as the only tier of a TextGrid of ``duration_s``."""
    grid = textgrid.Textgrid(0, duration_s)
    grid.addTier(IntervalTier(tier, spans, 0, duration_s))
    with tables.replacing(path) as temporary:
        grid.save(str(temporary), format="long_textgrid", includeBlankSpaces=True)
