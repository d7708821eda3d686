"""Gesture phrases in figures: duration histograms (figs. 7.3 and 7.4) and frequencies (fig. 7.5)."""

from __future__ import annotations

import textwrap

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from cospeech.report import style, words
from cospeech.report.exhibits.run import Drawing, Run

ROW_TITLE = 20
"""Letters of a title that fit next to one row of histograms."""

PANELS_PER_ROW = 4
"""Panels next to one another; further ones are below."""

Sequences = dict[str, pd.DataFrame]
"""Gesture segments of some records, by system."""


def durations_of_first_actor(
    run: Run,
    actual: pd.DataFrame,
    synthesised: Sequences,
    labels: list[str],
    bins_s: list[float],
    max_duration_s: float,
) -> Drawing:
    """Draw the duration histograms of the first actor's phrases (see ``durations``)."""
    return _durations_of_actor(run, 0, actual, synthesised, labels, bins_s, max_duration_s)


def durations_of_second_actor(
    run: Run,
    actual: pd.DataFrame,
    synthesised: Sequences,
    labels: list[str],
    bins_s: list[float],
    max_duration_s: float,
) -> Drawing:
    """Draw the duration histograms of the second actor's phrases (see ``durations``)."""
    return _durations_of_actor(run, 1, actual, synthesised, labels, bins_s, max_duration_s)


def _durations_of_actor(
    run: Run,
    place: int,
    actual: pd.DataFrame,
    synthesised: Sequences,
    labels: list[str],
    bins_s: list[float],
    max_duration_s: float,
) -> Drawing:
    actor = list(dict.fromkeys(run.actors.values()))[place]
    bin_s = sorted(bins_s)[len(bins_s) // 2]
    own = {name: _of_actor(table, actor, run.actors) for name, table in synthesised.items()}
    table = durations(_of_actor(actual, actor, run.actors), own, labels, bin_s, max_duration_s)
    return Drawing(table, duration_figure(table, run.titles))


def _of_actor(table: pd.DataFrame, actor: str, actors: dict[str, str]) -> pd.DataFrame:
    return table[table["record"].map(actors) == actor]


def durations(
    actual: pd.DataFrame, synthesised: dict[str, pd.DataFrame], labels: list[str], bin_s: float, max_duration_s: float
) -> pd.DataFrame:
    """Return the duration histograms behind figs. 7.3 and 7.4.

    Parameters
    ----------
    actual : the gesture segments of an actor's records.
    synthesised : the same of each system.
    labels : the gesture classes.
    bin_s, max_duration_s : bins as for S: bin k holds durations in ((k - 1) * bin_s, k * bin_s], the last one all
        that are longer too.

    Returns
    -------
    Columns sequence (actual or the system), gesture, bin, low_s, high_s, phrases, probability.
    """
    n_bins = max(1, int(np.ceil(max_duration_s / bin_s - 1e-6)))
    low = np.arange(n_bins) * bin_s
    rows = []
    for name, table in {"actual": actual, **synthesised}.items():
        bins = np.ceil((table["end_s"] - table["start_s"]).to_numpy() / bin_s - 1e-6).astype(int) - 1
        bins = np.clip(bins, 0, n_bins - 1)
        for label in labels:
            counts = np.bincount(bins[(table["label"] == label).to_numpy()], minlength=n_bins)
            rows.append(
                pd.DataFrame(
                    {"sequence": name, "gesture": label, "bin": np.arange(1, n_bins + 1), "low_s": low}
                    | {"high_s": low + bin_s, "phrases": counts, "probability": counts / max(1, counts.sum())}
                )
            )
    return pd.concat(rows, ignore_index=True)


def duration_figure(table: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw duration histograms, synthesised above the line and actual below it; one row per system.

    Parameters
    ----------
    table : see ``durations``.
    titles : title of each system.
    """
    labels = list(dict.fromkeys(table["gesture"]))
    systems = [name for name in dict.fromkeys(table["sequence"]) if name != "actual"]
    colours = style.gesture_colours(labels)
    used = table.loc[table["phrases"] > 0, "high_s"]
    reach = min(float(table["high_s"].max()), float(np.ceil(used.max()))) if len(used) else 1.0
    drawn, axes = style.figure(1.0 + 1.75 * len(systems), len(systems), len(labels), sharex=True, sharey=True)
    for row, system in enumerate(systems):
        for column, label in enumerate(labels):
            _mirror(axes[row, column], table, system, label, colours[label])
        title = textwrap.fill(titles.get(system, system), ROW_TITLE)
        axes[row, 0].set_ylabel(f"{title}\nprobability", fontsize=8)
    top = float(table["probability"].max()) * 1.3 or 1.0
    for column, label in enumerate(labels):
        axes[0, column].set_title(words.gesture(label))
        axes[0, column].set(xlim=(0, reach), ylim=(-top, top))
        axes[-1, column].set_xlabel("s")
    axes[0, 0].yaxis.set_major_locator(MaxNLocator(4))
    axes[0, 0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    return drawn


def _mirror(axes: Axes, table: pd.DataFrame, system: str, label: str, colour: str) -> None:
    of_label = table[table["gesture"] == label]
    for sequence, sign, shade in ((system, 1, 1.0), ("actual", -1, 0.45)):
        own = of_label[of_label["sequence"] == sequence]
        edges = np.append(own["low_s"], own["high_s"].iloc[-1])
        axes.stairs(sign * own["probability"], edges, fill=True, color=colour, alpha=shade, lw=0)
        count = int(own["phrases"].sum())
        name = "synthesised" if sign > 0 else "actual"
        axes.annotate(
            f"{name}: {count}",
            (0.97, 0.96 if sign > 0 else 0.04),
            xycoords="axes fraction",
            ha="right",
            va="top" if sign > 0 else "bottom",
            fontsize=7,
            color=style.FAINT,
        )
    axes.axhline(0, color=style.INK, lw=0.8)
    axes.grid(axis="y")


def frequencies(run: Run, actual: pd.DataFrame, synthesised: Sequences, labels: list[str]) -> Drawing:
    """Draw how often each gesture occurs, actual and synthesised (see ``shares``)."""
    table = shares({"actual": actual} | synthesised, run.actors, labels)
    return Drawing(table, frequency_figure(table, run.titles))


def shares(sequences: dict[str, pd.DataFrame], actors: dict[str, str], labels: list[str]) -> pd.DataFrame:
    """Return how often each gesture occurs, by actor and sequence: the numbers of fig. 7.5.

    Parameters
    ----------
    sequences : the gesture segments of all records, of ``actual`` and of each system.

    Returns
    -------
    Columns actor, sequence, gesture, phrases, share (of the actor's phrases in that sequence).
    """
    rows = []
    for actor in dict.fromkeys(actors.values()):
        for name, table in sequences.items():
            own = table.loc[table["record"].map(actors) == actor, "label"]
            for label in labels:
                count = int((own == label).sum())
                rows.append(
                    {"actor": actor, "sequence": name, "gesture": label, "phrases": count}
                    | {"share": count / max(1, len(own))}
                )
    return pd.DataFrame(rows)


def frequency_figure(table: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw how often each gesture occurs: a panel per actor, with the actual share next to that of each system."""
    actors, labels = list(dict.fromkeys(table["actor"])), list(dict.fromkeys(table["gesture"]))
    sequences = list(dict.fromkeys(table["sequence"]))
    systems = [name for name in sequences if name != "actual"]
    colours = {"actual": style.FAINT, **style.system_colours(systems)}
    columns = min(len(actors), PANELS_PER_ROW)
    rows = -(-len(actors) // columns)
    drawn, axes = style.figure(1.0 + 1.9 * rows, rows, columns, sharey=True)
    width = 0.8 / len(sequences)
    for panel in axes.ravel()[len(actors) :]:
        panel.set_axis_off()
    for panel, actor in zip(axes.ravel(), actors, strict=False):
        for place, name in enumerate(sequences):
            own = table[(table["actor"] == actor) & (table["sequence"] == name)]
            panel.bar(np.arange(len(labels)) - 0.4 + place * width, 100 * own["share"], width * 0.92,
                      align="edge", color=colours[name])  # fmt: skip
        panel.set_title(f"actor {actor}")
        names = [words.gesture(label) for label in labels]
        panel.set_xticks(range(len(labels)), names, rotation=90 if columns > 2 else 35, fontsize=7.5,
                         ha="center" if columns > 2 else "right")  # fmt: skip
        panel.tick_params(axis="x", length=0)
        panel.grid(axis="y")
    for row in range(rows):
        axes[row, 0].set_ylabel("share of phrases (%)")
    handles = [Patch(color=colours[name], label=titles.get(name, name)) for name in sequences]
    drawn.legend(handles=handles, loc="outside upper center", ncols=min(len(sequences), 4))
    return drawn
