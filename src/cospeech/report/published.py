"""Our numbers beside the published ones."""

from __future__ import annotations

from typing import Any, NamedTuple

import pandas as pd

from cospeech.report import words
from cospeech.report.findings import number


class Pair(NamedTuple):
    """One fact: what it is, what was published, what we found."""

    what: str
    published: str
    ours: str


Published = dict[str, dict[str, Any]]


def pairs(name: str, published: Published, table: pd.DataFrame, titles: dict[str, str]) -> list[Pair]:
    """Return what was published beside what an exhibit's table says; nothing where only a plot was printed.

    Parameters
    ----------
    name : of the exhibit.
    published : facts by exhibit.
    table : the exhibit's numbers.
    titles : title of each system.
    """
    match name:
        case "table-3-scenarios":
            return corpus(published, table)
        case "table-4.1":
            return classes(published, table)
        case "fig-7.2a":
            return best_clusters(published, table, titles)
        case "fig-7.2b":
            return best_states(published, table, titles)
    return []


def corpus(published: Published, scenarios: pd.DataFrame) -> list[Pair]:
    """Return the size of the corpus beside that of the thesis."""
    known, total = published["table-3-scenarios"], scenarios[scenarios["scenario"] == "all"].iloc[0]
    alone = scenarios.loc[scenarios["scenario"].isin(words.MONOLOGUES), "records"].sum()
    return [
        Pair("records", str(known["records"]), str(total["records"])),
        Pair("participants", str(known["participants"]), str(total["participants"])),
        Pair("length", f"about {known['hours']} hours", f"{total['minutes']:.1f} minutes"),
        Pair("records of its three monologue scenarios", str(known["monologue_records"]), str(alone)),
    ]


def classes(published: Published, table: pd.DataFrame) -> list[Pair]:
    """Return the number of gesture classes beside that of the thesis."""
    found = int((table["phrases"] > 0).sum())
    return [Pair("gesture classes", str(published["table-4.1"]["classes"]), f"{found} of {len(table)} occur")]


def best_clusters(published: Published, swept: pd.DataFrame, titles: dict[str, str]) -> list[Pair]:
    """Return the best number of prosody clusters, and S and D there, beside those of the thesis."""
    known = published["fig-7.2a"]
    found = []
    for system in dict.fromkeys(swept["system"]):
        own = swept[(swept["system"] == system) & (swept["actor"] == "all")]
        finest = own[(own["measure"] == "S") & (own["bin_s"] == own["bin_s"].min())]
        similarity, distance = (
            _best(finest, "clusters", most=True),
            _best(own[own["measure"] == "D"], "clusters", most=False),
        )
        name = titles[system]
        found += [
            Pair(f"{name}: clusters of most S", str(known["best_clusters"]), str(similarity[0])),
            Pair(f"{name}: S there", f"{known['best_S']:.4f}", similarity[1]),
            Pair(f"{name}: clusters of least D", "4, closely followed by 8", str(distance[0])),
            Pair(f"{name}: D there", f"{known['best_D_s']:.4f} s (at 8)", f"{distance[1]} s"),
        ]
    return found


def best_states(published: Published, swept: pd.DataFrame, titles: dict[str, str]) -> list[Pair]:
    """Return the number of states of least D beside that of the thesis."""
    known = str(published["fig-7.2b"]["best_states"])
    found = []
    for system in dict.fromkeys(swept["system"]):
        own = swept[(swept["system"] == system) & (swept["actor"] == "all") & (swept["measure"] == "D")]
        found.append(Pair(f"{titles[system]}: states of least D", known, str(_best(own, "states", most=False)[0])))
    return found


def _best(table: pd.DataFrame, axis: str, most: bool) -> tuple[int, str]:
    """Return where the best value lies, and the value with its interval."""
    row = table.sort_values("value", ascending=not most, kind="stable").iloc[0]
    return int(row[axis]), f"{number(row['value'])} ({number(row['low'])} to {number(row['high'])})"
