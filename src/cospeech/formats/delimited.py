"""Delimited text (CSV) as spreadsheet programs write it.

Depending on the language of the computer, the separator is a comma, a semicolon or a tab, and the decimal sign a
point or a comma. The separator is found in the header line, whose column names are known.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from cospeech.errors import UserError
from cospeech.formats import plain_text

SEPARATORS = ",;\t|"

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
CLOCK = re.compile(r"(?:(\d+):(?=[0-5]?\d:))?(\d+):([0-5]?\d(?:\.\d*)?)", re.ASCII)
"""h:mm:ss or mm:ss, with or without decimals."""

TIME_FORMATS = "seconds (62.5) or h:mm:ss (0:01:02.5)"


class Row(NamedTuple):
    """One row: the number of its first line, counted from 1, and its cells by column."""

    line: int
    cells: dict[str, str]


class Sheet(NamedTuple):
    """A delimited file; cells are without surrounding blanks."""

    columns: tuple[str, ...]
    rows: list[Row]
    separator: str


def separator_of(text: str, known: Collection[str]) -> tuple[str, int]:
    """Return the separator of a delimited text, and the number of lines before its header.

    The separator is the one that leaves most of the ``known`` column names in the header. A first line ``sep=;``,
    which Excel writes and reads, states it.
    """
    stated = re.match(r'"?sep=(.)"?[\r\n]', text, re.IGNORECASE)
    if stated:
        return stated[1], 1
    header = (text.splitlines() or [""])[0]

    def fit(separator: str) -> tuple[int, int]:
        names = [name.strip() for name in next(csv.reader([header], delimiter=separator), [])]
        return sum(name in known for name in names), len(names)

    return max(SEPARATORS, key=fit), 0


def read(path: str | Path, known: Collection[str]) -> Sheet:
    """Read a delimited file, most of whose columns have names in ``known``.

    Rows without content are left out. A row that is shorter than the header lacks the cells at its end.

    Raises
    ------
    UserError
        If the file is missing or not text, if a column has no name or the name of another one, or if a row has more
        cells than the header or a cell with a line break.
    """
    text = plain_text.read(path)
    separator, skipped = separator_of(text, known)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    columns: list[str] = []
    rows = []
    line = 0
    try:
        for raw in reader:
            line, after = line + 1, reader.line_num
            cells = [cell.strip() for cell in raw]
            if any(cells) and line > skipped:
                if columns:
                    rows.append(Row(line, _row(columns, cells, separator, f"{path}: line {line}")))
                else:
                    columns = _header(cells, path)
            line = after
    except csv.Error as error:
        raise UserError(f"{path}: line {line + 1} cannot be read as CSV ({error}); export it again") from error
    return Sheet(tuple(columns), rows, separator)


def _header(cells: list[str], path: str | Path) -> list[str]:
    while not cells[-1]:
        del cells[-1]
    for column, name in enumerate(cells):
        if "\n" in name or "\r" in name:
            raise UserError(
                f"{path}: the name of column {column + 1}, '{plain_text.shown(name)}', contains a line break; remove "
                "it, or close the quotation mark before it"
            )
        if not name:
            raise UserError(f"{path}: column {column + 1} has no name in the header; name or delete it")
        if name in cells[:column]:
            raise UserError(f"{path}: two columns are called '{name[:40]}'; rename or delete one of them")
    return cells


def _row(columns: list[str], cells: list[str], separator: str, where: str) -> dict[str, str]:
    if any(cells[len(columns) :]):
        hint = "if its numbers have decimal commas, separate the columns by ';'" if separator == "," else "correct it"
        raise UserError(f"{where} has more cells than the header ({len(cells)}, not {len(columns)}); {hint}")
    for name, cell in zip(columns, cells, strict=False):
        if "\n" in cell or "\r" in cell:
            raise UserError(
                f"{where}: the cell in column '{name}' contains a line break; remove it, or close the quotation mark "
                "before it"
            )
    return dict(zip(columns, cells, strict=False))


def parse_number(text: str, separator: str = ",") -> float:
    """Return a number, which may have a decimal comma.

    A comma is a decimal comma if ``separator``, which separates the columns, is not a comma itself, or if it cannot
    separate thousands.

    Raises
    ------
    ValueError : if the text is not a number; the message says why.
    """
    plain = _with_decimal_point(text, separator)
    if not NUMBER.fullmatch(plain):
        raise ValueError(f"'{text[:20]}' is not a number")
    return float(plain)


def parse_seconds(text: str, separator: str = ",") -> float:
    """Return a time in seconds from a number of seconds, mm:ss or h:mm:ss; for commas see ``parse_number``.

    Raises
    ------
    ValueError : if the text is not such a time; the message says why.
    """
    plain = _with_decimal_point(text, separator)
    if NUMBER.fullmatch(plain):
        return float(plain)
    clock = CLOCK.fullmatch(plain)
    if clock:
        hours, minutes, seconds = clock.groups(default="0")
        return int(hours) * 3600 + int(minutes) * 60 + float(seconds)
    if re.fullmatch(r"\d+([:;.]\d+){3}", plain):
        raise ValueError(f"'{text[:20]}' is a time code with a frame number, and not a time in {TIME_FORMATS}")
    raise ValueError(f"'{text[:20]}' is not a number of seconds or a time; write {TIME_FORMATS}")


def _with_decimal_point(text: str, separator: str) -> str:
    plain = text.strip()
    if plain.count(",") == 1 and "." not in plain:
        if separator == "," and re.search(r",\d{3}$", plain):
            raise ValueError(f"'{text[:20]}' has a comma, which may be a decimal comma or separate thousands")
        plain = plain.replace(",", ".")
    return plain


def parse_times(sheet: Sheet, columns: Collection[str], path: str | Path) -> list[dict[str, float]]:
    """Return the times in seconds in ``columns`` of every row; empty cells are left out.

    Raises
    ------
    UserError
        If a cell is not a time, or if some numbers have a decimal point and others a decimal comma, so that one of
        the two may separate thousands.
    """
    times: list[dict[str, float]] = []
    signs: dict[str, tuple[int, str]] = {}
    for row in sheet.rows:
        filled = {name: row.cells[name] for name in columns if row.cells.get(name)}
        times.append({})
        for name, text in filled.items():
            signs |= {sign: (row.line, text) for sign in ".," if sign in text and sign not in signs}
            try:
                times[-1][name] = parse_seconds(text, sheet.separator)
            except ValueError as error:
                raise UserError(f"{path}: line {row.line}: {name} {error}") from None
    if len(signs) > 1:
        (line, comma), (other, point) = signs[","], signs["."]
        raise UserError(
            f"{path}: '{comma}' in line {line} has a decimal comma and '{point}' in line {other} a decimal point; "
            "use one of them throughout"
        )
    return times
