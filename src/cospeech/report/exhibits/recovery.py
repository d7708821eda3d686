"""How much of the studio's plan was recovered: gesture phrases, and prosody patterns over the sweep."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.words import number

QUANTITIES = {
    "gesture_frames_right": "share of frames whose planted gesture phrase was recovered from the joint angles",
    "gesture_kappa": "agreement of these frames beyond chance (Cohen's kappa)",
    "gesture_phrase_ratio": "number of gesture phrases found divided by that of planted ones",
    "prosody_ami": "adjusted mutual information of prosody clusters and planted patterns",
    "pitch_error": "median relative error of the measured pitch lag, voiced frames",
    "pitch_gross_errors": "share of voiced frames whose pitch lag is off by more than 20 %",
    "voicing_errors": "share of frames whose pitch gain tells their voicing wrong",
    "track_gross_errors": "share of voiced frames whose pitch track (Praat) is off by more than 20 %",
    "track_voicing_errors": "share of frames whose voicing is wrong in the pitch track (Praat)",
    "syllable_delay": "delay from the peak of a voiced syllable until it is known, in seconds (median)",
    "syllable_delay_p90": "delay from the peak of a voiced syllable until it is known, in seconds (90th percentile)",
    "transitions_p": "p-value of the planted transitions as a sample of the planted process",
    "durations_p": "p-value of the planted durations as a sample of the planted process",
}


def draw(run: Run, recovery: pd.DataFrame) -> Drawing:
    """Draw how much of the plan was recovered.

    Parameters
    ----------
    recovery : the table ``recovery``.
    """
    return Drawing(summary(recovery, **run.main), figure(recovery))


def summary_table(_: Run, table: pd.DataFrame) -> Table:
    """Return the summary for the page."""
    rows = [
        [
            row["meaning"],
            row["on"],
            number(row["mean"]),
            f"{number(row['lowest'])} to {number(row['highest'])}",
            row["values"],
        ]
        for _index, row in table.iterrows()
    ]
    return Table.of(["quantity", "on", "mean", "range", "values"], rows, (1,))


def summary(recovery: pd.DataFrame, clusters: int, states: int) -> pd.DataFrame:
    """Return each quantity over records: mean, lowest, highest; prosody clusters at the main setting.

    Parameters
    ----------
    recovery : the table ``recovery``.
    clusters, states : the main setting of the prosody clusters.
    """
    main = recovery[
        recovery["clusters"].isna() | ((recovery["clusters"] == clusters) & (recovery["states"] == states))
    ]
    rows = []
    for quantity, meaning in QUANTITIES.items():
        of_quantity = main[main["quantity"] == quantity]
        for part, own in of_quantity.groupby("part", dropna=False, sort=False):
            where = {"held_out": "held-out record", "training": "training records"}.get(str(part), "")
            rows.append(
                {"quantity": quantity, "meaning": meaning, "on": where, "mean": own["value"].mean()}
                | {"lowest": own["value"].min(), "highest": own["value"].max(), "values": len(own)}
            )
    return pd.DataFrame(rows)


def figure(recovery: pd.DataFrame) -> Figure:
    """Draw the gesture frames found in each record, and the mutual information of prosody over the sweep.

    Parameters
    ----------
    recovery : the table ``recovery``.
    """
    height_in = max(3.1, 1.0 + 0.2 * recovery["actor"].nunique())
    drawn, axes = style.figure(height_in, 1, 2, gridspec_kw={"width_ratios": [1, 1.5]})
    _gestures(axes[0, 0], recovery[recovery["quantity"] == "gesture_frames_right"])
    _prosody(axes[0, 1], recovery[(recovery["quantity"] == "prosody_ami") & (recovery["part"] == "held_out")])
    return drawn


def _gestures(axes: Axes, own: pd.DataFrame) -> None:
    actors = list(dict.fromkeys(own["actor"]))
    for place, actor in enumerate(actors):
        values = 100 * own.loc[own["actor"] == actor, "value"]
        axes.plot(values, [place] * len(values), ls="none", marker="o", ms=7, color=style.BLUE, alpha=0.65, mew=0)
    axes.axvline(90, color=style.FAINT, ls=(0, (4, 3)), lw=1)
    axes.annotate("goal", (90, 1), xycoords=("data", "axes fraction"), xytext=(3, -2), textcoords="offset points",
                  va="top", color=style.FAINT, fontsize=8)  # fmt: skip
    axes.set_yticks(range(len(actors)), actors)
    axes.set_ylim(len(actors) - 0.4, -0.6)
    axes.set_xlim(min(85.0, 100 * float(own["value"].min()) - 2), 100.5)
    axes.set_title("gesture phrases found, each dot a record")
    axes.set_xlabel("frames that agree with what was planted (%)")
    axes.grid(axis="x")
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _prosody(axes: Axes, own: pd.DataFrame) -> None:
    means = own.groupby(["states", "clusters"])["value"].agg(["mean", "min", "max"]).reset_index()
    counts = sorted(means["states"].astype(int).unique().tolist())
    colours = style.system_colours(map(str, counts))
    for states in counts:
        line = means[means["states"] == states]
        colour = colours.get(str(states), style.FAINT)
        axes.plot(
            line["clusters"].astype(int), line["mean"], marker="o", ms=4, color=colour, label=f"{states} states"
        )
        if states == counts[0]:
            axes.fill_between(line["clusters"].astype(int), line["min"], line["max"], color=colour, alpha=0.14, lw=0)
    axes.axhline(0.5, color=style.FAINT, ls=(0, (4, 3)), lw=1)
    axes.set_xticks(sorted(means["clusters"].astype(int).unique()))
    axes.set_ylim(0, 1)
    axes.set_title("prosody patterns found, on held-out records")
    axes.set(xlabel="prosody clusters", ylabel="adjusted mutual information")
    axes.legend(ncols=len(counts), loc="upper right")
    axes.grid(axis="y")
