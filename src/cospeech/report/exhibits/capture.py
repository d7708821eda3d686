"""Errors of capture against what was planted, next to their goals; which joint angles the markers determine."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.words import number


class Quantity(NamedTuple):
    """A measured quantity as the report calls it, and the most that it should be at full and at half size."""

    group: str
    meaning: str
    unit: str
    goal_full: float | None = None
    goal_half: float | None = None


QUANTITIES = {
    "focal_error_pct": Quantity("cameras", "mean error of the focal lengths", "%", 0.2, 0.2),
    "reprojection_px": Quantity("cameras", "reprojection error of the laser's spots", "px"),
    "spots_mm": Quantity("cameras", "position error of the spots, after alignment of the world frame", "mm"),
    "world_shift_mm": Quantity("cameras", "offset of the world frame, which the touched points define", "mm"),
    "world_turn_deg": Quantity("cameras", "rotation of the world frame", "deg"),
    "pixels_px": Quantity("markers", "error of seen markers in the pictures", "px", 0.2),
    "seen_mm": Quantity("markers", "position error of seen markers", "mm", 0.5, 1.0),
    "predicted_mm": Quantity("markers", "position error of predicted markers", "mm"),
    "visible_unseen_pct": Quantity(
        "markers", "markers that were missed although two views show at least a third of them", "%", 0.3, 0.3
    ),
    "visible_lost_pct": Quantity("markers", "markers among these that were lost", "%"),
    "swaps": Quantity("markers", "markers mistaken for another, or more than 30 mm off", "", 0.0, 0.0),
    "thorax_deg": Quantity("angles", "orientation of the thorax", "deg", 0.2, 0.2),
    "head_deg": Quantity("angles", "orientation of the head", "deg", 0.2, 0.2),
    "upper_arm_deg": Quantity("angles", "direction of the upper arm", "deg", 0.3, 0.3),
    "elbow_hand_deg": Quantity("angles", "direction from the elbow to the hand's marker", "deg", 0.3, 0.3),
    "axial_deg": Quantity(
        "angles", "axial rotation of the upper arm, elbow bent by more than 30 degrees", "deg", 1.5, 1.5
    ),
}

FILM_EFFECT_PCT = 5.0
"""The most that filming should change a score of the experiment."""

SIDES = ("left_", "right_")

VERDICTS = {"True": "met", "False": "missed"}


def accuracy(run: Run, scores: pd.DataFrame, width_px: int, method: str) -> Drawing:
    """Return the errors of capture next to their goals.

    Parameters
    ----------
    scores : the table ``capture_scores``.
    width_px : of the pictures; full-size goals apply from the width of the published ones.
    method : the tracking method in use.
    """
    return Drawing(summary(scores, width_px >= run.published["cameras"]["width_px"], method))


def film_effect(run: Run, effect: pd.DataFrame, bins_s: list[float]) -> Drawing:
    """Return what filming changes in the experiment.

    Parameters
    ----------
    effect : the table ``film_effect``.
    bins_s : bin widths of S; the widest one is used.
    """
    return Drawing(experiment(effect, max(bins_s), run.titles))


def summary(scores: pd.DataFrame, full_size: bool, main: str) -> pd.DataFrame:
    """Return each quantity over records next to its goal: mean, lowest, highest; the method in use first.

    Parameters
    ----------
    scores : the table ``capture_scores``.
    full_size : whether the goals of full-size pictures apply.
    main : the tracking method in use.
    """
    rows = []
    for name, quantity in QUANTITIES.items():
        own = scores[(scores["quantity"] == name) & scores["value"].notna()]
        goal = quantity.goal_full if full_size else quantity.goal_half
        for method in sorted(own["method"].fillna("").unique(), key=lambda method: (method != main, method)):
            values = own.loc[own["method"].fillna("") == method, "value"]
            rows.append(
                {"group": quantity.group, "quantity": name, "meaning": quantity.meaning, "method": method}
                | {"unit": quantity.unit, "goal": goal, "mean": values.mean(), "lowest": values.min()}
                | {"highest": values.max(), "values": len(values)}
                | {"met": None if goal is None else bool(values.max() <= goal)}
            )
    return pd.DataFrame(rows)


def experiment(effect: pd.DataFrame, bin_s: float, titles: dict[str, str]) -> pd.DataFrame:
    """Return how filming changes S, D and the share of correct frames, on whole records, as rows of ``summary``.

    The mean is the change over the records of all actors together; lowest and highest are the ends of its interval.
    A change beyond the goal whose interval reaches into it is neither met nor missed: it may be chance.

    Parameters
    ----------
    effect : the table ``film_effect``.
    bin_s : bin width of S.
    titles : title of each system.
    """
    whole = effect[(effect["part"] == "whole") & (effect["bin_s"].isna() | (effect["bin_s"] == bin_s))]
    rows = []
    for measure, unit in {"S": "", "D": " s", "frames_right": ""}.items():
        every = whole[(whole["measure"] == measure) & (whole["actor"] == "all")].iloc[0]
        meaning = (
            f"{words.MEASURES[measure].title} of {titles.get(every['system'], every['system'])}: "
            f"{every['filmed']:.3f}{unit} with joint angles from film, {every['planted']:.3f}{unit} with planted ones"
        )
        rows.append(
            {"group": "experiment", "quantity": f"{measure}_pct", "meaning": meaning, "method": "", "unit": "%"}
            | {"goal": FILM_EFFECT_PCT, "mean": every["difference_pct"], "lowest": every["low_pct"]}
            | {"highest": every["high_pct"], "values": int(every["n_records"]), "met": _within_goal(every)}
        )
    return pd.DataFrame(rows)


def _within_goal(effect: pd.Series) -> bool | None:
    """Return whether a change is as small as it should be, or None if there are too few records to tell."""
    if abs(effect["difference_pct"]) <= FILM_EFFECT_PCT:
        return True
    beyond = effect["low_pct"] > FILM_EFFECT_PCT or effect["high_pct"] < -FILM_EFFECT_PCT
    return False if beyond else None


def accuracy_table(_: Run, table: pd.DataFrame) -> Table:
    """Return the errors of capture next to their goals for the page; what has no unit is a count."""
    rows = []
    for _index, row in table.astype({"unit": object, "method": object}).fillna({"unit": "", "method": ""}).iterrows():
        unit, has_goal = row["unit"], not pd.isna(row["goal"])
        mean, lowest, highest = (
            number(row[name]) if unit else f"{row[name]:g}" for name in ("mean", "lowest", "highest")
        )
        rows.append(
            [
                row["meaning"],
                row["method"],
                f"{mean}\N{NO-BREAK SPACE}{unit}",
                "" if row["values"] == 1 else f"{lowest} to {highest}",
                f"{row['goal']:g}\N{NO-BREAK SPACE}{unit}" if has_goal else "",
                VERDICTS.get(str(row["met"]), "may be chance") if has_goal else "",
            ]
        )
    return Table.of(["error", "method", "mean", "over records", "goal", ""], rows, (1, 5))


def observability(_: Run, tables: pd.DataFrame) -> Drawing:
    """Return which joint angles the markers determine: shares are means over records, left and right together.

    Parameters
    ----------
    tables : the tables ``observability`` of all records.
    """
    part = tables["joint"]
    for side in SIDES:
        part = part.str.removeprefix(side)
    grouped = tables.assign(part=part).groupby(["part", "axis"], sort=False)
    found = grouped.agg(state=("state", "first"), share=("share", "mean"), reason=("reason", "first"))
    return Drawing(found.reset_index())


def observability_table(_: Run, table: pd.DataFrame) -> Table:
    """Return the share of frames in which each angle of a joint is determined, for the page; one row per joint."""
    written = {
        "measured": "{:.1f}\N{NO-BREAK SPACE}%",
        "flexion_dependent": "{:.1f}\N{NO-BREAK SPACE}%, elbow bent",
        "locked": "locked",
    }
    rows = []
    for part, own in table.groupby("part", sort=False):
        shares = zip(own["state"], own["share"], strict=True)
        cells = [written[state].format(100 * share) for state, share in shares]
        rows.append([part, *cells, own["reason"].iloc[0]])
    return Table.of(["joint", "x", "y", "z", "why"], rows, (1, 2, 3, 4))
