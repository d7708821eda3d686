"""The folder of a trained model: which system it belongs to, and whether it is complete."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cospeech.errors import UserError
from cospeech.synthesis.declaration import System
from cospeech.synthesis.registry import installed
from cospeech.workflow import model_folder


def system_of_model(folder: str | Path) -> System:
    """Return the declaration of the system that a model belongs to.

    Parameters
    ----------
    folder : folder of the model.

    Raises
    ------
    UserError : if the folder contains no model, or its system is not installed.

    Examples
    --------
    >>> api.system_of_model(api.BUNDLED).makes
    'phrases'
    """
    card = model_folder.read_card(Path(folder))
    try:
        return installed(card["system"])
    except UserError as error:
        raise UserError(f"{folder}: {error}") from error


def check_tables(place: Path, system: System, read: model_folder.ModelFolder, others: Sequence[str] = ()) -> None:
    """Raise UserError if a model lacks a table of its system, or one of ``others``."""
    missing = [name for name in (*system.tables, *others) if name not in read.tables]
    if missing:
        raise UserError(
            f"{place}: not a model of '{system.name}' as installed, which has a table '{missing[0]}'; train it again"
        )
