"""A trained model as a folder: its tables, and a card that describes the model and lists their checksums.

The card, ``model.json``, contains what the model is (system, variant, actor), which records and settings it was made
with, the schema and SHA-256 of each table, and its own SHA-256. The tables are Parquet files next to it. See
docs/models.md.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from cospeech.data import tables
from cospeech.errors import UserError

FORMAT = 1
"""Version of the layout of a model folder."""

CARD = "model.json"

ENTRIES = frozenset(
    {
        *("system", "variant", "actor", "held_out", "records", "version", "corpus", "seed"),
        *("speech", "motion_fps", "continuity_weight", "smoothing"),
    }
)
"""Entries that every card has, besides ``format``, ``tables`` and ``sha256``."""


class ModelFolder(NamedTuple):
    """The content of a model folder: the entries of its card, and its tables by name."""

    card: dict[str, Any]
    tables: dict[str, pd.DataFrame]


def write(
    folder: Path,
    card: Mapping[str, Any],
    named: Mapping[str, tuple[pd.DataFrame, str]],
    *,
    corpus: str,
    config_hash: str,
) -> None:
    """Write a model to ``folder``; the card is written last, so a folder without one is incomplete.

    Parameters
    ----------
    card : what the model is (``ENTRIES`` without the corpus).
    named : tables with their schemas, by name.
    corpus, config_hash : provenance of the tables (see ``tables.write``).
    """
    folder.mkdir(parents=True, exist_ok=True)
    listed = {}
    for name, (table, schema) in named.items():
        path = folder / f"{name}.parquet"
        tables.write(table, path, schema, corpus=corpus, config_hash=config_hash)
        listed[name] = {"schema": schema, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    entries = {"format": FORMAT, **card, "corpus": corpus, "tables": listed}
    text = json.dumps(entries | {"sha256": checksum(entries)}, indent=2, ensure_ascii=False)
    with tables.replacing(folder / CARD) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def checksum(entries: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the entries of a card, whatever their order; its own entry ``sha256`` does not count."""
    others = {key: value for key, value in entries.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()


def read(folder: Path) -> ModelFolder:
    """Read the model in ``folder``.

    Raises
    ------
    UserError : if there is no model, or it is incomplete, damaged, or of another version.
    """
    card = read_card(folder)
    found = {}
    for name, entry in card["tables"].items():
        path = folder / f"{name}.parquet"
        if not path.is_file():
            raise UserError(f"{folder}: the model is incomplete, {path.name} is missing; copy or train it again")
        if hashlib.sha256(path.read_bytes()).hexdigest() != entry["sha256"]:
            raise UserError(f"{path}: damaged (its checksum is wrong); copy or train the model again")
        try:
            found[name] = tables.read(path, entry["schema"])
        except KeyError as error:
            raise UserError(
                f"{path}: this version of cospeech does not know tables of schema '{entry['schema']}'; "
                "train the model again"
            ) from error
    return ModelFolder(card, found)


def read_card(folder: Path) -> dict[str, Any]:
    """Read the card of the model in ``folder``; see ``read``."""
    path = folder / CARD
    if not folder.is_dir():
        raise UserError(
            f"{folder}: no such model folder; correct the path, or train a model with 'cospeech run models'"
        )
    if not path.is_file():
        raise UserError(f"{folder}: contains no {CARD}, so it is not a complete model; copy or train it again")
    try:
        card: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        version, expected = card["format"], card["sha256"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path}: damaged (not a card of a model); copy or train the model again") from error
    if version != FORMAT:
        raise UserError(
            f"{path}: has format {version}, but this version of cospeech reads format {FORMAT}; train the model again"
        )
    if checksum(card) != expected or not card.keys() >= ENTRIES | {"tables"}:
        raise UserError(f"{path}: damaged (its checksum is wrong); copy or train the model again")
    return card
