"""S and D against the number of prosody clusters and of their states (Özkul 2012, fig. 7.2)."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style, words
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair
from cospeech.report.scores import at_main
from cospeech.report.systems import Systems, driven, first_ceiling
from cospeech.report.words import number

Axis = Literal["clusters", "states"]

DASHES = {"ceiling": (0, (5, 3)), "control": (0, (1, 2))}
"""Lines of the reference levels, by role."""


def clusters(run: Run, scores: pd.DataFrame) -> Drawing:
    """Draw S and D against the number of prosody clusters, the number of states at its main value.

    Parameters
    ----------
    scores : the table ``session_scores``.
    """
    return _draw(run, scores, "clusters", run.published["fig-7.2a"])


def states(run: Run, scores: pd.DataFrame) -> Drawing:
    """Draw S and D against the number of states per prosody cluster, the number of clusters at its main value.

    Parameters
    ----------
    scores : the table ``session_scores``.
    """
    return _draw(run, scores, "states", run.published["fig-7.2b"])


def _draw(run: Run, scores: pd.DataFrame, axis: Axis, facts: Facts) -> Drawing:
    swept = table(scores, axis, run.main, [system.name for system in run.systems.values() if system.swept])
    best = best_published(facts, axis)
    return Drawing(swept, figure(swept, references(scores, run.systems), axis, run.titles, best))


def setting(variant: str) -> tuple[int | None, int | None]:
    """Return the numbers of clusters and states that a variant's name states: ``clusters~8,states~3``."""
    found = re.fullmatch(r"clusters~(\d+),states~(\d+)", variant)
    return (int(found[1]), int(found[2])) if found else (None, None)


def table(session_scores: pd.DataFrame, axis: Axis, main: dict[str, int], swept: list[str]) -> pd.DataFrame:
    """Return S and D of the swept systems along one axis of the sweep, the other at its main value.

    Parameters
    ----------
    session_scores : the table ``session_scores``.
    axis : what varies.
    main : clusters and states of the main setting.
    swept : names of the systems that were swept.
    """
    other = "states" if axis == "clusters" else "clusters"
    chosen = session_scores[
        session_scores["measure"].isin(["S", "D"])
        & (session_scores["part"] == "whole")
        & (session_scores["phrases"] == "planned")
        & session_scores["system"].isin(swept)
    ]
    found = pd.DataFrame(map(setting, chosen["variant"]), columns=["clusters", "states"], index=chosen.index)
    chosen = chosen.join(found)
    chosen = chosen[chosen[other] == main[other]]
    columns = ["system", "actor", "measure", "bin_s", axis, other, "value", "low", "high", "n", "n_undefined"]
    order = ["system", "actor", "measure", "bin_s", axis]
    return chosen[columns].astype({axis: int, other: int}).sort_values(order, kind="stable").reset_index(drop=True)


def references(session_scores: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return S and D of the first ceiling and of the strictest control of the first system, all actors pooled."""
    ceiling = first_ceiling(systems)
    names = [*([ceiling.name] if ceiling else []), *driven(systems)[0].controls[-1:]]
    rows = at_main(session_scores, systems)
    chosen = rows[
        rows["system"].isin(names)
        & (rows["phrases"] == "planned")
        & (rows["actor"] == "all")
        & (rows["part"] == "whole")
        & rows["measure"].isin(["S", "D"])
    ]
    return chosen.assign(role=[systems[name].role for name in chosen["system"]])


def best_published(facts: Facts, axis: Axis) -> dict[str, float]:
    """Return the best published value of one axis (``at``), and S and D there where they were printed."""
    names = {f"best_{axis}": "at", "best_S": "S", "best_D_s": "D"}
    return {short: facts[name] for name, short in names.items() if name in facts}


def figure(
    swept: pd.DataFrame, levels: pd.DataFrame, axis: Axis, titles: dict[str, str], published: dict[str, float]
) -> Figure:
    """Draw S at the finest and the widest bins, and D, against one axis of the sweep, all actors pooled.

    Parameters
    ----------
    swept : see ``table``.
    levels : see ``references``.
    axis : what varies.
    titles : title of each system.
    published : see ``best_published``.
    """
    pooled = swept[swept["actor"] == "all"]
    bins = sorted(pooled["bin_s"].dropna().unique())
    panels: list[tuple[str, float | None]] = [("S", bin_s) for bin_s in dict.fromkeys([bins[0], bins[-1]])]
    panels.append(("D", None))
    systems = list(dict.fromkeys(pooled["system"]))
    colours = style.system_colours(systems)
    drawn, axes = style.figure(3.3, 1, len(panels))
    for panel, (measure, bin_s) in zip(axes[0], panels, strict=True):
        for system in systems:
            _line(
                panel, _of(pooled[pooled["system"] == system], measure, bin_s), axis, titles[system], colours[system]
            )
        _levels(panel, _of(levels, measure, bin_s), titles)
        if measure in published:
            panel.plot(published["at"], published[measure], ls="none", marker="D", ms=6, mfc="none", mew=1.5,
                       color=style.INK, label="published (another corpus)")  # fmt: skip
        panel.set_title(words.measure(measure, bin_s))
        panel.set_xlabel(f"prosody {axis}")
        panel.set_xticks(sorted(pooled[axis].unique()))
        panel.set_ylim(0, 1 if measure == "S" else None)
        panel.grid(axis="y")
    handles: dict[str, Artist] = {}
    for panel in axes[0]:
        handles |= {label: handle for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    drawn.legend(list(handles.values()), list(handles), loc="outside upper center", ncols=3)
    return drawn


def _of(table: pd.DataFrame, measure: str, bin_s: float | None) -> pd.DataFrame:
    own = table[table["measure"] == measure]
    return own if bin_s is None else own[np.isclose(own["bin_s"], bin_s)]


def _line(axes: Axes, own: pd.DataFrame, axis: Axis, title: str, colour: str) -> None:
    axes.fill_between(own[axis], own["low"], own["high"], color=colour, alpha=0.16, lw=0)
    axes.plot(own[axis], own["value"], marker="o", ms=4, color=colour, label=title)


def _levels(axes: Axes, levels: pd.DataFrame, titles: dict[str, str]) -> None:
    for system, role, value in zip(levels["system"], levels["role"], levels["value"], strict=True):
        axes.axhline(value, color=style.FAINT, ls=DASHES[role], lw=1.3, label=titles[system])


def best_clusters(run: Run, swept: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published best number of prosody clusters, and S and D there, next to ours."""
    found = []
    for system, own in _pooled(swept):
        finest = own[(own["measure"] == "S") & (own["bin_s"] == own["bin_s"].min())]
        similarity, distance = _best(finest, "clusters", most=True), _best(own[own["measure"] == "D"], "clusters")
        name = run.titles[system]
        found += [
            Pair(f"{name}: clusters with the highest S", str(facts["best_clusters"]), str(similarity[0])),
            Pair(f"{name}: S there", f"{facts['best_S']:.4f}", similarity[1]),
            Pair(f"{name}: clusters with the lowest D", facts["least_D_clusters"], str(distance[0])),
            Pair(f"{name}: D there", f"{facts['best_D_s']:.4f} s (at {facts['best_clusters']})", f"{distance[1]} s"),
        ]
    return found


def best_states(run: Run, swept: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published numbers of states with the highest S and the lowest D next to ours."""
    found = []
    for system, own in _pooled(swept):
        finest = own[(own["measure"] == "S") & (own["bin_s"] == own["bin_s"].min())]
        similarity, distance = _best(finest, "states", most=True), _best(own[own["measure"] == "D"], "states")
        name = run.titles[system]
        found += [
            Pair(f"{name}: states with the highest S", facts["most_S_states"], str(similarity[0])),
            Pair(f"{name}: states with the lowest D", str(facts["best_states"]), str(distance[0])),
        ]
    return found


def _pooled(swept: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Return the rows of each system over all actors."""
    pooled = swept[swept["actor"] == "all"]
    return [(str(system), own) for system, own in pooled.groupby("system", sort=False)]


def _best(table: pd.DataFrame, axis: str, most: bool = False) -> tuple[int, str]:
    """Return where the best value lies, and the value with its interval."""
    row = table.sort_values("value", ascending=not most, kind="stable").iloc[0]
    return int(row[axis]), f"{number(row['value'])} ({number(row['low'])} to {number(row['high'])})"
