"""What capture found against what was planted, beside its goals; which joint angles the markers tell."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

FULL_WIDTH_PX = 1392
"""The pictures of the thesis; goals of full size hold from here."""


class Quantity(NamedTuple):
    """A measured quantity as the report calls it, and the most that it should be at full and at half size."""

    group: str
    meaning: str
    unit: str
    goal_full: float | None = None
    goal_half: float | None = None


QUANTITIES = {
    "focal_error_pct": Quantity("cameras", "error of the focal lengths, mean", "%", 0.2, 0.2),
    "reprojection_px": Quantity("cameras", "distance of the laser's spots from where the cameras put them", "px"),
    "spots_mm": Quantity("cameras", "error of the spots in space, the world's own shift and turn aside", "mm"),
    "world_shift_mm": Quantity("cameras", "shift of the world, which stands where the touched points put it", "mm"),
    "world_turn_deg": Quantity("cameras", "turn of the world", "deg"),
    "pixels_px": Quantity("markers", "error of seen markers in the pictures", "px", 0.2),
    "seen_mm": Quantity("markers", "error of seen markers in space", "mm", 0.5, 1.0),
    "predicted_mm": Quantity("markers", "error of predicted markers in space", "mm"),
    "visible_unseen_pct": Quantity(
        "markers", "not seen though two views show a third of them or more", "%", 0.3, 0.3
    ),
    "visible_lost_pct": Quantity("markers", "of these, lost for good", "%"),
    "swaps": Quantity("markers", "seen markers taken for another, or more than 30 mm off", "", 0.0, 0.0),
    "thorax_deg": Quantity("angles", "orientation of the thorax", "deg", 0.2, 0.2),
    "head_deg": Quantity("angles", "orientation of the head", "deg", 0.2, 0.2),
    "upper_arm_deg": Quantity("angles", "direction of the upper arm", "deg", 0.3, 0.3),
    "elbow_hand_deg": Quantity("angles", "line from the elbow to the hand's marker", "deg", 0.3, 0.3),
    "axial_deg": Quantity(
        "angles", "turn of the upper arm about itself, elbow bent by more than 30 degrees", "deg", 1.5, 1.5
    ),
}

FILM_EFFECT_PCT = 5.0
"""Most that filming should change a score of the experiment."""

SIDES = ("left_", "right_")


def summary(scores: pd.DataFrame, width_px: int, main: str) -> pd.DataFrame:
    """Return each quantity over records beside its goal: mean, lowest, highest; the method in use first.

    Parameters
    ----------
    scores : the table ``capture_scores``.
    width_px : of the pictures, which decides the goals.
    main : the tracking method in use.
    """
    rows = []
    for name, quantity in QUANTITIES.items():
        own = scores[(scores["quantity"] == name) & scores["value"].notna()]
        goal = quantity.goal_full if width_px >= FULL_WIDTH_PX else quantity.goal_half
        for method in sorted(own["method"].fillna("").unique(), key=lambda method: (method != main, method)):
            values = own.loc[own["method"].fillna("") == method, "value"]
            rows.append(
                {"group": quantity.group, "quantity": name, "meaning": quantity.meaning, "method": method}
                | {"unit": quantity.unit, "goal": goal, "mean": values.mean(), "lowest": values.min()}
                | {"highest": values.max(), "values": len(values)}
                | {"met": None if goal is None else bool(values.max() <= goal)}
            )
    return pd.DataFrame(rows)


def experiment(effect: pd.DataFrame, bin_s: float) -> pd.DataFrame:
    """Return what filming changes of S, D and the share of right frames, whole records, as rows of ``summary``.

    The mean is the change over the records of all actors together; lowest and highest are the ends of its interval.
    A change beyond the goal whose interval reaches into it is neither met nor missed: it may be chance.

    Parameters
    ----------
    effect : the table ``film_effect``.
    bin_s : width of the bins of S.
    """
    whole = effect[(effect["part"] == "whole") & (effect["bin_s"].isna() | (effect["bin_s"] == bin_s))]
    rows = []
    for measure, unit in {"S": "", "D": " s", "frames_right": ""}.items():
        every = whole[(whole["measure"] == measure) & (whole["actor"] == "all")].iloc[0]
        meaning = (
            f"{measure} of {every['system']}: {every['filmed']:.3f}{unit} by filmed joint angles, "
            f"{every['planted']:.3f}{unit} by the planted ones"
        )
        rows.append(
            {"group": "experiment", "quantity": f"{measure}_pct", "meaning": meaning, "method": "", "unit": "%"}
            | {"goal": FILM_EFFECT_PCT, "mean": every["difference_pct"], "lowest": every["low_pct"]}
            | {"highest": every["high_pct"], "values": int(every["n_records"]), "met": _within_goal(every)}
        )
    return pd.DataFrame(rows)


def _within_goal(effect: pd.Series) -> bool | None:
    """Return whether a change is as small as it should be, or None where the records are too few to tell."""
    if abs(effect["difference_pct"]) <= FILM_EFFECT_PCT:
        return True
    beyond = effect["low_pct"] > FILM_EFFECT_PCT or effect["high_pct"] < -FILM_EFFECT_PCT
    return False if beyond else None


def observed(tables: list[pd.DataFrame]) -> pd.DataFrame:
    """Return which joint angles the markers told: shares are means over records, and left and right count as one.

    Parameters
    ----------
    tables : the table ``observability`` of each record.
    """
    every = pd.concat(tables, ignore_index=True)
    part = every["joint"]
    for side in SIDES:
        part = part.str.removeprefix(side)
    grouped = every.assign(part=part).groupby(["part", "axis"], sort=False)
    return grouped.agg(state=("state", "first"), share=("share", "mean"), reason=("reason", "first")).reset_index()
