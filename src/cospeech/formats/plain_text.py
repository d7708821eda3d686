"""Text files of other programs, in whatever encoding they were saved."""

from __future__ import annotations

import codecs
from pathlib import Path

from cospeech.errors import UserError

MAX_BYTES = 50_000_000
"""Size beyond which a file of annotations or records is something else."""

BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark is the beginning of this one
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def read(path: str | Path, max_bytes: int | None = MAX_BYTES) -> str:
    """Return the text of a file; see ``decode``.

    Raises
    ------
    UserError : if the file is missing, cannot be read, is not text, or has more than ``max_bytes``.
    """
    return decode(read_bytes(path, max_bytes), path)


def read_bytes(path: str | Path, max_bytes: int | None = MAX_BYTES) -> bytes:
    """Return the content of a file.

    Raises
    ------
    UserError : if the file is missing, cannot be read, or has more than ``max_bytes``.
    """
    if not Path(path).is_file():
        raise UserError(f"{path}: cannot be read, there is no such file; correct the path")
    try:
        size = Path(path).stat().st_size
        if max_bytes is not None and size > max_bytes:
            raise UserError(
                f"{path}: has {size / 1e6:.0f} MB, more than the {max_bytes / 1e6:.0f} MB that a file of its kind "
                "may have; check that it is the right file"
            )
        return Path(path).read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error


def shown(text: str, length: int = 40) -> str:
    """Return the beginning of a text from a file, on one line, for a message."""
    return " ".join(text.split())[:length]


def decode(content: bytes, path: str | Path) -> str:
    """Return text from bytes in UTF-8, UTF-16, UTF-32 or, if they are none of these, Windows-1252.

    Raises
    ------
    UserError : if the bytes are not text; ``path`` names them.
    """
    encoding = next((name for mark, name in BYTE_ORDER_MARKS if content.startswith(mark)), None)
    if encoding is None and b"\x00" in content[:200]:  # UTF-16 without a byte order mark
        encoding = "utf-16-le" if content[1:200:2].count(0) > content[:200:2].count(0) else "utf-16-be"
    try:
        text = content.decode(encoding or "utf-8")
    except UnicodeDecodeError:
        text = "\x00" if encoding else content.decode("cp1252", errors="replace")
    if "\x00" in text:
        raise UserError(f"{path}: is not a text file; check that it is the right file, or export it as text")
    return text
