"""A trained model as a folder: its tables, and a card that says what it is and holds their checksums.

``model.json`` is the card: system, variant, actor, what the model rests on, the settings that new speech needs, and
for each table its schema and SHA-256. The tables are Parquet files next to it. See docs/models.md.
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


class ModelFolder(NamedTuple):
    """What a model folder holds: the entries of its card, and its tables by name."""

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
    """Write a model to ``folder``; the card comes last, so that a folder without one is known to be incomplete.

    Parameters
    ----------
    card : what the model is; ``format``, ``corpus`` and ``tables`` are added.
    named : tables with their schemas, by name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    listed = {}
    for name, (table, schema) in named.items():
        path = folder / f"{name}.parquet"
        tables.write(table, path, schema, corpus=corpus, config_hash=config_hash)
        listed[name] = {"schema": schema, "sha256": _sha256(path)}
    text = json.dumps({"format": FORMAT, **card, "corpus": corpus, "tables": listed}, indent=2, ensure_ascii=False)
    with tables.replacing(folder / CARD) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def read(folder: Path) -> ModelFolder:
    """Read the model in ``folder``.

    Raises
    ------
    UserError : where there is no model, or it is incomplete, damaged, or of another version.
    """
    card = read_card(folder)
    found = {}
    for name, entry in card["tables"].items():
        path = folder / f"{name}.parquet"
        if not path.is_file():
            raise UserError(f"{folder}: the model is incomplete, its table {path.name} is missing; build it again")
        if _sha256(path) != entry["sha256"]:
            raise UserError(f"{path}: damaged (its content is not what was written); build the model again")
        found[name] = tables.read(path, entry["schema"])
    return ModelFolder(card, found)


def read_card(folder: Path) -> dict[str, Any]:
    """Read the card of the model in ``folder``; see ``read``."""
    path = folder / CARD
    if not folder.is_dir():
        raise UserError(f"{folder}: no such model folder; build one with 'cospeech run models', or correct the path")
    if not path.is_file():
        raise UserError(f"{folder}: holds no {CARD}, so it is not a model or was not finished; build it again")
    try:
        card = json.loads(path.read_text(encoding="utf-8"))
        version, listed = card["format"], card["tables"]
        complete = all(isinstance(entry["schema"], str) and entry["sha256"] for entry in listed.values())
        complete &= {"system", "variant", "actor", "speech", "motion_fps", "seed"} <= card.keys()
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UserError(f"{path}: damaged ({type(error).__name__}); build the model again") from error
    if version != FORMAT:
        raise UserError(
            f"{path}: is of format {version}, and this cospeech reads format {FORMAT}; build the model again"
        )
    if not complete:
        raise UserError(f"{path}: lacks entries of a model's card; build the model again")
    return dict(card)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
