"""The file of keywords, which assigns gestures to words."""

from __future__ import annotations

from pathlib import Path

from cospeech.errors import UserError


def read_keywords(path: Path) -> dict[str, tuple[int, ...]]:
    """Return the segments of each keyword in a CSV file.

    Raises
    ------
    UserError : if the file cannot be read, lacks a column, or a row has no word or no whole number.
    """
    from cospeech.formats import delimited

    sheet = delimited.read(path, ("word", "segment"))
    for column in ("word", "segment"):
        if column not in sheet.columns:
            raise UserError(f"{path}: has no column '{column}'; its columns must be word and segment")
    found: dict[str, list[int]] = {}
    for line, cells in sheet.rows:
        word, segment = cells.get("word", ""), cells.get("segment", "")
        if not word or not (segment.isascii() and segment.isdecimal()):
            raise UserError(
                f"{path}: line {line}: keyword '{word}' with segment '{segment}'; write a word and the number of a "
                "segment"
            )
        found.setdefault(word, []).append(int(segment))
    if not found:
        raise UserError(f"{path}: contains no keyword; add rows with a word and the number of a segment")
    return {word: tuple(dict.fromkeys(segments)) for word, segments in found.items()}
