"""The corpus by scenario (Özkul 2012, chapter 3) and its gesture classes (Table 4.1)."""

from __future__ import annotations

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair, Table
from cospeech.report.words import number


def scenarios(_: Run, records: pd.DataFrame) -> Drawing:
    """Return one row per scenario, and a total: records, participants and lengths.

    Parameters
    ----------
    records : the table ``records``.
    """
    named = records.assign(scenario=records["scenario"].fillna("not stated"))
    rows = [_scenario(str(name), group) for name, group in named.groupby("scenario", sort=False)]
    return Drawing(pd.DataFrame([*rows, _scenario("all", records)]))


def _scenario(name: str, records: pd.DataFrame) -> dict[str, object]:
    return {
        "scenario": name,
        "task": words.scenario(name),
        "records": len(records),
        "participants": records["actor"].nunique(),
        "minutes": records["duration_s"].sum() / 60,
        "shortest_s": records["duration_s"].min(),
        "longest_s": records["duration_s"].max(),
        "language": ", ".join(sorted(records["language"].dropna().unique())),
    }


def scenario_table(_: Run, table: pd.DataFrame) -> Table:
    """Return the scenarios for the page."""
    rows = [
        [
            row["task"],
            row["records"],
            row["participants"],
            f"{row['minutes']:.1f}",
            f"{row['shortest_s']:.0f}–{row['longest_s']:.0f}",
            row["language"],
        ]
        for _, row in table.iterrows()
    ]
    return Table.of(["scenario", "records", "participants", "minutes", "length (s)", "language"], rows, (5,))


def compare_size(_: Run, table: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published size of the corpus next to ours."""
    total = table[table["scenario"] == "all"].iloc[0]
    alone = table.loc[table["scenario"].isin(words.MONOLOGUES), "records"].sum()
    return [
        Pair("records", str(facts["records"]), str(total["records"])),
        Pair("participants", str(facts["participants"]), str(total["participants"])),
        Pair("length", f"about {facts['hours']} hours", f"{total['minutes']:.1f} minutes"),
        Pair("records in the three monologue scenarios", str(facts["monologue_records"]), str(alone)),
    ]


def gesture_classes(run: Run, phrases: pd.DataFrame, labels: list[str]) -> Drawing:
    """Return one row per gesture class: how many phrases there are, also for each actor, and how long they last.

    Parameters
    ----------
    phrases : the actual gesture segments of all records.
    labels : the classes, in the order of the table.
    """
    measured = phrases.assign(
        duration_s=phrases["end_s"] - phrases["start_s"], actor=phrases["record"].map(run.actors)
    )
    whole_s = measured["duration_s"].sum()
    rows = []
    for label in labels:
        own = measured[measured["label"] == label]
        known = words.GESTURES.get(label, words.Gesture("", words.gesture(label), ""))
        actors = dict.fromkeys(run.actors.values())
        rows.append(
            {"label": label, "class": known.number, "gesture": known.title, "details": known.details}
            | {"phrases": len(own)}
            | {f"phrases_{actor}": int((own["actor"] == actor).sum()) for actor in actors}
            | {
                "mean_s": own["duration_s"].mean(),
                "median_s": own["duration_s"].median(),
                "longest_s": own["duration_s"].max(),
                "share_of_time_pct": 100 * own["duration_s"].sum() / whole_s,
            }
        )
    return Drawing(pd.DataFrame(rows))


def class_table(_: Run, table: pd.DataFrame) -> Table:
    """Return the gesture classes for the page."""
    actors = [name for name in table.columns if name.startswith("phrases_")]
    text = table.fillna({"class": "", "details": ""})
    rows = [
        [
            f"{row['class']} {row['gesture']}".strip(),
            row["details"],
            row["phrases"],
            *(row[actor] for actor in actors),
            number(row["mean_s"]),
            number(row["longest_s"]),
            f"{row['share_of_time_pct']:.1f}",
        ]
        for _, row in text.iterrows()
    ]
    heads = ["gesture", "what happens", "phrases", *(f"of {name.removeprefix('phrases_')}" for name in actors)]
    return Table.of([*heads, "mean (s)", "longest (s)", "% of time"], rows, (1,))


def compare_classes(_: Run, table: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published number of gesture classes next to ours."""
    found = int((table["phrases"] > 0).sum())
    return [Pair("gesture classes", str(facts["classes"]), f"{found} of {len(table)} occur")]
