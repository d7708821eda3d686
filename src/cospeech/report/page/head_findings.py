"""What a run found about heads, in words that claim no more than the intervals allow."""

from __future__ import annotations

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits.run import Run
from cospeech.report.page.comparing import FEWEST_RECORDS, with_interval
from cospeech.report.page.findings import Finding
from cospeech.report.systems import System, driven

STATED = "euclidean"
"""The measure in which findings compare heads: no few frames dominate it, and every reader knows its unit."""


def head_findings(run: Run, differences: pd.DataFrame | None, captured: pd.DataFrame | None) -> list[Finding]:
    """Return the findings about heads, most important first.

    Parameters
    ----------
    differences : numbers of the exhibit ``fig-head-differences``, or None.
    captured : numbers of ``table-head-capture``, or None.
    """
    found = []
    if differences is not None:
        own = differences[(differences["unit"] == "record") & (differences["measure"] == STATED)]
        if own["n"].max() < FEWEST_RECORDS:
            found.append(
                Finding(
                    f"{words.counted(int(own['n'].max()), 'record')} cannot distinguish between heads.",
                    [f"that takes at least {FEWEST_RECORDS} records; the scores are shown below all the same"],
                )
            )
        else:
            found += [_of_system(run, system, own) for system in driven(run.heads)]
    if captured is not None:
        found.append(_of_capture(captured))
    return found


def _of_system(run: Run, system: System, differences: pd.DataFrame) -> Finding:
    """Return whether the head of a system is nearer to the recorded one than those that it is compared with."""
    rows = differences[differences["system"] == system.name]
    nearer = [run.heads[row["other"]].title for _, row in rows.iterrows() if row["high"] < 0]
    farther = [run.heads[row["other"]].title for _, row in rows.iterrows() if row["low"] > 0]
    undecided = [run.heads[name].title for name in rows["other"]]
    undecided = [title for title in undecided if title not in (*nearer, *farther)]
    clauses = [
        f"{verb} {words.joined([f'“{title}”' for title in titles])}"
        for verb, titles in (
            ("is nearer to the recorded head than", nearer),
            ("is farther from it than", farther),
            ("cannot be distinguished from", undecided),
        )
        if titles
    ]
    evidence = [
        f"minus “{run.heads[row['other']].title}”: {with_interval(row, 'difference', '°')}"
        for _, row in rows.rename(columns={"value": "difference"}).iterrows()
    ]
    return Finding(
        f"The head of “{system.title}” {'; it '.join(clauses)}.", [*evidence, "mean distance of the angles"]
    )


def _of_capture(summary: pd.DataFrame) -> Finding:
    """Return how far captured heads are from the true ones."""
    turned = summary[summary["quantity"] == "rotation"].iloc[0]
    return Finding(
        f"Captured heads are {turned['mean']:.2f}° from the true ones on average, {turned['largest']:.1f}° at most.",
        [f"{turned['tracked_pct']:.1f} % of the frames were measured; the goals are 0.7° and 2°"],
    )
