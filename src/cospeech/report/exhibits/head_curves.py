"""How well models fit by their number of patterns, and the angles of a head before and after the filters."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair

CRITERIA = {
    "alpha": ("α, log-likelihood per frame (more)", "max"),
    "beta": ("β, separation of patterns (more)", "max"),
    "bic": ("BIC per frame (less)", "min"),
    "stability": ("stability over restarts (more)", "max"),
}
"""The criteria: their titles, and whether the largest or the smallest value is the best."""

STAGES = {
    "drawn": ("drawn from the states", style.FAINT, 0.9),
    "median": ("median filter", style.AMBER, 1.0),
    "printed": ("median and Gaussian filter, as printed", style.VERMILLION, 1.6),
    "kept": ("filters that keep speed, jerk and spread", style.BLUE, 1.6),
}
"""The stages of generation: their titles, colours and line widths."""

ANGLE = "y_deg"
"""The angle that figure 4.5 shows: the turn, which is the largest."""


def heads(_: Run, curves: pd.DataFrame) -> Drawing:
    """Draw the criteria over the number of patterns of the head (figure 4.6).

    Parameters
    ----------
    curves : the table ``head_curves``.
    """
    return _of_stream(curves, "head")


def melodies(_: Run, curves: pd.DataFrame) -> Drawing:
    """Draw the criteria over the number of patterns of the melody (figure 4.8); see ``heads``."""
    return _of_stream(curves, "melody")


def joints(_: Run, curves: pd.DataFrame) -> Drawing:
    """Draw the criteria over the number of joint patterns (figure 4.10); see ``heads``."""
    return _of_stream(curves, "joint")


def _of_stream(curves: pd.DataFrame, stream: str) -> Drawing:
    own = curves[curves["stream"] == stream].reset_index(drop=True)
    return Drawing(own, _draw(own))


def _draw(own: pd.DataFrame) -> Figure:
    drawn, axes = style.figure(2.3, 1, len(CRITERIA))
    best = _best(own)
    for panel, (name, (title, _)) in zip(axes[0], CRITERIA.items(), strict=True):
        panel.plot(own["n_patterns"], own[name], marker="o", ms=4, color=style.BLUE)
        chosen = own[own["n_patterns"] == best[name]]
        panel.plot(chosen["n_patterns"], chosen[name], marker="o", ms=7, color=style.VERMILLION)
        panel.set_title(title, fontsize=8)
        panel.set_xticks(own["n_patterns"])
        panel.set_xlabel("patterns")
        panel.grid(axis="y")
    return drawn


def _best(own: pd.DataFrame) -> dict[str, int]:
    """Return the number of patterns that each criterion chooses."""
    found = {}
    for name, (_, kind) in CRITERIA.items():
        values = own[name].to_numpy(dtype=float)
        place = int(values.argmax() if kind == "max" else values.argmin())
        found[name] = int(own["n_patterns"].iloc[place])
    return found


def compare(_: Run, own: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of patterns next to those that the criteria choose."""
    best = _best(own)
    ours = ", ".join(f"{CRITERIA[name][0].split(',')[0].split(' (')[0]}: {number}" for name, number in best.items())
    return [Pair("number of patterns", f"{facts['best']} (by α and β together)", ours)]


def generation(_: Run, stages: pd.DataFrame) -> Drawing:
    """Draw one synthesised angle before and after the filters (figure 4.5).

    Parameters
    ----------
    stages : the table ``head_generation``.
    """
    drawn, axes = style.figure(2.8)
    panel = axes[0, 0]
    for name, (title, colour, width) in STAGES.items():
        own = stages[stages["stage"] == name]
        panel.plot(own["time_s"], own[ANGLE], color=colour, lw=width, label=title)
    first = stages[stages["stage"] == next(iter(STAGES))].reset_index(drop=True)
    for place in first.index[first["pattern"] != first["pattern"].shift()][1:]:
        panel.axvline(first.loc[place, "time_s"], color=style.GRID, lw=0.8, zorder=0)
    panel.set_xlabel("seconds (vertical lines: another pattern begins)")
    panel.set_ylabel("turn, degrees")
    drawn.legend(loc="outside lower center", ncols=2)
    return Drawing(stages[["stage", "time_s", "pattern", ANGLE]], drawn)
