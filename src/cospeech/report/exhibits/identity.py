"""The exhibits of speaker identification: those of Sargin 2006, chapter 2, their controls, and gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from scipy.special import ndtri

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table

PAIRED, CEILING = "paired", "tested clips too"

CONDITIONS = {
    "paired": "lips that belong to the voice",
    "another speaker": "another speaker, same name",
    "another name": "same speaker, another name",
    "scrambled": "lips scrambled in time",
    "noise": "noise with the lips' spectrum",
    "whitened": "whitening alone",
    "audio alone": "audio alone, as many parameters",
    "tested clips too": "trained on tested clips, too",
}
"""What the transform is trained on, in the words of the report."""

CONTROLS = tuple(name for name in CONDITIONS if name not in (PAIRED, CEILING))

STRATEGIES = {
    "audio": "audio alone (f_A)",
    "lips": "lips alone (f_L)",
    "concatenated": "concatenation (f_AL)",
    "audio + lips": "decision fusion (f_A + f_L)",
    "audio + concatenated": "combined, no CCA (f_A + f_AL)",
    "audio + canonical": "combined with CCA (f_A + f̃_AL)",
    "audio + weak": "combined, optimal (f_A + Σ f̃_ALi)",
}
"""The strategies of table 2.2, in its order."""

SCHEMES = {
    "canonical": "f̃_AL",
    "weak": "Σ f̃_ALi",
    "audio + canonical": "f_A + f̃_AL",
    "audio + weak": "f_A + Σ f̃_ALi",
    "audio + lips + canonical": "f_A + f_L + f̃_AL",
    "audio + lips + weak": "f_A + f_L + Σ f̃_ALi",
}
"""The fusion schemes of table 2.1, in its order."""

PRINTED, USUAL = "as printed", "usual"


class Cell(NamedTuple):
    """A value, and in small print what belongs to it."""

    value: str
    small: str = ""


class Line(NamedTuple):
    """A line of a table of error rates; ``kind`` is ours, published, control or ceiling."""

    title: str
    kind: str
    cells: list[Cell]


class Group(NamedTuple):
    """Lines that belong together, below a title."""

    title: str
    lines: list[Line]


class Rates(NamedTuple):
    """A table of error rates as the page shows it."""

    headings: list[Cell]
    groups: list[Group]


def percent(value: float) -> str:
    """Return a rate with one decimal, as in the document."""
    return "–" if pd.isna(value) else f"{value:.1f}"


def interval(row: pd.Series) -> str:
    """Return the interval of a rate, ``2.1 to 5.0``."""
    return "" if pd.isna(row["low"]) else f"{percent(row['low'])} to {percent(row['high'])}"


def pooled(rates: pd.DataFrame, kind: str = PRINTED) -> pd.DataFrame:
    """Return the rows of a table ``equal_error_rates`` of all sessions together."""
    return rates[rates["session"].isna() & (rates["rates"] == kind)]


def shifts(_: Run, curve: pd.DataFrame, delay: pd.DataFrame, rates: pd.DataFrame) -> Drawing:
    """Draw the correlation measure and the error rate of early fusion against the shift (fig. 2.1).

    Parameters
    ----------
    curve, delay, rates : the tables ``delay_curve``, ``delay`` and ``shift_rates``.
    """
    found = delay.iloc[0]
    figure, axes = style.figure(2.9, 1, 2)
    left, right = axes[0]
    left.plot(curve["shift_ms"], curve["measure"], color=style.BLUE)
    if pd.notna(found["chance"]):
        left.axhline(found["chance"], color=style.FAINT, linestyle=(0, (4, 2)), linewidth=1.0)
        left.text(curve["shift_ms"].iloc[-1], found["chance"], "wrong pairings", ha="right", va="bottom",
                  color=style.FAINT, fontsize=8)  # fmt: skip
    if pd.isna(found["doubt"]):
        left.axvspan(found["low_ms"], found["high_ms"], color=style.VERMILLION, alpha=0.25, linewidth=0)
        left.axvline(found["delay_ms"], color=style.VERMILLION, linewidth=1.0)
    left.set_title("(a) correlation of voice and lips")
    left.set_ylabel("γ_AL, sum of squared correlations")
    left.set_ylim(bottom=0.0)
    for kind, colour in ((PRINTED, style.BLUE), (USUAL, style.AMBER)):
        own = rates[rates["rates"] == kind].sort_values("shift_ms")
        right.fill_between(own["shift_ms"], own["low"], own["high"], color=colour, alpha=0.15, linewidth=0)
        right.plot(own["shift_ms"], own["eer_pct"], color=colour, marker="o", markersize=3.5, label=kind)
    right.set_title("(b) equal error rate of concatenation")
    right.set_ylabel("equal error rate, %")
    right.set_ylim(bottom=0.0)
    right.legend(loc="best", title="rates", title_fontsize=8.5, alignment="left")
    for axis in (left, right):
        axis.set_xlabel("shift of the lips, ms")
        axis.grid(axis="y")
    numbers = curve.merge(
        rates.pivot_table(index="shift_ms", columns="rates", values="eer_pct").add_prefix("eer_pct ").reset_index(),
        on="shift_ms",
        how="left",
    )
    return Drawing(numbers.assign(**{name: found[name] for name in ("delay_ms", "low_ms", "high_ms")}), figure)


def compare_shifts(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published delay next to ours."""
    row = numbers.iloc[0]
    ours = f"{row['delay_ms']:.0f} ms ({row['low_ms']:.0f} to {row['high_ms']:.0f})"
    return [Pair("delay of the voice", f"{facts['delay_ms']} ms", ours)]


def correlations(run: Run, correlations: pd.DataFrame) -> Drawing:
    """Draw the canonical correlations of each session in decreasing order (fig. 2.2).

    Parameters
    ----------
    correlations : the table ``canonical_correlations``.
    """
    facts = run.published["identity-fig-2.2"]
    figure, axes = style.figure(2.8)
    axis = axes[0, 0]
    colours = style.system_colours(correlations["session"].unique())
    for session, own in correlations.groupby("session", sort=False):
        look = {"color": colours[str(session)], "marker": "o", "markersize": 2.5, "linewidth": 1.0}
        axis.plot(own["pair"], own["correlation"], label=f"session {session}", **look)
    axis.axhline(facts["threshold"], color=style.FAINT, linestyle=(0, (4, 2)), linewidth=1.0)
    axis.text(1.0, facts["threshold"], f"{facts['threshold']:g}", color=style.FAINT, va="bottom", fontsize=8)
    axis.set_xlabel("pair of canonical components")
    axis.set_ylabel("canonical correlation")
    axis.set_ylim(0.0, 1.0)
    axis.grid(axis="y")
    axis.legend(loc="upper right", ncols=2)
    return Drawing(correlations, figure)


def compare_correlations(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published canonical correlations next to ours."""
    per_session = numbers.groupby("session")["correlation"]
    above = per_session.apply(lambda values: int((values > facts["threshold"]).sum()))
    largest = per_session.max()
    return [
        Pair("largest correlation", f"about {facts['largest']}", _range(largest, ".2f")),
        Pair(f"correlations above {facts['threshold']:g}", f"{facts['above']} of 39 (15 in table 2.1)",
             f"{_range(above, 'd')} of {int(numbers['pair'].max())}"),
    ]  # fmt: skip


def _range(values: pd.Series, form: str) -> str:
    low, high = format(values.min(), form), format(values.max(), form)
    return low if low == high else f"{low} to {high}"


def best_of(rates: pd.DataFrame, condition: str, strategy: str) -> pd.Series | None:
    """Return the row of a strategy with the least equal error rate over its thresholds, or None."""
    own = rates[(rates["condition"] == condition) & (rates["strategy"] == strategy)].dropna(subset=["eer_pct"])
    return None if own.empty else own.sort_values("eer_pct", kind="stable").iloc[0]


def strategies(_: Run, rates: pd.DataFrame) -> Drawing:
    """Return the strategies of table 2.2 under all conditions, each at its best threshold.

    Parameters
    ----------
    rates : the table ``equal_error_rates``.
    """
    rows = []
    for kind in (PRINTED, USUAL):
        own = pooled(rates, kind)
        for strategy in STRATEGIES:
            for condition in CONDITIONS:
                row = best_of(own, condition, strategy)
                if row is not None:
                    rows.append(row)
    columns = ["strategy", "condition", "rates", "threshold", "dimension", "eer_pct", "low", "high"]
    return Drawing(pd.DataFrame(rows)[columns].reset_index(drop=True))


def strategy_table(run: Run, numbers: pd.DataFrame) -> Table:
    """Return table 2.2 for the page: published, ours, the strictest control and the ceiling."""
    published = run.published["identity-table-2.2"]["eer_pct"]
    rows = []
    for strategy, title in STRATEGIES.items():
        own = numbers[numbers["strategy"] == strategy]
        cells = [percent(published[strategy])]
        for kind in (PRINTED, USUAL):
            cells.append(_with_interval(own[own["rates"] == kind], PAIRED))
        printed = own[own["rates"] == PRINTED]
        controls = printed[printed["condition"].isin(CONTROLS)]
        if len(controls):
            strictest = controls.sort_values("eer_pct", kind="stable").iloc[0]
            cells.append(f"{percent(strictest['eer_pct'])}: {CONDITIONS[strictest['condition']]}")
        else:
            cells.append("")
        rows.append([title, *cells, _with_interval(printed, CEILING)])
    headings = [
        "strategy", "published, %", "this run, %", "this run, usual rates, %", "strictest control, %", "ceiling, %",
    ]  # fmt: skip
    return Table.of(headings, rows, words=(4,))


def _with_interval(rows: pd.DataFrame, condition: str) -> str:
    own = rows[rows["condition"] == condition]
    if own.empty:
        return ""
    row = own.iloc[0]
    return f"{percent(row['eer_pct'])} ({interval(row)})" if interval(row) else percent(row["eer_pct"])


def schemes(_: Run, rates: pd.DataFrame) -> Drawing:
    """Return the fusion schemes of table 2.1 at every threshold and under all conditions.

    Parameters
    ----------
    rates : the table ``equal_error_rates``.
    """
    own = pooled(rates)
    columns = ["strategy", "condition", "threshold", "dimension", "eer_pct", "low", "high"]
    return Drawing(own.loc[own["strategy"].isin(SCHEMES), columns].reset_index(drop=True))


def scheme_table(run: Run, numbers: pd.DataFrame) -> Rates:
    """Return table 2.1 for the page: ours with intervals, published values, all controls, and the ceiling."""
    facts = run.published["identity-table-2.1"]
    paired = numbers[numbers["condition"] == PAIRED].drop_duplicates("threshold").sort_values("threshold")
    thresholds = paired["threshold"].tolist()
    headings = [Cell(f"{row['threshold']:.2f}", f"M = {row['dimension']:g}") for _, row in paired.iterrows()]
    groups = []
    for strategy, title in SCHEMES.items():
        known = dict(zip(facts["threshold"], facts["eer_pct"][strategy], strict=True))
        lines = []
        for condition, name in CONDITIONS.items():
            own = numbers[(numbers["strategy"] == strategy) & (numbers["condition"] == condition)]
            if own.empty:
                continue
            by = own.set_index("threshold")
            cells = [_cell(by.loc[one], condition) if one in by.index else Cell("") for one in thresholds]
            kind = {PAIRED: "ours", CEILING: "ceiling"}.get(condition, "control")
            lines.append(Line("this run" if condition == PAIRED else name, kind, cells))
            if condition == PAIRED:
                cells = [Cell(percent(known[one]) if one in known else "") for one in thresholds]
                lines.append(Line("published", "published", cells))
        groups.append(Group(title, lines))
    return Rates(headings, groups)


def _cell(row: pd.Series, condition: str) -> Cell:
    return Cell(percent(row["eer_pct"]), interval(row) if condition == PAIRED else "")


def controls(_: Run, rates: pd.DataFrame) -> Drawing:
    """Draw the equal error rates of the fusion schemes against the number of pairs, with all controls.

    Parameters
    ----------
    rates : the table ``equal_error_rates``.
    """
    own = pooled(rates)
    figure, axes = style.figure(5.4, 2, 3, sharex=True, sharey="col")
    places = [axes[row, column] for column in range(3) for row in range(2)]
    colours = style.system_colours(CONTROLS)
    for axis, (strategy, title) in zip(places, SCHEMES.items(), strict=True):
        of_scheme = own[own["strategy"] == strategy].sort_values("dimension")
        _panel(axis, of_scheme, colours)
        axis.set_title(title)
    for axis in axes[-1]:
        axis.set_xlabel("pairs of components, M")
    for axis in axes[:, 0]:
        axis.set_ylabel("equal error rate, %")
    handles, labels = places[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return schemes(_, rates)._replace(figure=figure)


def _panel(axis: Axes, rates: pd.DataFrame, colours: dict[str, str]) -> None:
    for condition, title in CONDITIONS.items():
        own = rates[rates["condition"] == condition]
        if own.empty:
            continue
        if condition == PAIRED:
            axis.fill_between(own["dimension"], own["low"], own["high"], color=style.INK, alpha=0.12, linewidth=0)
            axis.plot(own["dimension"], own["eer_pct"], color=style.INK, marker="o", markersize=4, linewidth=2.0,
                      label=title, zorder=4)  # fmt: skip
            continue
        colour, dash = (style.FAINT, "--") if condition == CEILING else (colours[condition], "-")
        axis.plot(own["dimension"], own["eer_pct"], color=colour, linestyle=dash, marker=".", markersize=4,
                  linewidth=1.1, label=title)  # fmt: skip
    axis.set_ylim(bottom=0.0)
    axis.grid(axis="y")


TICKS_PCT = (0.1, 0.5, 1, 2, 5, 10, 20, 40)


def det(_: Run, points: pd.DataFrame) -> Drawing:
    """Draw false rejects against false accepts on normal deviate scales, with both definitions of the rates.

    Parameters
    ----------
    points : the table ``det``.
    """
    figure, axes = style.figure(4.4, 1, 2, sharex=True, sharey=True)
    names = [name for name in STRATEGIES if name in set(points["strategy"])]
    colours = style.system_colours(names)
    for axis, kind in zip(axes[0], (PRINTED, USUAL), strict=True):
        for name in names:
            own = points[(points["strategy"] == name) & (points["rates"] == kind)]
            x, y = (_deviate(own[f"false_{error}_pct"]) for error in ("accept", "reject"))
            axis.plot(x, y, color=colours[name], linewidth=1.3, label=STRATEGIES[name])
        ticks = ndtri(np.array(TICKS_PCT) / 100.0)
        axis.plot(ticks[[0, -1]], ticks[[0, -1]], color=style.GRID, linewidth=0.8, zorder=0)
        axis.set_xticks(ticks, [f"{tick:g}" for tick in TICKS_PCT])
        axis.set_yticks(ticks, [f"{tick:g}" for tick in TICKS_PCT])
        axis.set_xlim(ticks[0], ticks[-1])
        axis.set_ylim(ticks[0], ticks[-1])
        axis.set_xlabel("false accepts, %")
        axis.set_title(f"rates {kind}" if kind == PRINTED else f"{kind} rates")
        axis.grid()
        axis.set_aspect("equal")
    axes[0, 0].set_ylabel("false rejects, %")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return Drawing(points, figure)


def _deviate(percentages: pd.Series) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return normal deviates of rates, those beyond the axes at their ends."""
    found: np.ndarray[tuple[int], np.dtype[np.float64]] = ndtri(percentages.clip(0.02, 80.0).to_numpy() / 100.0)
    return found


def gains(_: Run, gains: pd.DataFrame) -> Drawing:
    """Draw the gain of fusion with canonical components over other strategies, and over its controls.

    Parameters
    ----------
    gains : the table ``gains``.
    """
    chosen = list(dict.fromkeys(gains["strategy"]))
    figure, axes = style.figure(0.7 + 0.24 * max(gains.groupby("strategy").size()), 1, len(chosen), sharex=True)
    for axis, strategy in zip(axes[0], chosen, strict=True):
        own = gains[gains["strategy"] == strategy].reset_index(drop=True)
        clear = (own["low"] > 0.0) | (own["high"] < 0.0)
        colours = np.where(own["low"] > 0.0, style.BLUE, np.where(own["high"] < 0.0, style.VERMILLION, style.FAINT))
        axis.hlines(own.index, own["low"], own["high"], colors=colours.tolist(), linewidth=1.6)
        inside = np.where(clear, colours, style.PAPER).tolist()
        axis.scatter(own["gain"], own.index, s=22, facecolors=inside, edgecolors=colours.tolist(), zorder=3)
        axis.axvline(0.0, color=style.INK, linewidth=0.8)
        axis.set_yticks(own.index, _others(own))
        axis.set_ylim(len(own) - 0.4, -0.6)
        axis.set_title(SCHEMES[strategy])
        axis.grid(axis="x")
        axis.spines["left"].set_visible(False)
        style.ticks_off(axis, "y")
    figure.supxlabel("equal error rate of the other one minus that of fusion, percentage points", fontsize=9)
    return Drawing(gains, figure)


def _others(rows: pd.DataFrame) -> list[str]:
    return [
        STRATEGIES[str(other)] if condition == PAIRED else CONDITIONS[str(condition)]
        for other, condition in zip(rows["other"], rows["condition"], strict=True)
    ]


def gain_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the gains for the page."""
    rows: list[Sequence[str]] = []
    for (_index, row), other in zip(numbers.iterrows(), _others(numbers), strict=True):
        text = [f"{row[name]:+.2f}".replace("-", "−") for name in ("gain", "low", "high")]
        kind = "strategy without CCA" if row["condition"] == PAIRED else "control"
        rows.append([SCHEMES[row["strategy"]], kind, other, text[0], f"{text[1]} to {text[2]}"])
    return Table.of(["fusion", "compared with", "", "gain, points", "interval"], rows, words=(1, 2))
