"""The HSMM as tables: states are gesture classes, symbols are prosody clusters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov.hsmm import HSMM

TABLES = ("initial", "transitions", "emissions", "durations")
"""The four tables of a model. Each is the name of a schema, and of the attribute of ``HSMM`` that it contains."""


def to_tables(model: HSMM, frame_s: float, floor: float | None = None) -> dict[str, pd.DataFrame]:
    """Return the model as tables of the schemas ``TABLES``.

    Parameters
    ----------
    frame_s : length of a frame in seconds.
    floor : the floor that the probabilities were raised to, if any.
    """
    gestures, clusters = (np.array(names, dtype=object) for names in (model.states, model.symbols))
    n_gestures, n_bins = model.durations.shape
    bins = np.tile(np.arange(1, n_bins + 1), n_gestures)
    keys = {
        "initial": {"gesture": gestures},
        "transitions": {
            "from_gesture": np.repeat(gestures, n_gestures),
            "to_gesture": np.tile(gestures, n_gestures),
        },
        "emissions": {
            "gesture": np.repeat(gestures, len(clusters)),
            "prosody": np.tile(clusters, n_gestures),
        },
        "durations": {"gesture": np.repeat(gestures, n_bins), "bin": bins, "duration_s": bins * frame_s},
    }
    shared = {"floor": np.nan if floor is None else floor, "actor": None}
    return {
        name: pd.DataFrame({**key, "probability": getattr(model, name).ravel(), **shared})
        for name, key in keys.items()
    }


def from_tables(tables: Mapping[str, pd.DataFrame]) -> HSMM:
    """Return the model in ``tables`` of the schemas ``TABLES``, with its states in the order of ``initial``.

    Raises
    ------
    UserError : if a probability is missing, or a gesture is not in ``initial``.
    """
    gestures = tuple(tables["initial"]["gesture"])
    clusters = tuple(dict.fromkeys(tables["emissions"]["prosody"]))
    bins = tuple(range(1, int(tables["durations"]["bin"].max()) + 1))
    return HSMM(
        states=gestures,
        symbols=clusters,
        initial=tables["initial"]["probability"].to_numpy(dtype=float).copy(),
        transitions=_matrix(tables, "transitions", "from_gesture", gestures, "to_gesture", gestures),
        emissions=_matrix(tables, "emissions", "gesture", gestures, "prosody", clusters),
        durations=_matrix(tables, "durations", "gesture", gestures, "bin", bins),
    )


def _matrix(
    tables: Mapping[str, pd.DataFrame], name: str, row: str, rows: tuple[str, ...], column: str, columns: tuple
) -> Floats:
    """Return the probabilities of one table as a matrix, with ``rows`` and ``columns`` in this order."""
    table = tables[name]
    row_of, column_of = ({key: place for place, key in enumerate(keys)} for keys in (rows, columns))
    if not set(table[row]) <= set(rows) or not set(table[column]) <= set(columns):
        raise UserError(f"{name} table: has a row of a gesture that the table of initial probabilities lacks")
    matrix = np.full((len(rows), len(columns)), np.nan)
    matrix[table[row].map(row_of), table[column].map(column_of)] = table["probability"]
    missing = np.argwhere(np.isnan(matrix))
    if len(missing):
        raise UserError(f"{name} table: lacks {row} '{rows[missing[0, 0]]}', {column} '{columns[missing[0, 1]]}'")
    return matrix
