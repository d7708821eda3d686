"""The headline findings in words that claim no more than the intervals allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from cospeech.report import words
from cospeech.report.leaderboard import Systems


@dataclass(frozen=True)
class Finding:
    """One finding: a line that says it, and the numbers behind it."""

    claim: str
    evidence: str


def number(value: float, signed: bool = False) -> str:
    """Return a score with two decimals, or three where it is small; a dash where it is undefined."""
    if value is None or value != value:
        return "–"
    digits = 3 if 0 < abs(value) < 0.095 else 2
    text = f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"
    return text.replace("-", "−")


def with_interval(row: pd.Series, name: str = "value", signed: bool = False) -> str:
    """Return a number and its interval, ``0.52 (0.40 to 0.63)``."""
    text = number(row[name], signed)
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
) -> list[Finding]:
    """Return the findings of a run, most important first.

    Parameters
    ----------
    scores : session scores at the main setting.
    differences : the table of that name.
    systems : titles, roles and matched controls.
    recovery : the summary of what was found of the studio's plan, or None.
    motion : the summary of the motion statistics, or None.
    """
    pooled, paired = scores[scores["actor"] == "all"], differences[differences["actor"] == "all"]
    hearing = [name for name, system in systems.items() if system["role"] == "system"]
    found = [_speech(name, pooled, paired, systems) for name in hearing]
    found += [_printed_or_weighted(paired, systems)] if {"hsmm", "hsmm_weighted"} <= set(hearing) else []
    found += [_ceiling(pooled)] if "another" in systems else []
    found += _easy_distance(pooled, systems)
    found.append(_resolution(pooled, paired, systems, hearing))
    found += [_recovered(recovery)] if recovery is not None else []
    found += [_moved(motion, systems)] if motion is not None else []
    return found


def _row(table: pd.DataFrame, **where: Any) -> pd.Series | None:
    for column, value in where.items():
        table = table[table[column] == value]
    return table.iloc[0] if len(table) else None


def _speech(name: str, pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems) -> Finding:
    """Whether a system does better than its own controls, which decode alike and hear the wrong speech."""
    title = systems[name]["title"]
    own = _row(pooled, system=name, measure="kappa", part="interior")
    evidence, verdicts = [], {}
    for control in systems[name]["controls"]:
        heard = systems[control]["title"].replace(f"{title}: ", "")
        for measure in ("kappa", "D"):
            row = _row(paired, system=name, other=control, measure=measure, part="interior")
            if row is not None and row["difference"] == row["difference"]:
                verdicts[measure, control] = verdict(row, words.MEASURES[measure].better)
                unit = " s" if measure == "D" else ""
                evidence.append(f"{measure} {with_interval(row, 'difference', signed=True)}{unit} against {heard}")
    kappas = {v for (measure, _), v in verdicts.items() if measure == "kappa"}
    distances = {v for (measure, _), v in verdicts.items() if measure == "D"}
    claim = f"{title} {_what_speech_gives(kappas)}{_and_boundaries(distances)}."
    level = f"kappa {with_interval(own)}; " if own is not None else ""
    return Finding(claim, f"On the interior of records: {level}{'; '.join(evidence)}.")


def _what_speech_gives(kappas: set[str]) -> str:
    if kappas == {"better"}:
        return "picks gestures by the speech it hears: it beats both controls that hear the wrong speech"
    if "better" in kappas and "worse" not in kappas:
        return "beats only one of its two controls that hear the wrong speech"
    if "worse" in kappas:
        return "does worse than a control that hears the wrong speech"
    return "cannot be told from the same decoder under the wrong speech on this corpus"


def _and_boundaries(distances: set[str]) -> str:
    if distances == {"better"}:
        return ", and places boundaries closer to the actual ones"
    if "worse" in distances:
        return ", and places boundaries further from the actual ones than a control does"
    return "; whether it places boundaries better is not decided" if distances else ""


def _printed_or_weighted(paired: pd.DataFrame, systems: Systems) -> Finding:
    named = {"better": "beats", "worse": "does worse than", "undecided": "cannot be told from"}
    parts, evidence = [], []
    for measure in ("kappa", "D"):
        row = _row(paired, system="hsmm_weighted", other="hsmm", measure=measure, part="interior")
        if row is None or row["difference"] != row["difference"]:
            continue
        parts.append((named[verdict(row, words.MEASURES[measure].better)], measure))
        unit = " s" if measure == "D" else ""
        evidence.append(f"{measure} {with_interval(row, 'difference', signed=True)}{unit}")
    verbs = list(dict.fromkeys(verb for verb, _ in parts))
    told = ", and ".join(
        f"{verb} the printed decoder in {' and '.join(m for v, m in parts if v == verb)}" for verb in verbs
    )
    title = systems["hsmm_weighted"]["title"]
    return Finding(f"{title} {told}.", f"Differences on the interior: {'; '.join(evidence)}.")


def _ceiling(pooled: pd.DataFrame) -> Finding:
    rows = pooled[(pooled["system"] == "another") & (pooled["measure"] == "S") & (pooled["part"] == "whole")]
    rows = rows.sort_values("bin_s")
    told = [f"{with_interval(row)} with {words.seconds(row['bin_s'])} bins" for _, row in rows.iterrows()]
    return Finding(
        f"Two real records of one actor reach only S = {number(rows['value'].iloc[0])} "
        f"at the printed bins of {words.seconds(rows['bin_s'].iloc[0])}: read S beside that.",
        f"S of another real record of the actor: {', '.join(told)}. The thesis printed 0.83 for its own corpus.",
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
            f"Its D is {number(least['value'])} s with {number(ratio['value'])} of the actual number of phrases. "
            "The boundary at 0 s, which every sequence has, costs nothing. Boundary F1 and kappa do not reward that.",
        )
    ]


def _resolution(pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems, hearing: list[str]) -> Finding:
    rows = paired[(paired["measure"] == "kappa") & (paired["part"] == "interior") & paired["system"].isin(hearing)]
    controls = {control for name in hearing for control in systems[name]["controls"]}
    rows = rows[rows["other"].isin(controls)]
    width = float(np.nanmedian((rows["high"] - rows["low"]) / 2)) if rows["low"].notna().any() else float("nan")
    n_records = int(pooled["n_records"].max())
    if width != width:
        return Finding("The corpus is too small for intervals.", f"It has {n_records} records.")
    return Finding(
        f"This corpus resolves differences of about {number(width)} kappa; smaller ones stay unseen.",
        f"That is the typical half-width of an interval of a difference to a control, from {n_records} records. "
        "Intervals speak of further records of these actors, not of other actors, and are not corrected for the "
        "number of comparisons.",
    )


def _recovered(summary: pd.DataFrame) -> Finding:
    frames = _row(summary, quantity="gesture_frames_right")
    ami = _row(summary, quantity="prosody_ami", on="held-out record")
    told = []
    if frames is not None:
        told.append(f"gesture phrases found agree with the planted ones in {100 * frames['mean']:.1f} % of frames")
    if ami is not None:
        told.append(
            f"prosody clusters share {number(ami['mean'])} adjusted mutual information with the planted patterns"
        )
    lowest = [f"{100 * frames['lowest']:.1f} % in the worst record"] if frames is not None else []
    lowest += [f"{number(ami['lowest'])} in the worst held-out record"] if ami is not None else []
    claim = " and ".join(told)
    return Finding(f"{claim[:1].upper()}{claim[1:]}.", f"At least {' and '.join(lowest)}.")


def _moved(summary: pd.DataFrame, systems: Systems) -> Finding:
    speed = summary[summary["quantity"] == "speed"]
    told = [
        f"{systems[row['system']]['title'] if row['system'] in systems else row['system']} {number(row['hellinger'])}"
        for _, row in speed.dropna(subset=["hellinger"]).iterrows()
    ]
    own = speed.loc[speed["system"].isin(systems), "hellinger"]
    other = speed.loc[speed["system"] == "another original"].iloc[0]
    within = bool((own <= other["highest"]).all())
    claim = "no more than" if within else "more than"
    return Finding(
        f"The speeds of synthesised hands differ from the original's {claim} those of two original records may.",
        f"Hellinger distance of speed to the record's original motion, mean over records: {', '.join(told)} "
        f"(up to {number(other['highest'])}). Random gestures move alike: this sees motion, not sense.",
    )
