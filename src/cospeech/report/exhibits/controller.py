"""The exhibits of Levine et al. 2010: figures 4 and 6, table 1, and what the control layer costs and leaves open."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table

MODELS = {"crf": ("conditional random field", style.BLUE), "hmm": ("remapped HMM", style.VERMILLION)}

SCORES = {
    "chain": "state sequence (chain score)",
    "filtered": "state, speech so far (filtered score)",
}
"""The scores that figure 4 shows."""

PLANS = {
    "states": ("policy over hidden states, as in the paper", style.BLUE),
    "situations": ("policy over situations, without delay", style.GREEN),
}
"""What the policy of the online controller plans with."""

QUANTITIES = {
    "segments": "motion segments",
    "hidden_states": "hidden states, chosen by held-out likelihood",
    "iterations": "iterations of policy iteration",
    "undominated_share": "share of the value table that pruning would keep",
    "printed_discount_error": "mean error of the values by the printed discounts",
    "style_combination_error": "mean shortfall of values that are combined linearly for half a style",
}

SHARES = ("undominated_share", "printed_discount_error", "style_combination_error")

LIBRARIES = {
    "standard": ("standard", "Standard library"),
    "seated": ("seated", "Sitting on stool"),
    "phone": ("holding a phone", "Holding phone"),
    "mug": ("with a mug", "Sitting with mug"),
    "fork": ("with a fork", "Holding pitchfork"),
    "creature": ("creature with eight limbs", "Octopus"),
}
"""The motion libraries of the studio: their titles, and the rows of table 1 that they stand for."""

TURN_DEG = 25.0
"""Angle by which figure 6 turns the bodies about the vertical axis."""


def windows(_: Run, windows: pd.DataFrame) -> Drawing:
    """Draw the scores of both models over the input window (figure 4).

    Parameters
    ----------
    windows : the tables ``controller_windows`` of all records.
    """
    means = windows.groupby(["model", "window"], sort=False)[["chain", "filtered", "kinematics"]].mean().reset_index()
    means["step_ms"], means["n"] = windows["step_ms"].mean(), len(windows) // max(len(means), 1)
    drawn, axes = style.figure(2.9, 1, len(SCORES))
    for panel, (score, title) in zip(axes[0], SCORES.items(), strict=True):
        for model, (name, colour) in MODELS.items():
            own = means[means["model"] == model]
            panel.plot(own["window"], own[score], marker="o", ms=4, color=colour, label=name)
        panel.set_title(title)
        panel.set_xticks(sorted(means["window"].unique()))
        panel.set_xlabel(f"input window in steps of {windows['step_ms'].mean():.0f} ms")
        panel.grid(axis="y")
    axes[0, 0].set_ylabel("log-likelihood per step, nats")
    axes[0, 1].legend(loc="best")
    return Drawing(means, drawn)


def compare_windows(_: Run, means: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published best window next to ours, by both scores."""
    crf = means[means["model"] == "crf"]
    best = {score: int(crf["window"].iloc[int(np.argmax(crf[score]))]) for score in SCORES}
    gap = (
        crf.set_index("window")["filtered"] - means[means["model"] == "hmm"].set_index("window")["filtered"]
    ).dropna()
    ours = ", ".join(f"{window} ({score} score)" for score, window in best.items())
    return [
        Pair("best window of the conditional random field, steps", str(facts["best_window"]), ours),
        Pair(
            "windows at which it is better than the HMM",
            "all",
            f"{int((gap > 0).sum())} of {len(gap)} (filtered score)",
        ),
    ]


def regret(_: Run, regret: pd.DataFrame) -> Drawing:
    """Draw the regret of the online controller over the delay of its output.

    Parameters
    ----------
    regret : the tables ``controller_regret`` of all records.
    """
    pooled = regret.groupby(["plan", "delay_ms"])[["cost", "optimum"]].mean().reset_index()
    pooled["regret"] = pooled["cost"] / pooled["optimum"] - 1.0
    drawn, axes = style.figure(2.6)
    panel = axes[0, 0]
    for plan, (title, colour) in PLANS.items():
        own = pooled[pooled["plan"] == plan]
        panel.plot(own["delay_ms"], 100 * own["regret"], marker="o", ms=5, color=colour, label=title)
    panel.set_xlabel("delay of the output in ms")
    panel.set_ylabel("cost above the optimum, %")
    panel.set_ylim(bottom=0)
    panel.grid(axis="y")
    panel.legend(loc="best")
    return Drawing(pooled, drawn)


def control_layer(_: Run, facts: pd.DataFrame) -> Drawing:
    """Return what is known about the control layer of the first record's fold."""
    return Drawing(facts)


def control_table(_: Run, facts: pd.DataFrame) -> Table:
    """Return it for the page."""
    values = facts.set_index("quantity")["value"]
    rows = []
    for name, title in QUANTITIES.items():
        value = values[name]
        shown = f"{100 * value:.1f} %" if name in SHARES else f"{value:.0f}"
        rows.append([title, "" if pd.isna(value) else shown])
    return Table.of(["control layer", "value"], rows)


def compare_control(_: Run, facts: pd.DataFrame, published: Facts) -> list[Pair]:
    """Return the published numbers of states and of table entries that are kept next to ours."""
    values = facts.set_index("quantity")["value"]
    return [
        Pair("hidden states", str(published["states"]), f"{values['hidden_states']:.0f}"),
        Pair(
            "entries of the value table that pruning removes",
            f"about {published['pruned_pct']} %",
            f"{100 * (1 - values['undominated_share']):.1f} %",
        ),
    ]


def libraries(_: Run, libraries: pd.DataFrame) -> Drawing:
    """Return how long the training of each library's control layer takes (table 1)."""
    return Drawing(libraries.sort_values("library", key=_places, kind="stable", ignore_index=True))


def _places(names: pd.Series) -> pd.Series:
    """Return the row of table 1 that each library stands for; others come last."""
    known = {name: place for place, name in enumerate(LIBRARIES)}
    return names.map(lambda name: known.get(name, len(known)))


def library_table(run: Run, libraries: pd.DataFrame) -> Table:
    """Return it for the page, next to the published times."""
    published = run.published["controller-table-1"]
    known = {name: place for place, name in enumerate(LIBRARIES)}
    rows = []
    for _, row in libraries.iterrows():
        place = known.get(row["library"])
        rows.append(
            [
                _title(row["library"]),
                f"{row['library_s']:.0f} s",
                row["segments"],
                row["hands"],
                f"{row['training_s']:.2f} s",
                "" if place is None else f"{published['training_s'][place]} s ({LIBRARIES[row['library']][1]})",
            ]
        )
    return Table.of(["motion library", "length", "segments", "hands", "training time", "published"], rows)


def compare_libraries(_: Run, libraries: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published training times next to ours."""
    ours = libraries.set_index("library")["training_s"]
    return [
        Pair(f"training time, {title}", f"{seconds} s (Core i7, 2.66 GHz)", f"{ours[name]:.2f} s")
        for (name, (_, title)), seconds in zip(LIBRARIES.items(), facts["training_s"], strict=True)
        if name in ours.index
    ]


def strips(_: Run, strips: pd.DataFrame) -> Drawing:
    """Draw frames of controllers with different libraries under the same speech (figure 6)."""
    names = list(dict.fromkeys(strips.sort_values("library", key=_places, kind="stable")["library"]))
    pictures = sorted(strips["picture"].unique())
    drawn, axes = style.figure(1.35 * len(names), len(names), len(pictures))
    for row, name in enumerate(names):
        own = strips[strips["library"] == name]
        places = _turned(own)
        span = 1.05 * places.abs().to_numpy().max()
        for column, picture in enumerate(pictures):
            axis = axes[row, column]
            _figure(axis, own[own["picture"] == picture], places)
            axis.set_xlim(-span, span)
            axis.set_ylim(-span, span)
            axis.set_aspect("equal")
            axis.axis("off")
            if row == len(names) - 1:
                time_s = own.loc[own["picture"] == picture, "time_s"].iloc[0]
                axis.text(0.5, -0.05, f"{time_s:.1f} s", transform=axis.transAxes, ha="center", va="top")
        axes[row, 0].set_title(_title(name), loc="left", fontsize="small")
    counts = strips.groupby("library", sort=False)["joint"].nunique().rename("joints").reset_index()
    return Drawing(counts, drawn)


def _title(library: str) -> str:
    return LIBRARIES[library][0] if library in LIBRARIES else library


def _turned(poses: pd.DataFrame) -> pd.DataFrame:
    """Return the horizontal and vertical positions of the joints in the picture."""
    cosine, sine = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    return pd.DataFrame({"x": cosine * poses["x_m"] + sine * poses["z_m"], "y": poses["y_m"]})


def _figure(axis: Axes, poses: pd.DataFrame, places: pd.DataFrame) -> None:
    """Draw the bones of one pose."""
    at = dict(zip(poses["joint"], places.loc[poses.index].to_numpy(), strict=True))
    for joint, parent in zip(poses["joint"], poses["parent"], strict=True):
        if pd.notna(parent):
            bone = np.array([at[parent], at[joint]])
            axis.plot(bone[:, 0], bone[:, 1], color=style.INK, lw=1.6, solid_capstyle="round")
