"""The headline findings in words that claim no more than the intervals allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from cospeech.report import words
from cospeech.report.leaderboard import Systems

FEWEST_RECORDS = 4
"""Records from which a difference between systems may be told."""


@dataclass(frozen=True)
class Finding:
    """One finding: a sentence that says it, and lines with the numbers behind it."""

    claim: str
    evidence: list[str]


def number(value: float, signed: bool = False) -> str:
    """Return a score with two decimals, three where these would show 0; a dash where it is undefined."""
    if value != value:
        return "–"
    digits = 3 if value != 0 and round(value, 2) == 0 else 2
    text = f"{value + 0.0:{'+' if signed else ''}.{digits}f}"
    return text.replace("-", "−")


def with_interval(row: pd.Series, name: str = "value", unit: str = "") -> str:
    """Return a number and its interval, ``0.52 (0.40 to 0.63)``; a difference with its sign."""
    signed = name == "difference"
    text = number(row[name], signed) + unit
    if row["low"] != row["low"]:
        return f"{text} (no interval)"
    return f"{text} ({number(row['low'], signed)} to {number(row['high'], signed)})"


def verdict(row: pd.Series, better: str) -> str:
    """Return ``better``, ``worse`` or ``undecided``, by whether the interval of a difference leaves out 0."""
    if not (row["low"] > 0 or row["high"] < 0):
        return "undecided"
    return "better" if (row["low"] > 0) == (better == "more") else "worse"


def findings(
    scores: pd.DataFrame,
    differences: pd.DataFrame,
    systems: Systems,
    recovery: pd.DataFrame | None = None,
    motion: pd.DataFrame | None = None,
    capture: pd.DataFrame | None = None,
) -> list[Finding]:
    """Return the findings of a run, most important first.

    Parameters
    ----------
    scores : session scores at the main setting.
    differences : the table of that name.
    systems : titles, roles and matched controls.
    recovery : the summary of what was found of the studio's plan, or None.
    motion : the summary of the motion statistics, or None.
    capture : what capture found beside its goals, or None.
    """
    pooled, paired = scores[scores["actor"] == "all"], differences[differences["actor"] == "all"]
    n_records = int(pooled["n_records"].max())
    found = _compared(pooled, paired, systems) if n_records >= FEWEST_RECORDS else [_silent(n_records)]
    found += [_ceiling(pooled)] if "another" in systems else []
    found += _easy_distance(pooled, systems)
    found += [_captured(capture)] if capture is not None else []
    found += [_recovered(recovery)] if recovery is not None else []
    found += [_moved(motion, systems)] if motion is not None else []
    return found


def _row(table: pd.DataFrame, **where: Any) -> pd.Series | None:
    for column, value in where.items():
        table = table[table[column] == value]
    return table.iloc[0] if len(table) else None


def _compared(pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems) -> list[Finding]:
    """The findings of differences between systems."""
    hearing = [name for name, system in systems.items() if system["role"] == "system"]
    found = [_speech(name, pooled, paired, systems) for name in hearing]
    found += [_printed_or_weighted(paired, systems)] if {"hsmm", "hsmm_weighted"} <= set(hearing) else []
    return [*found, _resolution(pooled, paired, systems, hearing)]


def _silent(n_records: int) -> Finding:
    return Finding(
        f"{words.counted(n_records, 'record')} cannot tell systems apart: which of them is better is left unsaid.",
        [f"that takes {FEWEST_RECORDS} records or more; the scores stand below all the same"],
    )


def _speech(name: str, pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems) -> Finding:
    """Whether a system does better than its own controls, which decode alike and hear the wrong speech."""
    title = systems[name]["title"]
    own = _row(pooled, system=name, measure="kappa", part="interior")
    evidence = [] if own is None else [f"kappa {with_interval(own)} on the interior of records"]
    verdicts: dict[str, dict[str, str]] = {"kappa": {}, "D": {}}
    for control in systems[name]["controls"]:
        heard = systems[control]["title"].removeprefix(f"{title}: ").replace("own speech", "its own speech")
        told = []
        for measure, unit in (("kappa", ""), ("D", " s")):
            row = _row(paired, system=name, other=control, measure=measure, part="interior")
            if row is not None and row["difference"] == row["difference"]:
                verdicts[measure][heard] = verdict(row, words.MEASURES[measure].better)
                told.append(f"{measure} {with_interval(row, 'difference', unit)}")
        evidence.append(f"against {heard}: {', '.join(told) if told else 'undefined'}")
    return Finding(f"{title} {_by_kappa(verdicts['kappa'])}. {_by_distance(set(verdicts['D'].values()))}", evidence)


def _by_kappa(verdicts: dict[str, str]) -> str:
    """Return what the differences in kappa say, control by control."""
    by = {kind: [heard for heard, found in verdicts.items() if found == kind] for kind in ("better", "worse")}
    if by["worse"]:
        return f"picks gestures worse than the same decoder hearing {' or '.join(by['worse'])}"
    if not by["better"]:
        return "cannot be told from the same decoder hearing the wrong speech"
    undecided = [heard for heard in verdicts if heard not in by["better"]]
    told = f"picks gestures better than the same decoder hearing {' or '.join(by['better'])}"
    return f"{told}, but cannot be told from it hearing {' or '.join(undecided)}" if undecided else told


def _by_distance(verdicts: set[str]) -> str:
    if verdicts == {"better"}:
        return "Its boundaries lie closer to the actual ones, too."
    if "worse" in verdicts:
        return "Its boundaries lie further from the actual ones than a control's."
    return "Whether its boundaries lie closer is not decided."


def _printed_or_weighted(paired: pd.DataFrame, systems: Systems) -> Finding:
    named = {"better": "beats", "worse": "does worse than", "undecided": "cannot be told from"}
    parts, evidence = [], []
    for measure in ("kappa", "D"):
        row = _row(paired, system="hsmm_weighted", other="hsmm", measure=measure, part="interior")
        if row is None or row["difference"] != row["difference"]:
            continue
        parts.append((named[verdict(row, words.MEASURES[measure].better)], measure))
        evidence.append(f"{measure} {with_interval(row, 'difference', ' s' if measure == 'D' else '')}")
    verbs = list(dict.fromkeys(verb for verb, _ in parts))
    told = ", and ".join(
        f"{verb} the printed decoder in {' and '.join(m for v, m in parts if v == verb)}" for verb in verbs
    )
    title = systems["hsmm_weighted"]["title"]
    return Finding(f"{title} {told}.", [f"difference on the interior of records: {line}" for line in evidence])


def _ceiling(pooled: pd.DataFrame) -> Finding:
    rows = pooled[(pooled["system"] == "another") & (pooled["measure"] == "S") & (pooled["part"] == "whole")]
    rows = rows.sort_values("bin_s")
    finest = rows.iloc[0]
    return Finding(
        f"Two real records of one actor reach S = {number(finest['value'])} in the finest bins "
        f"({words.seconds(finest['bin_s'])}). Read every S beside that.",
        [f"S {with_interval(row)} in bins of {words.seconds(row['bin_s'])}" for _, row in rows.iterrows()]
        + ["published for the best synthesis, on another corpus: 0.83"],
    )


def _easy_distance(pooled: pd.DataFrame, systems: Systems) -> list[Finding]:
    rows = pooled[(pooled["measure"] == "D") & (pooled["part"] == "whole")].dropna(subset=["value"])
    least = rows.sort_values("value", kind="stable").iloc[0]
    ratio = _row(pooled, system=least["system"], measure="phrase_ratio", part="whole")
    if systems[least["system"]]["role"] != "control" or ratio is None:
        return []
    title = systems[least["system"]]["title"]
    return [
        Finding(
            f"D alone rewards silence: the least D belongs to the control “{title}”.",
            [
                f"its D is {number(least['value'])} s, with {number(ratio['value'])} of the actual number of phrases",
                "the boundary at 0 s, which every sequence has, costs nothing",
                "boundary F1 and kappa do not reward that",
            ],
        )
    ]


def _resolution(pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems, hearing: list[str]) -> Finding:
    rows = paired[(paired["measure"] == "kappa") & (paired["part"] == "interior") & paired["system"].isin(hearing)]
    controls = {control for name in hearing for control in systems[name]["controls"]}
    rows = rows[rows["other"].isin(controls)]
    width = float(np.nanmedian((rows["high"] - rows["low"]) / 2)) if rows["low"].notna().any() else float("nan")
    n_records = int(pooled["n_records"].max())
    if width != width:
        return Finding("The corpus is too small for intervals.", [f"it has {words.counted(n_records, 'record')}"])
    return Finding(
        f"This corpus resolves differences of about {number(width)} kappa; smaller ones stay unseen.",
        [
            f"typical half-width of an interval of a difference, from {words.counted(n_records, 'record')}",
            "intervals speak of further records of these actors, not of other actors",
            "they are not corrected for the number of comparisons",
        ],
    )


def _captured(summary: pd.DataFrame) -> Finding:
    """How much of what capture should reach it reaches, by the method in use; what may be chance is told apart."""
    aimed = summary[summary["goal"].notna()].drop_duplicates("quantity")
    met = aimed["met"].astype(str)
    open_ = int((~met.isin(["True", "False"])).sum())
    named = [_missed(row) for _, row in aimed[met != "True"].fillna({"unit": ""}).iterrows()]
    return Finding(
        f"Capture meets {int((met == 'True').sum())} of its {len(aimed)} goals"
        + (f"; {open_} more may be missed by chance." if open_ else "."),
        named or ["in the worst record"],
    )


def _missed(row: pd.Series) -> str:
    """Return what is known of one goal that was not met."""
    unit, goal = str(row["unit"]), f"the goal is {row['goal']:g}"
    if row["group"] == "experiment":
        change, low, high = (number(row[name], signed=True) for name in ("mean", "lowest", "highest"))
        return f"{row['meaning']}: {change} % ({low} to {high}), {goal}"
    worst = " in the worst record" if row["values"] > 1 else ""
    return f"{row['meaning']}: {number(row['highest'])} {unit}".rstrip() + f"{worst}, {goal}"


def _recovered(summary: pd.DataFrame) -> Finding:
    frames = _row(summary, quantity="gesture_frames_right")
    ami = _row(summary, quantity="prosody_ami", on="held-out record")
    told, evidence = [], []
    if frames is not None:
        told.append(f"Gesture phrases were found as planted in {100 * frames['mean']:.1f} % of frames.")
        evidence.append(f"{100 * frames['lowest']:.1f} % in the worst record; the goal is 90 %")
    if ami is not None:
        told.append(f"Prosody clusters share {number(ami['mean'])} with the planted patterns.")
        evidence.append(
            f"adjusted mutual information on held-out records, {number(ami['lowest'])} to {number(ami['highest'])}; "
            "1 is all, 0 is chance, the goal is 0.5"
        )
    return Finding(" ".join(told), evidence)


def _moved(summary: pd.DataFrame, systems: Systems) -> Finding:
    speed = summary[summary["quantity"] == "speed"].dropna(subset=["hellinger"])
    own = speed.loc[speed["system"].isin(systems), "hellinger"]
    other = speed.loc[speed["system"] == "another original"].iloc[0]
    claim = "no more than" if bool((own <= other["highest"]).all()) else "more than"
    told = [f"{systems[name]['title'] if name in systems else name} {number(value)}"
            for name, value in zip(speed["system"], speed["hellinger"], strict=True)]  # fmt: skip
    return Finding(
        f"The speeds of synthesised hands differ from the original's {claim} those of another original record may.",
        [
            f"Hellinger distance of speed, mean over records: {', '.join(told)} (up to {number(other['highest'])})",
            "random gestures are made of the same motion: this says how it moves, not what it means",
        ],
    )
