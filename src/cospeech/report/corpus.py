"""The corpus by scenario (Özkul 2012, chapter 3) and its gesture classes (Table 4.1)."""

from __future__ import annotations

import pandas as pd

from cospeech.report import words


def scenarios(records: pd.DataFrame) -> pd.DataFrame:
    """Return one row a scenario, and a total: records, participants and lengths.

    Parameters
    ----------
    records : the records table.
    """
    named = records.assign(scenario=records["scenario"].fillna("not stated"))
    rows = [_scenario(str(name), group) for name, group in named.groupby("scenario", sort=False)]
    return pd.DataFrame([*rows, _scenario("all", records)])


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


def gesture_classes(phrases: pd.DataFrame, actors: dict[str, str], labels: list[str]) -> pd.DataFrame:
    """Return one row a gesture class: how many phrases there are, for each actor too, and how long they last.

    Parameters
    ----------
    phrases : the actual gesture segments of all records.
    actors : the actor of each record.
    labels : the classes, in the order of the table.
    """
    measured = phrases.assign(duration_s=phrases["end_s"] - phrases["start_s"], actor=phrases["record"].map(actors))
    whole_s = measured["duration_s"].sum()
    rows = []
    for label in labels:
        own = measured[measured["label"] == label]
        known = words.GESTURES.get(label, words.Gesture("", words.gesture(label), ""))
        counts = {f"phrases_{actor}": int((own["actor"] == actor).sum()) for actor in dict.fromkeys(actors.values())}
        rows.append(
            {"label": label, "class": known.number, "gesture": known.title, "details": known.details}
            | {"phrases": len(own)}
            | counts
            | {
                "mean_s": own["duration_s"].mean(),
                "median_s": own["duration_s"].median(),
                "longest_s": own["duration_s"].max(),
                "share_of_time_pct": 100 * own["duration_s"].sum() / whole_s,
            }
        )
    return pd.DataFrame(rows)
