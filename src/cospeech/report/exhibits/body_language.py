"""The exhibits of Levine 2009: subunits and clusters, syllable observations, forward and direct probabilities."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table
from cospeech.report.words import number

SECTIONS = {"head": "head", "arms": "arms", "legs": "lower body"}
"""The body sections as the thesis calls them."""

INTENSITY, LENGTH = ("silence", "standard", "high"), ("short", "medium", "long")

SHOWN = "arms"
"""The section of figure 5.2."""

MODES = {"expected": "expectation, from eq. 5.2", "printed": "expectation, eq. 5.3 as printed"}


def subunits(_: Run, library: pd.DataFrame) -> Drawing:
    """Return the number of subunits and clusters of each body section (table 2.1).

    Parameters
    ----------
    library : the table ``subunit_library``.
    """
    counts = library.groupby("section", sort=False)["cluster"].agg(segments="size", clusters="nunique").reset_index()
    counts["segments_per_cluster"] = counts["segments"] / counts["clusters"]
    return Drawing(counts)


def subunit_table(_: Run, counts: pd.DataFrame) -> Table:
    """Return the numbers of subunits for the page."""
    rows = [
        [SECTIONS[row["section"]], row["segments"], row["clusters"], f"{row['segments_per_cluster']:.1f}"]
        for _, row in counts.iterrows()
    ]
    return Table.of(["body section", "segments", "clusters", "segments per cluster"], rows)


def compare_subunits(_: Run, counts: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of clusters of the lower body next to ours."""
    ours = int(counts.loc[counts["section"] == "legs", "clusters"].sum())
    return [Pair("clusters of the lower body", f"{facts['lower_body_clusters']} (training set II)", str(ours))]


def occurrences(_: Run, occurrences: pd.DataFrame) -> Drawing:
    """Return how often the observations that are possible occur (table 3.1).

    Parameters
    ----------
    occurrences : the table ``observation_occurrences``.
    """
    possible = occurrences[occurrences["can_occur"]].drop(columns="can_occur")
    return Drawing(possible.assign(share_pct=100.0 * possible["count"] / max(1, possible["count"].sum())))


def occurrence_table(_: Run, found: pd.DataFrame) -> Table:
    """Return the observations for the page, the most frequent one first."""
    rows = [
        [
            INTENSITY[int(row["intensity"])],
            LENGTH[int(row["length"])],
            "yes" if row["up"] else "no",
            "yes" if row["down"] else "no",
            int(row["count"]),
            f"{row['share_pct']:.1f}",
        ]
        for _, row in found.sort_values("count", ascending=False, kind="stable").iterrows()
    ]
    return Table.of(["intensity", "length", "inflection up", "inflection down", "count", "%"], rows, words=(1, 2, 3))


def compare_occurrences(_: Run, found: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of observation states next to those that are possible and that occur."""
    occurring = int((found["count"] > 0).sum())
    return [
        Pair(
            "observation states",
            f"about {facts['occurring']} of {facts['combinations']}",
            f"{len(found)} of {facts['combinations']} are possible, {occurring} occur",
        )
    ]


def selected(selections: pd.DataFrame) -> pd.DataFrame:
    """Return the state that each rule selects after each observation, and its forward probability.

    Parameters
    ----------
    selections : the table ``subunit_selections``.
    """
    best = selections.groupby(["section", "step"], sort=False)["forward"].max().rename("largest").reset_index()
    parts = []
    for rule in ("direct", "product"):
        chosen = selections[selections[f"by_{rule}"]]
        parts.append(chosen[["section", "step", "time_s", "cluster", "start", "forward"]].assign(rule=rule))
    return pd.concat(parts, ignore_index=True).merge(best, on=["section", "step"])


def selections(_: Run, selections: pd.DataFrame) -> Drawing:
    """Draw the forward probabilities of the arms and the states that are selected (figure 5.2).

    Parameters
    ----------
    selections : the table ``subunit_selections``.
    """
    chosen = selected(selections)
    own = selections[selections["section"] == SHOWN]
    image = own.pivot_table(index=["start", "cluster"], columns="step", values="forward").sort_index(ascending=False)
    rows = {state: row for row, state in enumerate(image.index)}
    colours = {"direct": style.VERMILLION, "product": style.GREEN}
    titles = {"direct": "largest direct probability", "product": "largest product"}
    figure = Figure(figsize=(style.WIDTH_IN, 4.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.4))
    above.imshow(image.to_numpy(), aspect="auto", cmap="Greys", vmin=0.0, vmax=1.0, interpolation="nearest")
    for rule, colour in colours.items():
        part = chosen[(chosen["section"] == SHOWN) & (chosen["rule"] == rule)]
        places = [rows[state] for state in zip(part["start"], part["cluster"], strict=True)]
        marker = "s" if rule == "direct" else "o"
        above.scatter(part["step"], places, s=14, marker=marker, facecolors="none", edgecolors=colour, linewidths=1.1)
        below.plot(part["step"], part["forward"], color=colour, label=titles[rule])
    largest = own.groupby("step")["forward"].max()
    below.plot(largest.index, largest, color=style.FAINT, linestyle=(0, (1, 2)), label="largest of all")
    above.set_yticks([])
    above.set_ylabel("states")
    above.set_title("forward probability (darker: higher) and selected states")
    below.set_ylim(0.0, 1.0)
    below.set_ylabel("forward probability")
    below.set_xlabel("observation")
    below.legend(loc="upper center", ncols=3, bbox_to_anchor=(0.5, -0.35))
    return Drawing(chosen, figure)


def continuations(_: Run, clusters: pd.DataFrame) -> Drawing:
    """Draw the probability that a subunit continues, by the elapsed share, under both fits.

    Parameters
    ----------
    clusters : the table ``subunit_clusters``.
    """
    elapsed = np.linspace(0.0, 1.0, 101)
    figure = Figure(figsize=(style.WIDTH_IN, 2.8), layout="constrained")
    axes = figure.subplots(1, len(SECTIONS), sharey=True)
    fits = (
        ("", style.BLUE, "regression over all syllables"),
        ("printed_", style.VERMILLION, "fit to final syllables"),
    )
    for axis, (section, title) in zip(axes, SECTIONS.items(), strict=True):
        own = clusters[clusters["section"] == section]
        for prefix, colour, label in fits:
            logits = own[[f"{prefix}intercept", f"{prefix}slope"]].dropna().to_numpy(dtype=float)
            curves = 0.5 + 0.5 * np.tanh(0.5 * (logits[:, :1] + logits[:, 1:] * elapsed))
            for curve in curves:
                axis.plot(elapsed, curve, color=colour, linewidth=0.7, alpha=0.7, label=label)
                label = "_"
        axis.set_title(title)
        axis.set_xlabel("elapsed share")
    axes[0].set_ylabel("probability of going on")
    axes[0].legend(loc="lower left")
    return Drawing(
        clusters[["section", "cluster", "intercept", "slope", "printed_intercept", "printed_slope"]], figure
    )


def elapsed(_: Run, errors: pd.DataFrame) -> Drawing:
    """Return how far forward probabilities with an expected elapsed share are from the exact ones.

    Parameters
    ----------
    errors : the table ``elapsed_errors``.
    """
    return Drawing(errors)


def elapsed_table(_: Run, errors: pd.DataFrame) -> Table:
    """Return these errors for the page."""
    rows = [
        [
            SECTIONS[row["section"]],
            MODES[row["mode"]],
            number(row["variation_mean"]),
            number(row["variation_max"]),
            number(row["share_error"]),
        ]
        for _, row in errors.iterrows()
    ]
    headings = ["body section", "elapsed share", "mean difference", "largest difference", "error of the share"]
    return Table.of(headings, rows, words=(1,))
