"""The exhibits of route directions: keywords, accents, gestures and their co-occurrence (Sargin 2006, chapter 3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from cospeech.metrics import proportions
from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table

RECOGNITION, FALSE_ALARM = "recognition", "false_alarm"
SPEECH = {"accents": "accents and head", "keywords": "keywords and hands"}
PUBLISHED_LEVEL = 0.95
"""Confidence level of the intervals that are computed for published counts."""


def share(row: pd.Series) -> str:
    """Return a share with its counts, ``0.94 (33 of 35)``."""
    if pd.isna(row["value"]):
        return "–"
    return f"{row['value']:.3f} ({int(row['hits'])} of {int(row['number'])})"


def interval(row: pd.Series) -> str:
    """Return the interval of a value, ``0.81 to 0.98``."""
    return "–" if pd.isna(row["low"]) else f"{row['low']:.3f} to {row['high']:.3f}".replace("-", "−")


def of(scores: pd.DataFrame, task: str, measure: str, **chosen: Any) -> pd.DataFrame:
    """Return the rows of a table ``direction_scores`` of a task and measure: of all labels, no differences."""
    wanted = {"task": task, "measure": measure, "portion": "test"} | chosen
    rows = scores[scores["label"].isna() & scores["other"].isna()]
    for name, value in wanted.items():
        rows = rows[rows[name] == value]
    return rows


def chosen_gaussians(scores: pd.DataFrame) -> int:
    """Return the number of Gaussians that finds most keywords and fewest others in the validated answers."""
    found, false = (
        of(scores, "keywords", measure, portion="validation").set_index("setting")["value"]
        for measure in (RECOGNITION, FALSE_ALARM)
    )
    gain = found - false
    return int(gain.index[int(gain.argmax())])


def keywords(_: Run, scores: pd.DataFrame) -> Drawing:
    """Return the scores of keyword spotting.

    Parameters
    ----------
    scores : the table ``direction_scores``.
    """
    own = scores[scores["task"] == "keywords"]
    return Drawing(own.assign(chosen=own["setting"] == chosen_gaussians(scores)))


def keyword_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the shares of keywords and of false alarms for the page."""
    rows = []
    for portion, gaussians in dict.fromkeys(zip(numbers["portion"], numbers["setting"], strict=True)):
        found, false = (
            of(numbers, "keywords", measure, portion=portion, setting=gaussians).iloc[0]
            for measure in (RECOGNITION, FALSE_ALARM)
        )
        is_chosen = " (chosen)" if found["chosen"] else ""
        rows.append(
            [f"{gaussians}{is_chosen}", portion, share(found), interval(found), share(false), interval(false)]
        )
    headings = ["Gaussians per state", "answers", "keywords found", "interval", "false alarms", "interval"]
    return Table.of(headings, rows, words=(1,))


def compare_keywords(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published shares next to ours."""
    gaussians = chosen_gaussians(numbers)
    pairs = []
    for what, measure, published in (
        ("keywords found", RECOGNITION, facts["found"]),
        ("false alarms per other word", FALSE_ALARM, facts["false_alarms"]),
    ):
        row = of(numbers, "keywords", measure, setting=gaussians).iloc[0]
        pairs.append(Pair(what, _published(*published), f"{share(row)}, {interval(row)}"))
    return [*pairs, Pair("Gaussians per state", str(facts["gaussians"]), str(gaussians))]


def _published(hits: int, number: int) -> str:
    """Return a published share with its counts, and the interval that they allow."""
    low, high = proportions.wilson(hits, number, PUBLISHED_LEVEL)
    return f"{hits / number:.3f} ({hits} of {number}), {low:.3f} to {high:.3f}"


def accents(run: Run, scores: pd.DataFrame) -> Drawing:
    """Draw recognition and false alarms of accents by set of features, and the published ones (table 3.1).

    Parameters
    ----------
    scores : the table ``direction_scores``.
    """
    own = _right(scores[scores["task"] == "accents"])
    facts = run.published["head-table-3.1"]
    figure, axes = style.figure(2.6, 1, 2, sharey=True, sharex=True)
    labelled = sorted(own["setting"].unique())
    titles = ("(a) accents recognised", "(b) other syllables not taken for accents")
    for axis, measure, title in zip(axes[0], (RECOGNITION, FALSE_ALARM), titles, strict=True):
        methods = list(facts["recognition"])
        published = facts["recognition" if measure == RECOGNITION else "one_minus_false_alarm"]
        for step, (number, colour) in enumerate(zip(labelled, (style.BLUE, style.AMBER), strict=False)):
            rows = of(own, "accents", measure, setting=number).set_index("method").loc[methods]
            places = np.arange(len(methods)) + 0.22 * (step - 0.5)
            _intervals(axis, rows, places, colour, f"{number} accents")
        axis.scatter([published[name] for name in methods], np.arange(len(methods)) + 0.3, marker="D", s=18,
                     color=style.FAINT, label=f"published ({facts['accents']} accents)", zorder=3)  # fmt: skip
        axis.set_title(title)
        axis.set_yticks(range(len(methods)), [f"[{name}]" for name in methods])
        axis.set_ylim(len(methods) - 0.4, -0.6)
        axis.set_xlabel("share")
        axis.grid(axis="x")
        style.ticks_off(axis, "y")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return Drawing(own, figure)


def _right(rows: pd.DataFrame) -> pd.DataFrame:
    """Return scores with 1 minus the share of false alarms in place of that share."""
    false = rows["measure"] == FALSE_ALARM
    whole = np.where(rows["other"].isna(), 1.0, 0.0)
    found = rows.copy()
    found.loc[false, "hits"] = (rows["number"] - rows["hits"])[false]
    found.loc[false, "value"] = (whole - rows["value"])[false]
    found.loc[false, "low"], found.loc[false, "high"] = (whole - rows["high"])[false], (whole - rows["low"])[false]
    return found


def _intervals(axis: Axes, rows: pd.DataFrame, places: Any, colour: str, label: str) -> None:
    axis.hlines(places, rows["low"], rows["high"], color=colour, linewidth=1.6)
    axis.scatter(rows["value"], places, s=22, color=colour, zorder=3, label=label)


def accent_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the differences between sets of features for the page."""
    rows = [
        [
            f"[{row['method']}] − [{row['other']}]",
            "accents recognised" if row["measure"] == RECOGNITION else "1 − false alarm rate",
            str(row["setting"]),
            f"{row['value']:+.3f}".replace("-", "−"),
            interval(row),
            "yes" if row["low"] <= 0.0 <= row["high"] else "no",
        ]
        for _, row in numbers[numbers["other"].notna()].iterrows()
    ]
    headings = ["difference", "", "labelled accents", "value", "interval", "contains 0"]
    return Table.of(headings, rows, words=(1, 5))


def compare_accents(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published rates, with the interval that the number of accents allows, next to ours."""
    fewest = int(numbers["setting"].min())
    pairs = []
    for method, published in facts["recognition"].items():
        row = of(numbers, "accents", RECOGNITION, setting=fewest, method=method).iloc[0]
        low, high = proportions.wilson(round(published * facts["accents"]), facts["accents"], PUBLISHED_LEVEL)
        pairs.append(
            Pair(
                f"accents recognised with [{method}]",
                f"{published:.3f}, {low:.3f} to {high:.3f}",
                f"{row['value']:.3f}, {interval(row)}",
            )
        )
    for method, published in facts["one_minus_false_alarm"].items():
        row = of(numbers, "accents", FALSE_ALARM, setting=fewest, method=method).iloc[0]
        pairs.append(
            Pair(f"1 − false alarm rate with [{method}]", f"{published:.3f}", f"{row['value']:.3f}, {interval(row)}")
        )
    return pairs


def best_states(numbers: pd.DataFrame) -> int:
    """Return the number of states at which recognition and 1 - false alarm rate are most alike (3.3.3)."""
    found, right = (
        of(numbers, "head", measure).set_index("setting")["value"] for measure in (RECOGNITION, FALSE_ALARM)
    )
    distance = (found - right).abs()
    return int(distance.index[int(distance.argmin())])


def gestures(_: Run, scores: pd.DataFrame) -> Drawing:
    """Draw the recognition of hand gestures, and that of head gestures against the number of states.

    Parameters
    ----------
    scores : the table ``direction_scores``.
    """
    own = _right(scores[scores["task"].isin(["hand", "head"])])
    figure, axes = style.figure(2.6, 1, 2)
    left, right = axes[0]
    hands = own[own["task"] == "hand"].reset_index(drop=True)
    _intervals(left, hands, np.arange(len(hands)), style.BLUE, "recognised")
    left.set_yticks(range(len(hands)), hands["label"].tolist())
    left.set_ylim(len(hands) - 0.5, -0.5)
    left.set_xlim(right=1.02)
    left.set_title("(a) hand gestures")
    left.set_xlabel("share recognised")
    left.grid(axis="x")
    style.ticks_off(left, "y")
    for measure, colour, label in (
        (RECOGNITION, style.BLUE, "nods and tilts found"),
        (FALSE_ALARM, style.AMBER, "1 − false alarm rate"),
    ):
        rows = of(own, "head", measure).sort_values("setting")
        right.fill_between(rows["setting"], rows["low"], rows["high"], color=colour, alpha=0.15, linewidth=0)
        right.plot(rows["setting"], rows["value"], color=colour, marker="o", markersize=3.5, label=label)
    right.set_xticks(sorted(own.loc[own["task"] == "head", "setting"].unique()))
    right.set_title("(b) head gestures")
    right.set_xlabel("states per model")
    right.set_ylim(0.5, 1.02)
    right.grid(axis="y")
    right.legend(loc="lower right")
    return Drawing(own, figure)


def gesture_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the shares of recognised gestures for the page."""
    rows = [
        [
            f"hand, {row['label']}" if row["task"] == "hand" else "head",
            str(row["setting"]),
            "recognised" if row["measure"] == RECOGNITION else "1 − false alarm rate",
            share(row),
            interval(row),
        ]
        for _, row in numbers.iterrows()
    ]
    return Table.of(["gestures", "states", "", "share", "interval"], rows, words=(2,))


def compare_gestures(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published rates next to ours."""
    hands = numbers[numbers["task"] == "hand"].set_index("label")
    pairs = [
        Pair(
            f"hand gestures recognised, {label}",
            f"{value:.2f}",
            f"{share(hands.loc[label])}, {interval(hands.loc[label])}",
        )
        for label, value in facts["hand"].items()
        if label in hands.index
    ]
    states = best_states(numbers)
    row = of(numbers, "head", RECOGNITION, setting=states).iloc[0]
    return [
        *pairs,
        Pair("head gestures found", f"{facts['head']:.2f}", f"{share(row)}, {interval(row)}"),
        Pair("states of the models of head gestures", str(facts["head_states"]), str(states)),
    ]


def measured(measures: pd.DataFrame, speech: str, measure: str) -> pd.Series:
    """Return a row of a table ``co_occurrence``."""
    return measures[(measures["speech"] == speech) & (measures["measure"] == measure)].iloc[0]


def co_occurrence(_: Run, measures: pd.DataFrame, pairs: pd.DataFrame) -> Drawing:
    """Draw the overlap, the correlation of times that are unrelated, and the differences of onsets.

    Parameters
    ----------
    measures, pairs : the tables ``co_occurrence`` and ``co_occurrence_pairs``.
    """
    figure, axes = style.figure(3.0, 1, 3)
    left, middle, right = axes[0]
    overlap = measures[measures["measure"] == "overlap"].reset_index(drop=True)
    _intervals(left, overlap, overlap.index - 0.1, style.BLUE, "actual")
    chance = overlap.drop(columns=["value", "low", "high"]).rename(
        columns={"chance": "value", "chance_low": "low", "chance_high": "high"}
    )
    _intervals(left, chance, overlap.index + 0.1, style.FAINT, "at other times")
    left.set_yticks(overlap.index, [SPEECH[name].replace(" and ", "\nand ") for name in overlap["speech"]])
    left.set_ylim(len(overlap) - 0.5, -0.5)
    left.set_xlim(0.0, 1.0)
    left.set_title("(a) share that overlaps a gesture")
    left.grid(axis="x")
    style.ticks_off(left, "y")
    head = pairs[pairs["speech"] == "accents"]
    for by_chance, colour, label in ((True, style.FAINT, "at other times"), (False, style.BLUE, "actual")):
        own = head[head["by_chance"] == by_chance]
        onset = own["gesture_start_s"] - own["event_start_s"]
        right.hist(onset, bins=np.arange(-1.2, 0.61, 0.1), color=colour, alpha=0.6, density=True, label=label)
        if by_chance:
            middle.scatter(own["event_start_s"] / 60.0, own["gesture_start_s"] / 60.0, s=7, color=colour)
    r = measured(measures, "accents", "start_r")["chance"]
    middle.set_title("(b) gestures at other times")
    middle.text(0.04, 0.95, f"r = {r:.7f}", transform=middle.transAxes, va="top")
    middle.set_xlabel("start of the accent, min")
    middle.set_ylabel("start of the gesture, min")
    right.set_title("(c) onsets of head gestures")
    right.set_xlabel("start minus that of the accent, s")
    right.set_ylabel("density, 1/s")
    right.legend(loc="upper left")
    handles, labels = left.get_legend_handles_labels()
    left.legend(handles, labels, loc="lower right")
    return Drawing(measures, figure)


def animation(_: Run, animation: pd.DataFrame) -> Drawing:
    """Draw how the head and the hands of an animated answer move.

    Parameters
    ----------
    animation : the table ``direction_animation``.
    """
    figure, axes = style.figure(3.6, 2, 1, sharex=True)
    head, hands = axes[:, 0]
    head.plot(animation["time_s"], animation["head_px"], color=style.BLUE)
    head.invert_yaxis()
    head.set_title("(a) head at accents, down the image")
    head.set_ylabel("pixels")
    for side, colour in (("left", style.BLUE), ("right", style.AMBER)):
        away_m = np.hypot(animation[f"{side}_x_m"], animation[f"{side}_y_m"])
        hands.plot(animation["time_s"], 100.0 * away_m, color=colour, label=f"{side} hand")
    starts = animation["keyword"].notna() & ~(animation["keyword_share"].diff() > 0.0)
    for row in animation[starts].itertuples():
        hands.annotate(str(row.keyword), (row.time_s, 1.0), xycoords=("data", "axes fraction"), xytext=(0, -9),
                       textcoords="offset points", color=style.FAINT)  # fmt: skip
    hands.set_ylim(0.0, 1.25 * hands.get_ylim()[1])
    hands.set_title("(b) hands at keywords, away from rest")
    hands.set_ylabel("cm")
    hands.set_xlabel("time, s")
    figure.legend(loc="outside lower center", ncols=2)
    return Drawing(animation, figure)


def compare_animation(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published speed of the head next to ours, and how far it moves."""
    speed = numbers["head_px"].diff().abs() / numbers["time_s"].diff()
    return [
        Pair("speed of the head during accents, pixels/s", f"{facts['head_px_per_s']:g}", f"{speed.max():.1f}"),
        Pair("largest displacement of the head, pixels", "–", f"{numbers['head_px'].max():.1f}"),
    ]


MEASURES = {
    "overlap": "share of the events that overlap a gesture",
    "gesture_overlap": "share of the gestures that overlap one of these events",
    "start_r": "correlation of starts, r",
    "end_r": "correlation of ends, r",
    "onset_mean_s": "mean onset difference, s",
    "onset_sd_s": "standard deviation of onset differences, s",
}


def co_occurrence_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the measures of co-occurrence and those of gestures at other times for the page."""
    rows = []
    for _index, row in numbers.iterrows():
        digits = 7 if str(row["measure"]).endswith("_r") else 3
        actual, chance, low, high = (
            "–" if pd.isna(row[name]) else f"{row[name]:.{digits}f}".replace("-", "−")
            for name in ("value", "chance", "chance_low", "chance_high")
        )
        rows.append(
            [SPEECH[row["speech"]], MEASURES[row["measure"]], str(row["number"]), actual, chance, f"{low} to {high}"]
        )
    return Table.of(["", "measure", "n", "actual", "gestures at other times", "95 % of them"], rows, words=(1,))


def compare_co_occurrence(_: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published share and correlation next to ours."""
    overlap, r = measured(numbers, "accents", "overlap"), measured(numbers, "accents", "start_r")
    hands = measured(numbers, "keywords", "gesture_overlap")
    return [
        Pair(
            "accents that overlap a head gesture",
            _published(*facts["overlapping"]),
            f"{overlap['value']:.3f}, {interval(overlap)}; by chance {overlap['chance']:.3f}",
        ),
        Pair(
            "hand gestures that overlap a keyword",
            _published(*facts["keywords"]),
            f"{hands['value']:.3f}, {interval(hands)}; by chance {hands['chance']:.3f}",
        ),
        Pair(
            "correlation of their times, r",
            f"{facts['pearson_r']:.3f}",
            f"{r['value']:.7f}; by chance {r['chance']:.7f}",
        ),
    ]
