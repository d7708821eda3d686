"""Read, validate and write tables: Parquet files that follow a schema in ``data_schema/``.

The metadata of a file give its schema and version, the corpus, and the hash of the settings that it was made with.
Checksums are written with the content and verified when it is read. Files are written atomically: a file is complete
or does not exist.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from cospeech.data import project
from cospeech.errors import UserError

ARROW_TYPES = {
    "string": pa.string(),
    "bool": pa.bool_(),
    "int32": pa.int32(),
    "int64": pa.int64(),
    "float64": pa.float64(),
}

MARK = "~writing~"
"""In the name of every temporary file; the names of records contain no '~'."""


@dataclass(frozen=True)
class Column:
    """One column of a schema: type, unit, meaning and permitted values."""

    name: str
    type: str
    meaning: str
    unit: str | None = None
    nullable: bool = False
    minimum: float | None = None
    maximum: float | None = None
    values: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Schema:
    """The schema of one kind of table.

    Attributes
    ----------
    columns : the columns that every table has.
    key : names of the columns that identify a row.
    pattern : describes further columns whose names match its own name, a regular expression, such as the joint
        angles of a motion table.
    """

    name: str
    version: int
    title: str
    columns: tuple[Column, ...]
    key: tuple[str, ...]
    pattern: Column | None = None

    def column(self, name: str) -> Column | None:
        """Return the description of column ``name``, or None if the schema has no such column."""
        for column in self.columns:
            if column.name == name:
                return column
        if self.pattern is not None and re.fullmatch(self.pattern.name, name):
            return self.pattern
        return None


def schema_folder() -> Path:
    """Return the folder of the schemas."""
    return project.root() / "data_schema"


@functools.cache
def schema(name: str) -> Schema:
    """Return the schema called ``name``.

    ``<package>:<name>`` is the schema of another package: the file ``<name>.yaml`` in the folder of the package or,
    if there is none, the schema ``<name>`` of cospeech.

    Raises
    ------
    KeyError : if there is no such schema.
    UserError : if the package is not installed.
    """
    package, _, own = name.rpartition(":")
    path = schema_folder() / f"{own}.yaml"
    if package and (_package_folder(package, name) / f"{own}.yaml").is_file():
        path = _package_folder(package, name) / f"{own}.yaml"
    else:
        name = own
    if not path.is_file():
        raise KeyError(f"no schema {path.name} in {path.parent.name}/")
    raw = yaml.load(path.read_text(encoding="utf-8"), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    pattern = raw.get("pattern")
    return Schema(
        name=name,
        version=raw["version"],
        title=raw["title"],
        columns=tuple(_column(key, value) for key, value in raw["columns"].items()),
        key=tuple(raw.get("key", ())),
        pattern=_column(pattern["name"], pattern) if pattern else None,
    )


def _package_folder(package: str, schema_name: str) -> Path:
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        spec = None
    if spec is None or not spec.submodule_search_locations:
        raise UserError(f"schema '{schema_name}': no package '{package}' is installed; install it")
    return Path(next(iter(spec.submodule_search_locations)))


def _column(name: str, raw: dict[str, Any]) -> Column:
    return Column(
        name=name,
        type=raw["type"],
        meaning=raw["meaning"],
        unit=raw.get("unit"),
        nullable=raw.get("nullable", False),
        minimum=raw.get("minimum"),
        maximum=raw.get("maximum"),
        values=tuple(raw["values"]) if "values" in raw else None,
    )


def empty(schema_name: str) -> pd.DataFrame:
    """Return a table of the schema without a row."""
    return pd.DataFrame({column.name: [] for column in schema(schema_name).columns})


def validate(frame: pd.DataFrame, schema_name: str, where: str) -> None:
    """Raise UserError at the first violation of the schema in ``frame``; ``where`` is the origin for the message."""
    table = schema(schema_name)
    for column in table.columns:
        if column.name not in frame.columns:
            raise UserError(
                f"{where}: column '{column.name}' is missing; a {table.name} table has the columns "
                f"{', '.join(c.name for c in table.columns)}"
            )
    for name, values in frame.items():
        description = table.column(str(name))
        if description is None:
            raise UserError(
                f"{where}: unknown column '{name}' (wrong unit or name?); see the schema {table.name}.yaml"
            )
        _check_values(values, description, f"{where}: column '{name}'")
    if table.key and frame.duplicated(list(table.key)).any():
        row = int(np.flatnonzero(frame.duplicated(list(table.key)))[0])
        raise UserError(f"{where}: row {row} repeats the key ({', '.join(table.key)}) of an earlier row")


def _check_values(values: pd.Series, column: Column, where: str) -> None:
    missing = np.asarray(values.array.isna())  # cheaper than by way of a Series, and most tables are small
    if missing.any() and not column.nullable:
        raise UserError(f"{where}: row {int(np.flatnonzero(missing)[0])} is missing; this column allows no gaps")
    present = values[~missing] if missing.any() else values
    if column.type in ("int32", "int64", "float64"):
        if not pd.api.types.is_numeric_dtype(present.dtype) and len(present):
            raise UserError(f"{where}: holds {present.dtype} where numbers ({column.type}) belong")
        numbers = present.to_numpy(dtype=float)
        bad = ~np.isfinite(numbers)
        if column.type.startswith("int"):
            bad |= numbers != np.round(numbers)
        if column.minimum is not None:
            bad |= numbers < column.minimum
        if column.maximum is not None:
            bad |= numbers > column.maximum
        if bad.any():
            row = int(np.flatnonzero(~missing)[np.flatnonzero(bad)[0]])
            limits = f"[{column.minimum}, {column.maximum}]"
            raise UserError(
                f"{where}: row {row} is {values.iloc[row]}, outside {limits} {column.unit or ''}".rstrip()
            )
    if column.values is not None:
        unknown = ~present.isin(column.values).to_numpy()
        if unknown.any():
            value = present.iloc[int(np.flatnonzero(unknown)[0])]
            raise UserError(f"{where}: unknown value '{value}'; known are {', '.join(column.values)}")


def write(frame: pd.DataFrame, path: str | Path, schema_name: str, *, corpus: str, config_hash: str) -> None:
    """Validate ``frame`` and write it to ``path`` atomically.

    Parameters
    ----------
    frame : the table; its columns are written in the order of the schema.
    path : file to write.
    schema_name : name of the schema in ``data_schema/``.
    corpus : ``virtual`` for the studio, otherwise the name of the recorded corpus.
    config_hash : hash of the settings that the table was made with.

    Raises
    ------
    UserError : if the table violates its schema, or the disk is full.
    """
    validate(frame, schema_name, str(path))
    table = schema(schema_name)
    named = [column.name for column in table.columns]
    order = named + [name for name in frame.columns if name not in named]
    fields = [_field(table, name) for name in order]
    metadata = {
        "schema": table.name,
        "schema_version": str(table.version),
        "corpus": corpus,
        "config_hash": config_hash,
    }
    columns = [pa.array(frame[field.name], field.type, from_pandas=True) for field in fields]
    arrow = pa.Table.from_arrays(columns, schema=pa.schema(fields))
    arrow = arrow.replace_schema_metadata(metadata | {"content": _digest(arrow, metadata)})
    with replacing(path) as temporary:
        pq.write_table(arrow, temporary, write_page_checksum=True, compression="zstd")


@functools.cache
def _field(table: Schema, name: str) -> pa.Field:
    """Return the Arrow field of a column, with its unit as metadata."""
    column = table.column(name)
    assert column is not None  # ensured by validate()
    unit = {b"unit": column.unit.encode()} if column.unit else None
    return pa.field(name, ARROW_TYPES[column.type], column.nullable, metadata=unit)


def read(path: str | Path, schema_name: str, columns: list[str] | None = None) -> pd.DataFrame:
    """Read the table at ``path`` and validate it.

    Returns
    -------
    The table, or only its ``columns``; strings as pandas ``str``, nulls as NaN.

    Raises
    ------
    UserError : if the file is missing or damaged, has another schema or version, or violates its schema.
    """
    arrow = _read_arrow(path)
    found = _metadata(arrow)
    try:
        table = schema(schema_name)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    if found.get("schema") != table.name or found.get("schema_version") != str(table.version):
        raise UserError(
            f"{path}: holds schema '{found.get('schema')}' version {found.get('schema_version')}, expected "
            f"'{table.name}' version {table.version}; delete the file and run again, or write it again"
        )
    for field in arrow.schema:
        column = table.column(field.name)
        unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace") or None
        if column is not None and unit != column.unit:
            raise UserError(
                f"{path}: column '{field.name}' is in '{unit}', expected '{column.unit}'; "
                "convert it and write it again"
            )
    if found.pop("content", None) != _digest(arrow, found):
        raise UserError(f"{path}: damaged (its content differs from what was written); delete it and run again")
    frame = arrow.to_pandas()
    validate(frame, schema_name, str(path))
    return frame if columns is None else frame[columns]


def read_metadata(path: str | Path) -> dict[str, str]:
    """Return the metadata of the table at ``path``: schema, schema_version, corpus, config_hash."""
    found = _metadata(_read_arrow(path))
    found.pop("content", None)
    return found


def _metadata(arrow: pa.Table) -> dict[str, str]:
    pairs = (arrow.schema.metadata or {}).items()
    return {key.decode(errors="replace"): value.decode(errors="replace") for key, value in pairs}


def _digest(arrow: pa.Table, metadata: dict[str, str]) -> str:
    """Return the hash of all values and of ``metadata``; the checksums of Parquet do not cover the file's footer."""
    digest = hashlib.sha256(repr(sorted(metadata.items())).encode())
    for name, column in zip(arrow.column_names, arrow.columns, strict=True):
        digest.update(name.encode(errors="replace"))
        if pa.types.is_string(column.type) or pa.types.is_boolean(column.type):  # objects where null
            digest.update(repr(column.to_pylist()).encode())
        else:
            digest.update(column.to_numpy().tobytes())
    return digest.hexdigest()[:32]


def _read_arrow(path: str | Path) -> pa.Table:
    if not Path(path).is_file():
        raise UserError(f"{path}: no such file; run the workflow for it first")
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            return file.read(use_threads=False)  # jobs share the cores, and most tables are small
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise UserError(f"{path}: damaged or not a Parquet file ({reason}); delete it and run again") from error


def is_temporary(name: str) -> bool:
    """Return whether a file is called like those that ``replacing`` provides: one of them remains of a killed job."""
    return re.fullmatch(rf"\..*{MARK}[a-z0-9_]{{8}}(\.\w+)?", name) is not None


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Provide a temporary path next to ``path`` to write to, and move it to ``path`` when the block succeeds.

    If the process dies before that, the old file remains, or none, but never a part of the new one. The temporary
    name has the suffix of ``path``, because some libraries derive the format from it.

    Raises
    ------
    UserError : if the disk is full.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}{MARK}", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        if error.errno in (28, 122):  # ENOSPC, EDQUOT
            raise UserError(
                f"{path}: the disk is full; free some space and run again (no partial file is left)"
            ) from error
        raise
    finally:
        temporary.unlink(missing_ok=True)
