"""Means and differences of heads over records and over minutes, on scores that can be added up by hand."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import head_sessions
from cospeech.evaluation.sessions import Bootstrap

SETTINGS = Bootstrap(400, 0.95, 1)


def scores(values, measure="euclidean"):
    """Rows of ``head_scores`` from values by (system, record, minute, draw)."""
    rows = [
        {"system": system, "variant": "main", "actor": "eda", "record": record, "minute": minute, "draw": draw}
        | {"measure": measure, "lag_s": np.nan, "value": value}
        for (system, record, minute, draw), value in values.items()
    ]
    return pd.DataFrame(rows).astype({"minute": "Int64"})


def planted(n_records=4, n_minutes=3, seed=0):
    rng = np.random.default_rng(seed)
    values = {}
    for record in range(n_records):
        level = rng.normal(10.0, 1.0)
        for minute in range(n_minutes):
            hard = level + rng.normal(0.0, 0.5)
            values["a", f"r{record}", minute, 0] = hard
            for draw in range(2):
                values["a_shifted", f"r{record}", minute, draw] = hard + 2.0 + rng.normal(0.0, 0.1)
        for system, draws in (("a", 1), ("a_shifted", 2)):
            for draw in range(draws):
                own = [values[system, f"r{record}", minute, draw] for minute in range(n_minutes)]
                values[system, f"r{record}", None, draw] = float(np.mean(own))
    return values


def test_means_and_differences_are_those_of_the_values():
    values = planted()
    found = head_sessions.table(scores(values), {"a": ["a_shifted"]}, SETTINGS)
    tables.validate(found, "head_sessions", "x")
    found = found.set_index(["system", "other", "unit"])["value"]
    a, b = (
        np.mean([v for (s, _, m, _), v in values.items() if s == name and m is None]) for name in ("a", "a_shifted")
    )
    assert found["a", np.nan, "record"] == pytest.approx(a)
    assert found["a", np.nan, "minute"] == pytest.approx(a)
    assert found["a", "a_shifted", "record"] == pytest.approx(a - b)


def test_a_difference_that_is_alike_in_all_units_is_certain_and_a_mean_is_not():
    found = head_sessions.table(scores(planted()), {"a": ["a_shifted"]}, SETTINGS)
    of = found.set_index([found["other"].notna(), "system", "unit"]).sort_index()
    width = (of["high"] - of["low"]).to_dict()
    assert of.loc[(True, "a", "record"), "high"] < -1.8
    assert width[True, "a", "record"] < width[False, "a", "record"] / 4
    assert width[False, "a", "minute"] < width[False, "a", "record"]
    assert of.loc[(False, "a", "minute"), "n"] == 12


def test_units_that_one_system_lacks_are_left_out_of_the_difference():
    values = {key: value for key, value in planted().items() if key[:2] != ("a_shifted", "r0")}
    found = head_sessions.table(scores(values), {"a": ["a_shifted"]}, SETTINGS)
    own = found[(found["system"] == "a") & (found["unit"] == "record")]
    assert own["n"].tolist() == [4, 3]


def test_minutes_fill_the_record():
    assert head_sessions.minutes(100, 30.0) == [(0, 100)]
    assert head_sessions.minutes(2000, 30.0) == [(0, 2000)]
    assert head_sessions.minutes(3600, 30.0) == [(0, 1800), (1800, 3600)]
    assert head_sessions.minutes(3000, 30.0) == [(0, 1800), (1800, 3000)]


def test_systems_are_compared_with_their_own_and_general_controls_and_their_predecessors():
    systems = {
        "a": ("system", ["a_x", "a_y"]), "b": ("system", ["b_x"]), "a_x": ("control", []), "a_y": ("control", []),
        "b_x": ("control", []), "still": ("control", []), "best": ("ceiling", []),
    }  # fmt: skip
    assert head_sessions.pairs(systems) == {"a": ["a_x", "a_y", "still"], "b": ["b_x", "still", "a"]}
