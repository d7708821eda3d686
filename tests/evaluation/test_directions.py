"""Scores of detections in route directions, on cases counted by hand."""

import numpy as np
import pandas as pd
import pytest

from cospeech.evaluation import directions


def events(rows):
    return pd.DataFrame(rows, columns=["record", "start_s", "end_s", "label"])


def detections(rows, task="keywords", method="word models"):
    found = pd.DataFrame(rows, columns=["record", "start_s", "end_s", "label", "actual"][: len(rows[0])])
    return found.assign(task=task, method=method, setting=1, portion="test")


def shares(table):
    whole = table[table["label"].isna()].set_index("measure")
    return {name: (whole.loc[name, "hits"], whole.loc[name, "number"]) for name in whole.index}


def test_keywords_need_their_own_label_and_their_own_record():
    words = events(
        [("a", 0.0, 0.3, "left"), ("a", 0.4, 0.8, "bank"), ("a", 1.0, 1.3, "right"), ("b", 0.0, 0.3, "left")]
    )
    spotted = detections([("a", 0.1, 0.2, "left"), ("a", 1.0, 1.3, "left"), ("a", 0.5, 0.6, "left")])
    found = directions.keywords(spotted, words, ["left", "right"], 0.95)
    assert shares(found) == {"recognition": (1, 3), "false_alarm": (1, 1)}  # the second is a substitution
    each = found[found["label"].notna()].set_index("label")
    assert each.loc["left", ["hits", "number"]].tolist() == [1, 2]
    assert each.loc["right", ["hits", "number"]].tolist() == [0, 1]


def test_false_alarms_of_the_head_are_a_share_of_the_detections():
    gestures = events([("a", 0.0, 0.5, "nod"), ("a", 2.0, 3.0, "tilt")])
    spotted = detections([("a", 0.2, 0.4, "nod"), ("a", 2.2, 2.8, "nod"), ("a", 4.0, 4.5, "tilt")], "head", "HMM")
    assert shares(directions.head(spotted, gestures, 0.95)) == {"recognition": (1, 2), "false_alarm": (2, 3)}


def syllables(method, decided, actual):
    rows = [("a", n, n + 0.2, label, true) for n, (label, true) in enumerate(zip(decided, actual, strict=True))]
    return detections(rows, "accents", method)


def test_accents_are_counted_among_accents_and_false_alarms_among_the_rest():
    table = syllables("p", ["accent", "other", "accent", "other"], ["accent", "accent", "other", "none"])
    assert shares(directions.accents(table, 0.95)) == {"recognition": (1, 2), "false_alarm": (1, 2)}


def test_the_interval_of_a_difference_has_the_spread_of_paired_differences():
    rng = np.random.default_rng(1)
    actual = ["accent"] * 400
    one, other = rng.random(400) < 0.7, rng.random(400) < 0.7
    tables = [
        syllables(name, np.where(right, "accent", "other"), actual) for name, right in (("x", one), ("y", other))
    ]
    extra = [syllables(name, ["other"], ["other"]) for name in ("x", "y")]
    table = pd.concat([tables[0], extra[0], tables[1], extra[1]])
    (found,) = directions.accent_differences(table, directions.Settings(4000, 0.95), 1)
    row = found.set_index("measure").loc["recognition"]
    gain = one.astype(float) - other
    assert row["value"] == pytest.approx(gain.mean())
    half = 1.96 * gain.std() / 20.0
    assert [row["low"], row["high"]] == pytest.approx([gain.mean() - half, gain.mean() + half], abs=0.006)


def test_each_label_of_classified_gestures_has_its_share():
    table = detections(
        [("a", 0, 1, "left", "left"), ("a", 1, 2, "left", "right"), ("a", 2, 3, "right", "right")], "hand"
    )
    found = directions.classified(table, 0.95).set_index("label")
    assert found["value"].to_dict() == {"left": 1.0, "right": 0.5}
