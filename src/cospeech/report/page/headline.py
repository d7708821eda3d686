"""The headline table: one row per system, in place of sentences that would repeat themselves."""

from __future__ import annotations

import pandas as pd

from cospeech.report import words
from cospeech.report.page.comparing import (
    FEWEST_RECORDS,
    STATED,
    compared_systems,
    controls_of,
    over_all_actors,
    row_of,
    verdict,
    with_interval,
)
from cospeech.report.page.tables import Table
from cospeech.report.systems import System, Systems
from cospeech.report.words import number

VERDICTS = {"better": "▲", "worse": "▼", "undecided": "◦"}
"""The sign of each verdict, so that no colour is needed."""


def headline(scores: pd.DataFrame, differences: pd.DataFrame, systems: Systems, level: float) -> Table | None:
    """Return a table with one row per system: how well it does, and how much of that is due to its speech.

    Parameters
    ----------
    scores, differences, systems, level : as for ``findings.findings``.

    Returns
    -------
    The table; None if there are too few records to compare systems.
    """
    pooled, paired = over_all_actors(scores, differences, systems)
    if int(pooled["n_records"].max()) < FEWEST_RECORDS:
        return None
    listening, _, table = compared_systems(pooled, paired, systems)
    rows = []
    for system in listening:
        cells = [system.title]
        for measure in STATED:
            own = row_of(pooled, system=system.name, measure=measure, part="interior")
            strictest = row_of(table, system=system.name, other=system.controls[-1], measure=measure)
            cells += ["" if own is None else number(own["value"]), _judged(strictest, measure, level)]
        rows.append([*cells, _beaten_controls(system, table, systems, level)])
    shift = "minus the same system at the wrong moment"
    headings = ["system", "gestures: kappa", shift, "boundaries: D (s)", shift, "better than its controls"]
    return Table(headings, rows, words=(5,))


def _judged(row: pd.Series | None, measure: str, level: float) -> str:
    """Return a difference with its interval and a verdict, which a sign and a word state."""
    if row is None:
        return ""
    found = verdict(row, words.MEASURES[measure].better, level)
    return f"{with_interval(row, 'difference')} {VERDICTS[found]} {found}"


def _beaten_controls(system: System, table: pd.DataFrame, systems: Systems, level: float) -> str:
    """Return how many of its controls a system beats in each measure."""
    clauses = []
    for measure in STATED:
        rows = [
            row_of(table, system=system.name, other=name, measure=measure) for name in controls_of(system, systems)
        ]
        found = [verdict(row, words.MEASURES[measure].better, level) for row in rows if row is not None]
        clauses.append(f"{found.count('better')} of {len(found)} in {measure}")
    return ", ".join(clauses)
