"""What a run found about heads, in words that claim no more than the intervals allow."""

from __future__ import annotations

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits.run import Run
from cospeech.report.page.comparing import FEWEST_RECORDS, with_interval
from cospeech.report.page.findings import Finding
from cospeech.report.systems import System, driven

FOLLOWS, DISTANCE = "speed_correlation", "euclidean"
"""The measures in which findings compare heads: do they move when the recorded one does, and how far off are they?"""


def head_findings(run: Run, differences: pd.DataFrame | None, captured: pd.DataFrame | None) -> list[Finding]:
    """Return the findings about heads, most important first.

    Parameters
    ----------
    differences : numbers of the exhibit ``fig-head-differences``, or None.
    captured : numbers of ``table-head-capture``, or None.
    """
    found = []
    if differences is not None:
        own = differences[differences["unit"] == "record"]
        if own["n"].max() < FEWEST_RECORDS:
            found.append(
                Finding(
                    f"{words.counted(int(own['n'].max()), 'record')} cannot distinguish between heads.",
                    [f"that takes at least {FEWEST_RECORDS} records; the scores are shown below all the same"],
                )
            )
        else:
            listening = driven(run.heads)
            found += [_follows(run, system, own) for system in listening if system.controls]
            found += _constant(run, listening[0], own)
    if captured is not None:
        found.append(_of_capture(captured))
    return found


def _follows(run: Run, system: System, differences: pd.DataFrame) -> Finding:
    """Return whether a head moves when the recorded one does, beyond the same system that hears the wrong moment."""
    control = system.controls[-1]
    own = differences[(differences["measure"] == FOLLOWS) & (differences["other"] == control)]
    own = own[own["system"] == system.name].rename(columns={"value": "difference"})
    if own.empty:
        return Finding(f"Nothing can be said about the timing of “{system.title}”.", ["its head does not move"])
    row = own.iloc[0]
    moves = "moves with the voice" if row["low"] > 0 else "cannot be shown to move with the voice"
    title = run.heads[control].title.removeprefix(f"{system.title}: ")
    return Finding(
        f"“{system.title}” {moves}.",
        [f"correlation of angular speeds, minus {title}: {with_interval(row, 'difference')}"],
    )


def _constant(run: Run, system: System, differences: pd.DataFrame) -> list[Finding]:
    """Return how the nearest control that hears no speech fares in a measure of distance."""
    own = differences[(differences["system"] == system.name) & (differences["measure"] == DISTANCE)]
    rows = own[~own["other"].isin(system.controls)].rename(columns={"value": "difference"})
    rows = rows[[run.heads[name].role == "control" for name in rows["other"]]]
    if rows.empty:
        return []
    nearest = rows.sort_values("difference", kind="stable").iloc[-1]
    verdict = "is not beaten in distance by"
    if nearest["low"] > 0 or nearest["high"] < 0:
        verdict = f"is {'nearer to' if nearest['low'] > 0 else 'farther from'} the recorded head than"
    apart = with_interval(nearest, "difference", "°")
    return [
        Finding(
            f"“{run.heads[nearest['other']].title}” {verdict} “{system.title}”.",
            [
                f"Euclidean distance of the latter minus that of the former: {apart}",
                "a head that moves as much as the recorded one is nearer than a constant head only if their angles "
                "correlate by more than one half; the correlation of speeds asks for less",
            ],
        )
    ]


def _of_capture(summary: pd.DataFrame) -> Finding:
    """Return how far captured heads are from the true ones."""
    turned = summary[summary["quantity"] == "rotation"].iloc[0]
    return Finding(
        f"Captured heads are {turned['mean']:.2f}° from the true ones on average, {turned['largest']:.1f}° at most.",
        [f"{turned['tracked_pct']:.1f} % of the frames were measured; the goals are 0.7° and 2°"],
    )
