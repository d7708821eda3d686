"""Patterns of the head and of the melody that the first system found in the training records of the first fold."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table
from cospeech.report.words import number

ANGLES = {"x_deg": ("nod", style.BLUE), "y_deg": ("turn", style.VERMILLION), "z_deg": ("tilt", style.GREEN)}

KINDS = {
    ("x_deg", 1): "nod",
    ("x_deg", -1): "head up",
    ("y_deg", 1): "turn left",
    ("y_deg", -1): "turn right",
    ("z_deg", 1): "tilt right",
    ("z_deg", -1): "tilt left",
}
"""What a pattern is called by its largest angle and the sign of it."""

STILL_DEG = 4.0
"""Largest angle of a pattern in which the head rests."""

GREATEST_STAY = 0.999
"""Bound of the probability of staying in a state, so that its expected duration is finite."""


def gestures(_: Run, patterns: pd.DataFrame) -> Drawing:
    """Draw the mean angles of each pattern of the head with their standard deviations (figure 4.7).

    Parameters
    ----------
    patterns : parallel HMM of the head (schema ``hmm_model``).
    """
    angles = patterns[patterns["feature"].isin(list(ANGLES))]
    numbers = _trajectories(angles)
    numbers["kind"] = numbers["pattern"].map(_kinds(angles))
    titles = {name: f"{name}: {kind}" for name, kind in _kinds(angles).items()}
    drawn = _draw(numbers, ANGLES, titles, "degrees")
    return Drawing(numbers, drawn)


def gesture_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the largest mean angles of each pattern for the page."""
    rows = []
    for name, own in numbers.groupby("pattern", sort=False):
        means = {axis: own.loc[own["feature"] == axis, "mean"].to_numpy(dtype=float) for axis in ANGLES}
        peaks = [number(float(values[np.abs(values).argmax()]), signed=True) for values in means.values()]
        frames = float(own.loc[own["feature"] == "x_deg", "frames"].sum())
        rows.append([f"{name}: {own['kind'].iloc[0]}", *peaks, f"{frames:.0f}"])
    return Table.of(["pattern", "nod", "turn", "tilt", "expected duration, frames"], rows)


def compare_gestures(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of patterns of the head next to ours."""
    kinds = ", ".join(dict.fromkeys(numbers["kind"]))
    return [
        Pair("patterns of the head", str(facts["best"]), str(numbers["pattern"].nunique())),
        Pair("what they are", "turn left, turn right, tilt left, tilt right, nod", kinds),
    ]


def melodies(_: Run, patterns: pd.DataFrame) -> Drawing:
    """Draw the mean pitch of each pattern of the melody with its standard deviation (figure 4.9).

    Parameters
    ----------
    patterns : parallel HMM of the melody (schema ``hmm_model``).
    """
    numbers = _trajectories(patterns[patterns["feature"] == "pitch"])
    titles = {name: name for name in numbers["pattern"].unique()}
    return Drawing(numbers, _draw(numbers, {"pitch": ("pitch", style.BLUE)}, titles, "normalised pitch"))


def compare_melodies(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of patterns of the melody next to ours."""
    return [Pair("patterns of the melody", str(facts["best"]), str(numbers["pattern"].nunique()))]


def _trajectories(patterns: pd.DataFrame) -> pd.DataFrame:
    """Return the mean and standard deviation of each feature in each state, and how long the state lasts."""
    return pd.DataFrame(
        {
            "pattern": patterns["branch"],
            "state": patterns["state"],
            "feature": patterns["feature"],
            "mean": patterns["mean"],
            "deviation": np.sqrt(patterns["variance"]),
            "frames": 1.0 / (1.0 - patterns["stay_probability"].clip(upper=GREATEST_STAY)),
        }
    ).reset_index(drop=True)


def _kinds(angles: pd.DataFrame) -> dict[str, str]:
    """Return what each pattern of the head is, by its largest mean angle."""
    found = {}
    for name, own in angles.groupby("branch", sort=False):
        place = int(own["mean"].abs().to_numpy().argmax())
        mean, axis = float(own["mean"].iloc[place]), str(own["feature"].iloc[place])
        found[str(name)] = "rest" if abs(mean) < STILL_DEG else KINDS[axis, 1 if mean > 0 else -1]
    return found


def _draw(numbers: pd.DataFrame, features: dict[str, tuple[str, str]], titles: dict[str, str], unit: str) -> Figure:
    """Draw a panel for each pattern: its features over the expected time, with bands of one standard deviation."""
    drawn, axes = style.figure(2.4, 1, len(titles), sharey=True)
    for panel, (pattern, title) in zip(axes[0], titles.items(), strict=True):
        own = numbers[numbers["pattern"] == pattern]
        for feature, (label, colour) in features.items():
            states = own[own["feature"] == feature].sort_values("state")
            edges = np.append(0.0, np.cumsum(states["frames"]))
            middle = (edges[1:] + edges[:-1]) / 2
            means, deviations = (states[name].to_numpy(dtype=float) for name in ("mean", "deviation"))
            panel.plot(middle, means, color=colour, marker="o", ms=3, label=label)
            panel.fill_between(middle, means - deviations, means + deviations, color=colour, alpha=0.15, lw=0)
        panel.axhline(0.0, color=style.FAINT, lw=0.7)
        panel.set_title(title, fontsize=8.5)
        panel.set_xlabel("frames")
    axes[0, 0].set_ylabel(unit)
    if len(features) > 1:
        axes[0, 0].legend(loc="best", fontsize=7.5)
    return drawn
