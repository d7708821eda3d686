"""Verification of all tables of a run: page checksums, schema, ranges."""

from __future__ import annotations

from pathlib import Path

from cospeech.data import tables
from cospeech.errors import UserError


def problems(folder: Path) -> list[str]:
    """Return one message per damaged Parquet file below ``folder``, sorted by path."""
    found = []
    for path in sorted(folder.rglob("*.parquet")):
        try:
            name = tables.read_metadata(path).get("schema", "")
            tables.read(path, name)
        except UserError as error:
            found.append(str(error))
        except KeyError:
            found.append(f"{path}: has the unknown schema '{name}'; delete it and run again")
    return found
