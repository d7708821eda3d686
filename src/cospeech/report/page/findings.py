"""The headline findings, in words that claim no more than the intervals allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.metrics import bootstrap
from cospeech.report import words
from cospeech.report.page.comparing import (
    FEWEST_RECORDS,
    STATED,
    compared_systems,
    controls_of,
    over_all_actors,
    row_of,
    verdict,
    with_interval,
)
from cospeech.report.systems import System, Systems, first_ceiling, matched
from cospeech.report.words import number


@dataclass(frozen=True)
class Finding:
    """One finding: a sentence that states it, and lines with the numbers behind it.

    ``in_table`` says whether the headline table shows it, too (see the module ``headline``).
    """

    claim: str
    evidence: list[str]
    in_table: bool = False


def findings(
    scores: pd.DataFrame,
    differences: pd.DataFrame,
    systems: Systems,
    best_published_s: float,
    level: float,
    recovery: pd.DataFrame | None = None,
    motion: pd.DataFrame | None = None,
    capture: pd.DataFrame | None = None,
    worlds: pd.DataFrame | None = None,
) -> list[Finding]:
    """Return the findings of a run, most important first.

    Parameters
    ----------
    scores : session scores at the main setting.
    differences : the table ``differences``.
    systems : all systems.
    best_published_s : S of the best published synthesis.
    level : level of the intervals; 1 - level is the error rate of all comparisons together.
    recovery : numbers of the exhibit ``fig-recovery``, or None.
    motion : numbers of ``fig-motion``, or None.
    capture : numbers of ``table-capture`` and ``table-film-effect``, or None.
    worlds : numbers of ``worlds``, or None.
    """
    pooled, paired = over_all_actors(scores, differences, systems)
    n_records = int(pooled["n_records"].max())
    found = _compared(pooled, paired, systems, level) if n_records >= FEWEST_RECORDS else [_too_few(n_records)]
    found += _in_worlds(worlds, level) if worlds is not None else []
    found += _ceiling(pooled, systems, best_published_s)
    found += _easy_distance(pooled, systems)
    found += [_captured(capture)] if capture is not None else []
    found += [_recovered(recovery)] if recovery is not None else []
    found += [_moved(motion, systems)] if motion is not None else []
    return found


def _compared(pooled: pd.DataFrame, paired: pd.DataFrame, systems: Systems, level: float) -> list[Finding]:
    """Return what the differences between systems, and between systems and controls, show."""
    listening, before, table = compared_systems(pooled, paired, systems)
    found = [_speech(system, pooled, table, systems, level) for system in listening]
    for name, others in before.items():
        found.append(_against(systems[name], [systems[other] for other in others], table, level))
    return [*found, _resolution(pooled, paired, listening, int(table["p_value"].notna().sum()))]


def _too_few(n_records: int) -> Finding:
    return Finding(
        f"{words.counted(n_records, 'record')} cannot distinguish between systems, so none is called better here.",
        [f"that takes at least {FEWEST_RECORDS} records; the scores are shown below all the same"],
    )


def _speech(system: System, pooled: pd.DataFrame, compared: pd.DataFrame, systems: Systems, level: float) -> Finding:
    """Return whether a system does better than its own controls under wrong speech, and than those without speech."""
    own = row_of(pooled, system=system.name, measure="kappa", part="interior")
    evidence = [] if own is None else [f"kappa {with_interval(own)} on the interior of records"]
    verdicts: dict[str, dict[str, str]] = {measure: {} for measure in STATED}
    for name in controls_of(system, systems):
        rows = _stated(compared, system.name, name)
        if not rows:  # one plans phrases, and the other only moves
            continue
        for measure, row in rows.items():
            verdicts[measure][name] = verdict(row, words.MEASURES[measure].better, level)
        evidence.append(f"minus {_named([name], system, systems)}{_draws(pooled, name)}: {_numbers(rows)}")
    by_kappa, by_distance = (
        {kind: [name for name, found in verdicts[measure].items() if found == kind]
         for kind in ("better", "worse", "undecided")}
        for measure in STATED
    )  # fmt: skip
    claim = f"“{system.title}” {_by_kappa(by_kappa, system, systems)}. {_by_distance(by_distance, system, systems)}"
    return Finding(claim, evidence, in_table=True)


def _named(controls: list[str], system: System, systems: Systems) -> str:
    """Return the names of controls for a sentence about a system; its own controls by the speech that drives them."""
    found = [f"“{systems[name].title}”" for name in controls if name not in system.controls]
    speech = [systems[name].title.removeprefix(f"{system.title}: ").replace("own speech", "its own speech")
              for name in controls if name in system.controls]  # fmt: skip
    return words.joined(found + ([f"the same system driven by {words.joined(speech, 'or')}"] if speech else []))


def _stated(compared: pd.DataFrame, system: str, other: str) -> dict[str, pd.Series]:
    """Return the differences between two systems by measure, as far as they are defined."""
    rows = {measure: row_of(compared, system=system, other=other, measure=measure) for measure in STATED}
    return {measure: row for measure, row in rows.items() if row is not None}


def _numbers(rows: dict[str, pd.Series]) -> str:
    """Return differences with their intervals and corrected p-values."""
    return ", ".join(
        f"{measure} {with_interval(row, 'difference', ' s' if measure == 'D' else '')}{_p_value(row['p_corrected'])}"
        for measure, row in rows.items()
    )


def _p_value(value: float) -> str:
    if value != value:
        return ""
    return ", p < 0.001" if value < 0.001 else f", p = {value:.3f}"


def _draws(pooled: pd.DataFrame, control: str) -> str:
    """Return how many draws of each record a control's scores are averaged over, and of how many records."""
    row = row_of(pooled, system=control, measure="kappa", part="interior")
    if row is None:
        return ""
    fewest, most = int(row["fewest_draws"]), int(row["most_draws"])
    n_records, every = int(row["n_records"]), int(pooled["n_records"].max())
    found = (
        []
        if most == 1
        else [f"{most} draws per record" if fewest == most else f"{fewest} to {most} draws per record"]
    )
    found += [f"{n_records} of {words.counted(every, 'record')}"] if n_records < every else []
    return f" ({', '.join(found)})" if found else ""


def _by_kappa(by: dict[str, list[str]], system: System, systems: Systems) -> str:
    """Return what the differences in kappa from controls show; ``by`` holds the controls by verdict."""
    if by["worse"]:
        return f"picks gestures worse than {_named(by['worse'], system, systems)}"
    if not by["better"]:
        return "cannot be distinguished from its controls by the gestures that it picks"
    claim = f"picks gestures better than {_named(by['better'], system, systems)}"
    if by["undecided"]:
        claim += f", but cannot be distinguished from {_named(by['undecided'], system, systems)}"
    return claim


def _by_distance(by: dict[str, list[str]], system: System, systems: Systems) -> str:
    if by["worse"]:
        return (
            f"Its boundaries are further from the actual ones than those of {_named(by['worse'], system, systems)}."
        )
    if by["better"] and not by["undecided"]:
        return "Its boundaries are closer to the actual ones, too."
    return "Whether its boundaries are closer is undecided."


def _against(system: System, others: list[System], compared: pd.DataFrame, level: float) -> Finding:
    """Return how a system compares with the first one and with its predecessor."""
    named = {"better": "beats", "worse": "does worse than", "undecided": "cannot be distinguished from"}
    clauses, evidence = [], []
    for other in others:
        verdicts: dict[str, list[str]] = {}
        rows = _stated(compared, system.name, other.name)
        for measure, row in rows.items():
            verdicts.setdefault(named[verdict(row, words.MEASURES[measure].better, level)], []).append(measure)
        clauses += [f"{verb} “{other.title}” in {' and '.join(measures)}" for verb, measures in verdicts.items()]
        evidence.append(f"minus “{other.title}”: {_numbers(rows)}")
    claim = "; it ".join(clauses) or "cannot be compared with other systems"
    return Finding(f"“{system.title}” {claim}.", [*evidence, "on the interior of records"], in_table=True)


def _in_worlds(cells: pd.DataFrame, level: float) -> list[Finding]:
    """Return where systems gain from speech as their assumptions let expect, and every deviation.

    Parameters
    ----------
    cells : the cross table of systems and worlds, as ``exhibits.worlds.cells`` returns it.
    level : level of the intervals.
    """
    decided = cells[cells["found"].isin(["gain", "loss", "none"]) & (cells["n"] >= FEWEST_RECORDS)]
    at_home, uncoupled = (decided[decided["expected"] == name] for name in ("gain", "none"))
    if decided.empty:
        return [
            Finding(
                "The actors of the worlds have too few records to tell where systems gain from speech.",
                [f"that takes at least {FEWEST_RECORDS} records of each"],
            )
        ]
    missed = at_home[at_home["found"] != "gain"]
    losses = decided[(decided["found"] == "loss") & (decided["expected"] == "open")]
    found = []
    if len(at_home):
        claim = (
            f"Where speech tells what a system assumes, it gains from speech in {len(at_home) - len(missed)} of "
            f"{words.counted(len(at_home), 'measure')}."
        )
        found.append(Finding(claim, [_in_world(row) for _, row in at_home.iterrows()]))
    for _, row in missed.iterrows():
        claim = f"Deviation: {_of_cell(row)}, “{row['title']}” does not gain from the speech that it assumes"
        found.append(Finding(f"{claim}.", [_in_world(row)]))
    for row, other in _beaten(decided):
        claim = f"Deviation: {_of_cell(row)}, “{other['title']}” gains more than “{row['title']}”, whose world it is"
        found.append(Finding(f"{claim}.", [_in_world(other), _in_world(row)]))
    for _, row in losses.iterrows():
        found.append(
            Finding(f"Deviation: {_of_cell(row)}, “{row['title']}” does worse by its own speech.", [_in_world(row)])
        )
    if len(uncoupled):
        found.append(_uncoupled(uncoupled, level))
    return found


def _uncoupled(cells: pd.DataFrame, level: float) -> Finding:
    """Return how many systems seem to gain or lose by speech at coupling 0, where it tells nothing."""
    judged = cells.assign(p_corrected=bootstrap.holm(cells["p_value"].to_numpy(dtype=float)))
    deviating = judged[judged["found"] != "none"]
    certain = int((deviating["p_corrected"] <= 1 - level).sum())
    exclude, remain = "excludes" if len(deviating) == 1 else "exclude", "remains" if certain <= 1 else "remain"
    claim = (
        f"At coupling 0, {len(deviating)} of {words.counted(len(judged), 'interval')} {exclude} 0; by chance, about "
        f"{(1 - level) * len(judged):.1f} would. Corrected for the number of comparisons, "
        f"{words.counted(certain, 'deviation') if certain else 'no deviation'} {remain}."
    )
    evidence = [f"deviation: {_in_world(row)}{_p_value(row['p_corrected'])} (corrected)"
                for _, row in deviating.iterrows()]  # fmt: skip
    return Finding(claim, evidence or ["every interval contains 0, as it should"])


def _beaten(cells: pd.DataFrame) -> list[tuple[pd.Series, pd.Series]]:
    """Return each cell in which a gain is expected and another system gains more, with the best of the others.

    A gain is more than another if it lies above the other's whole interval.
    """
    found = []
    for _, group in cells.groupby(["actor", "measure"], sort=False):
        own = group[group["expected"] == "gain"]
        others = group[(group["expected"] == "open") & (group["found"] == "gain")]
        if len(own) and len(others):
            best, other = (rows.sort_values("advantage").iloc[-1] for rows in (own, others))
            if other["advantage"] > best["high"]:
                found.append((best, other))
    return found


def _of_cell(row: pd.Series) -> str:
    measure = words.MEASURES[row["measure"]].title
    return f"in {measure} in the world {row['world']} at coupling {row['coupling']:g}"


def _in_world(row: pd.Series) -> str:
    """Return the advantage in one cell of the cross table."""
    shown = row.rename({"advantage": "difference"})
    return f"“{row['title']}” {_of_cell(row)}: {with_interval(shown, 'difference')}"


def _ceiling(pooled: pd.DataFrame, systems: Systems, best_published_s: float) -> list[Finding]:
    ceiling = first_ceiling(systems)
    if ceiling is None:
        return []
    rows = pooled[(pooled["system"] == ceiling.name) & (pooled["measure"] == "S") & (pooled["part"] == "whole")]
    rows = rows.sort_values("bin_s")
    finest = rows.iloc[0]
    return [
        Finding(
            f"The ceiling of S, “{ceiling.title}”, is {number(finest['value'])} in the finest bins "
            f"({words.seconds(finest['bin_s'])}). Compare every S with it.",
            [f"S {with_interval(row)} in bins of {words.seconds(row['bin_s'])}" for _, row in rows.iterrows()]
            + [f"published for the best synthesis, on another corpus: {best_published_s:.2f}"],
        )
    ]


def _easy_distance(pooled: pd.DataFrame, systems: Systems) -> list[Finding]:
    rows = pooled[(pooled["measure"] == "D") & (pooled["part"] == "whole")].dropna(subset=["value"])
    least = rows.sort_values("value", kind="stable").iloc[0]
    ratio = row_of(pooled, system=least["system"], measure="phrase_ratio", part="whole")
    winner = systems[least["system"]]
    if winner.role != "control" or ratio is None:
        return []
    return [
        Finding(
            f"D alone rewards silence: the control “{winner.title}” has the lowest D.",
            [
                f"its D is {number(least['value'])} s, its phrase ratio {number(ratio['value'])}",
                "the boundary at 0 s, which every sequence has, costs nothing",
                "boundary F1 and kappa do not reward that",
            ],
        )
    ]


def _resolution(pooled: pd.DataFrame, paired: pd.DataFrame, listening: list[System], n_compared: int) -> Finding:
    names = [system.name for system in listening]
    controls = {control for system in listening for control in system.controls}
    rows = paired[(paired["measure"] == "kappa") & (paired["part"] == "interior") & paired["system"].isin(names)]
    rows = rows[rows["other"].isin(controls)]
    width = float(np.nanmedian((rows["high"] - rows["low"]) / 2)) if rows["low"].notna().any() else float("nan")
    n_records = int(pooled["n_records"].max())
    if width != width:
        return Finding("The corpus is too small for intervals.", [f"it has {words.counted(n_records, 'record')}"])
    return Finding(
        f"This corpus resolves differences of about {number(width)} in kappa; smaller ones remain undetected.",
        [
            f"typical half-width of the interval of a difference, from {words.counted(n_records, 'record')}",
            "the intervals apply to further records of these actors, not to other actors",
            f"intervals are not corrected for the number of comparisons, but p-values are (Holm, "
            f"{n_compared} comparisons above), and a difference that they do not support is called undecided",
        ],
    )


def _captured(summary: pd.DataFrame) -> Finding:
    """Return how many goals of capture are met by the method in use, and how many are missed perhaps by chance."""
    aimed = summary[summary["goal"].notna()].drop_duplicates("quantity")
    met = aimed["met"].astype(str)
    open_ = int((~met.isin(["True", "False"])).sum())
    missed = [_missed(row) for _, row in aimed[met != "True"].fillna({"unit": ""}).iterrows()]
    return Finding(
        f"Capture meets {int((met == 'True').sum())} of its {len(aimed)} goals"
        + (f"; {open_} more may be missed by chance." if open_ else "."),
        missed or ["even in the worst record"],
    )


def _missed(row: pd.Series) -> str:
    """Return what is known about a goal that was not met."""
    unit, goal = str(row["unit"]), f"the goal is {row['goal']:g}"
    if row["group"] == "experiment":
        change, low, high = (number(row[name], signed=True) for name in ("mean", "lowest", "highest"))
        return f"{row['meaning']}: {change} % ({low} to {high}), {goal}"
    worst = " in the worst record" if row["values"] > 1 else ""
    return f"{row['meaning']}: {number(row['highest'])} {unit}".rstrip() + f"{worst}, {goal}"


def _recovered(summary: pd.DataFrame) -> Finding:
    frames = row_of(summary, quantity="gesture_frames_right")
    ami = row_of(summary, quantity="prosody_ami", on="held-out record")
    claims, evidence = [], []
    if frames is not None:
        claims.append(f"The planted gesture phrases were recovered in {100 * frames['mean']:.1f} % of the frames.")
        evidence.append(f"{100 * frames['lowest']:.1f} % in the worst record; the goal is 90 %")
    if ami is not None:
        claims.append(
            f"The adjusted mutual information of prosody clusters and planted patterns is {number(ami['mean'])}."
        )
        evidence.append(
            f"{number(ami['lowest'])} to {number(ami['highest'])} on held-out records; 1 is perfect, 0 is chance, "
            "the goal is 0.5"
        )
    return Finding(" ".join(claims), evidence)


def _moved(summary: pd.DataFrame, systems: Systems) -> Finding:
    speed = summary[summary["quantity"] == "speed"].dropna(subset=["hellinger"])
    made = speed[speed["system"].isin(systems.keys() - matched(systems))]
    other = speed.loc[speed["system"] == "another original"].iloc[0]
    within = bool((made["hellinger"] <= other["highest"]).all())
    distances = [f"{systems[name].title} {number(value)}"
                 for name, value in zip(made["system"], made["hellinger"], strict=True)]  # fmt: skip
    distances.append(f"another original {number(other['hellinger'])} (up to {number(other['highest'])})")
    return Finding(
        f"The speeds of synthesised hands differ from the original's {'no more' if within else 'more'} than those of "
        "another original record.",
        [
            f"Hellinger distance of speed, mean over records: {', '.join(distances)}",
            "motion assembled from recorded segments keeps their speeds, whatever the gestures mean",
        ],
    )
