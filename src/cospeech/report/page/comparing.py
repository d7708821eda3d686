"""Which systems the page compares, and what their differences show."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pandas as pd

from cospeech.metrics import bootstrap
from cospeech.report.scores import common_phrases, own_phrases
from cospeech.report.systems import System, Systems, driven, general_controls
from cospeech.report.words import number

FEWEST_RECORDS = 4
"""The fewest records for which differences between systems are stated."""

STATED = ("kappa", "D")
"""The measures in which findings compare systems, on the interior of records."""


def with_interval(row: pd.Series, name: str = "value", unit: str = "") -> str:
    """Return a number and its interval, ``0.52 (0.40 to 0.63)``; a difference with its sign."""
    signed = name == "difference"
    text = number(row[name], signed) + unit
    if row["low"] != row["low"]:
        return f"{text} (no interval)"
    return f"{text} ({number(row['low'], signed)} to {number(row['high'], signed)})"


def verdict(row: pd.Series, better: str, level: float) -> str:
    """Return ``better``, ``worse`` or ``undecided``.

    A difference is undecided if its interval includes 0, or if its p-value, corrected for the number of comparisons,
    is above 1 - ``level``.
    """
    if not (row["low"] > 0 or row["high"] < 0) or not row["p_corrected"] <= 1 - level:
        return "undecided"
    return "better" if (row["low"] > 0) == (better == "more") else "worse"


def over_all_actors(
    scores: pd.DataFrame, differences: pd.DataFrame, systems: Systems
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the scores and the differences of all actors together."""
    every, paired = own_phrases(scores, systems), common_phrases(differences, systems)
    return every[every["actor"] == "all"], paired[paired["actor"] == "all"]


def row_of(table: pd.DataFrame, **where: Any) -> pd.Series | None:
    """Return the first row whose columns have some values, or None."""
    for column, value in where.items():
        table = table[table[column] == value]
    return table.iloc[0] if len(table) else None


def compared_systems(
    pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems
) -> tuple[list[System], dict[str, list[str]], pd.DataFrame]:
    """Return the systems that speech drives, the systems each is compared with, and all stated differences."""
    scored = set(pooled["system"])
    listening = [system for system in driven(systems) if system.name in scored]  # one that failed has no scores
    rivals = {system.name: controls_of(system, systems) for system in listening}
    before = {
        system.name: list(dict.fromkeys([listening[0].name, previous.name]))
        for previous, system in pairwise(listening)
    }
    pairs = [(one, other) for side in (rivals, before) for one in side for other in side[one]]
    return listening, before, comparisons(paired, pairs)


def controls_of(system: System, systems: Systems) -> list[str]:
    """Return the controls that a system is compared with: its own, then those that belong to no system."""
    return [*system.controls, *(control.name for control in general_controls(systems))]


def comparisons(paired: pd.DataFrame, pairs: list[tuple[str, str]]) -> pd.DataFrame:
    """Return the differences of some pairs of systems that findings state, with p-values corrected for their number.

    Parameters
    ----------
    paired : the table ``differences`` of one actor and one kind of phrases.
    pairs : a system and the one that it is compared with, for each pair.
    """
    stated = paired[(paired["part"] == "interior") & paired["measure"].isin(STATED)].dropna(subset=["difference"])
    wanted = pd.MultiIndex.from_frame(stated[["system", "other"]]).isin(pairs)
    chosen = stated[wanted]
    return chosen.assign(p_corrected=bootstrap.holm(chosen["p_value"].to_numpy(dtype=float)))
