"""Session scores and differences: means by hand, pairing, directions, and what is undefined."""

import math

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.evaluation import sessions
from cospeech.metrics import bootstrap

BOOTSTRAP = sessions.Bootstrap(samples=400, level=0.95, seed=1)


MAIN = "clusters~8,states~3"


def row(
    system, actor, record, measure, value,
    duration_s=60.0, gesture=None, bin_s=np.nan, part="whole", variant=MAIN, phrases="planned", draw=0,
):  # fmt: skip
    return {
        "system": system, "variant": variant, "actor": actor, "record": record, "phrases": phrases,
        "measure": measure, "part": part, "gesture": gesture, "bin_s": bin_s, "value": value,
        "n_actual": 3, "n_synthesised": 3, "duration_s": duration_s, "draw": draw,
    }  # fmt: skip


def differences(rows):
    """Differences between systems whose main variants are all the same."""
    return sessions.differences(rows, dict.fromkeys(rows["system"], MAIN), BOOTSTRAP)


def find(found, **where):
    for column, wanted in where.items():
        found = found[found[column] == wanted]
    assert len(found) == 1
    return found.iloc[0]


def many(system, values, measure="kappa", actors=("x", "y"), **keywords):
    """One value for each record of two actors."""
    half = len(values) // 2
    return [row(system, actors[k // half], f"r{k}", measure, value, **keywords) for k, value in enumerate(values)]


def test_s_is_a_plain_mean_and_leaves_out_what_is_undefined():
    values = [[0.2, 0.4, np.nan], [0.9, np.nan, np.nan]]
    rows = [
        row("hsmm", "x", f"r{r}", "S", value, duration_s=10.0 + 90 * r, gesture=f"g{g}", bin_s=0.5)
        for r, record in enumerate(values)
        for g, value in enumerate(record)
    ]
    found = find(sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP), actor="x")
    assert found["value"] == pytest.approx((0.2 + 0.4 + 0.9) / 3)  # eq. 7.3, whatever the durations
    assert (found["n"], found["n_undefined"], found["n_records"]) == (3, 3, 2)


def test_d_is_weighted_by_duration():
    rows = [row("hsmm", "x", "r1", "D", 1.0, 30.0), row("hsmm", "x", "r2", "D", 2.0, 90.0)]
    found = find(sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP), actor="x")
    assert found["value"] == pytest.approx((30 * 1 + 90 * 2) / 120)  # eq. 7.4
    assert found["low"] <= found["value"] <= found["high"]


def test_all_actors_are_pooled_beside_each():
    rows = pd.DataFrame(many("hsmm", [0.1, 0.2, 0.5, 0.6]))
    found = sessions.session_scores(rows, BOOTSTRAP)
    assert find(found, actor="x")["value"] == pytest.approx(0.15)
    assert find(found, actor="y")["value"] == pytest.approx(0.55)
    assert find(found, actor="all")["value"] == pytest.approx(0.35)
    assert find(found, actor="all")["n_records"] == 4


def test_measure_undefined_everywhere_or_in_all_but_one_record():
    rows = many("hsmm", [np.nan] * 4, "D") + many("hsmm", [0.5, np.nan, np.nan, np.nan], "kappa")
    found = sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP)
    nowhere = find(found, actor="all", measure="D")
    assert math.isnan(nowhere["value"])
    assert (nowhere["n"], nowhere["n_undefined"], nowhere["n_records"]) == (0, 4, 0)
    once = find(found, actor="all", measure="kappa")
    assert once["value"] == 0.5
    assert math.isnan(once["low"])


def test_an_actor_may_not_be_called_all():
    with pytest.raises(UserError, match="an actor is called 'all'"):
        sessions.session_scores(pd.DataFrame(many("hsmm", [0.1, 0.2], actors=("x", "all"))), BOOTSTRAP)


def scored():
    rng = np.random.default_rng(5)
    base = rng.uniform(0, 0.6, 8)
    rows = []
    for measure, step in (("kappa", 0.2), ("D", 0.3), ("phrase_ratio", 0.4)):
        rows += many("good", base + step + rng.normal(0, 0.01, 8), measure)
        rows += many("poor", base, measure)
        rows += many("twin", base, measure)
    for g in range(3):
        for system, step in (("good", 0.2), ("poor", 0.0), ("twin", 0.0)):
            values = np.clip(base + step + 0.01 * g, 0, 1)
            rows += many(system, values, "S", gesture=f"g{g}", bin_s=0.5)
    return pd.DataFrame(rows)


def test_differences_are_those_of_the_session_scores_and_mirror_each_other():
    rows = scored()
    found, means = differences(rows), sessions.session_scores(rows, BOOTSTRAP)
    for measure in ("kappa", "D", "S"):
        one = find(found, system="good", other="poor", actor="all", measure=measure)
        two = find(found, system="poor", other="good", actor="all", measure=measure)
        level = [find(means, system=name, actor="all", measure=measure)["value"] for name in ("good", "poor")]
        assert one["difference"] == pytest.approx(level[0] - level[1])
        assert (one["difference"], one["low"], one["high"]) == (-two["difference"], -two["high"], -two["low"])
        assert one["n"] == 8


def test_pairing_makes_intervals_narrow():
    found = differences(scored())
    pair = find(found, system="good", other="poor", actor="all", measure="kappa")
    mean = find(sessions.session_scores(scored(), BOOTSTRAP), system="good", actor="all", measure="kappa")
    assert pair["high"] - pair["low"] < 0.2 * (mean["high"] - mean["low"])


def test_better_knows_each_measure_s_good_side():
    found = differences(scored())

    def better(system, other, measure):
        return find(found, system=system, other=other, actor="all", measure=measure)["better"]

    assert better("good", "poor", "kappa")
    assert not better("poor", "good", "kappa")
    assert not better("good", "poor", "D")  # a greater distance is worse
    assert better("poor", "good", "D")
    assert pd.isna(better("good", "poor", "phrase_ratio"))  # a ratio ought to be 1
    assert not better("twin", "poor", "kappa")  # equal: the interval is 0 to 0


def test_only_records_with_both_values_are_paired():
    rows = pd.DataFrame(many("one", [1.0, 2.0, np.nan, 4.0], "D") + many("two", [np.nan, 1.0, 1.0, 1.0], "D"))
    found = find(differences(rows), system="one", other="two", actor="all")
    assert found["n"] == 2
    assert found["difference"] == pytest.approx((1 + 3) / 2)
    never = pd.DataFrame(many("one", [1.0, np.nan], "D") + many("two", [np.nan, 1.0], "D"))
    found = find(differences(never), system="one", other="two", actor="all")
    assert found["n"] == 0
    assert math.isnan(found["difference"])
    assert pd.isna(found["better"])


def test_other_variants_stay_out_of_differences():
    other = many("three", [1.0, 2.0], variant="clusters~4,states~3")
    rows = pd.DataFrame(many("one", [1.0, 2.0]) + many("two", [1.0, 2.0]) + other)
    assert set(differences(rows)["system"]) == {"one", "two"}


def test_planned_phrases_are_not_compared_with_phrases_seen_in_motion():
    planned = many("one", [0.1, 0.2, 0.3, 0.4]) + many("two", [0.2, 0.3, 0.4, 0.5])
    seen = many("one", [0.9, 0.8, 0.9, 0.8], phrases="seen") + many("moves", [0.4, 0.4, 0.4, 0.3], phrases="seen")
    found = differences(pd.DataFrame(planned + seen))
    pairs = found.loc[found["actor"] == "all", ["system", "other", "phrases"]].apply(tuple, axis=1)
    assert sorted(pairs) == [
        ("moves", "one", "seen"),
        ("one", "moves", "seen"),
        ("one", "two", "planned"),
        ("two", "one", "planned"),
    ]


def test_tables_obey_their_schemas_and_survive_the_file(tmp_path):
    rows = scored().assign(recorded=np.nan)
    found = {
        "record_scores": rows,
        "session_scores": sessions.session_scores(rows, BOOTSTRAP),
        "differences": differences(rows),
    }
    for name, table in found.items():
        path = tmp_path / f"{name}.parquet"
        tables.write(table, path, name, corpus="virtual", config_hash="0")
        assert len(tables.read(path, name)) == len(table)


# ---------------------------------------------------------------- draws of controls


def drawn(system, values, measure="kappa", **keywords):
    """Values of several draws of each record, {(actor, record): values}."""
    return [
        row(system, actor, record, measure, value, draw=draw, **keywords)
        for (actor, record), own in values.items()
        for draw, value in enumerate(own)
    ]


def test_draws_share_the_weight_of_their_record():
    rows = drawn("c", {("x", "r1"): [1.0, 2.0, 6.0]}, "D", duration_s=30.0)
    rows += drawn("c", {("x", "r2"): [8.0]}, "D", duration_s=90.0)
    found = find(sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP), actor="x")
    assert found["value"] == pytest.approx((30 * 3 + 90 * 8) / 120)
    assert (found["n"], found["n_records"]) == (4, 2)
    assert (found["fewest_draws"], found["most_draws"]) == (1, 3)


def test_an_undefined_draw_takes_its_share_of_the_record_away():
    rows = drawn("c", {("x", "r1"): [1.0, np.nan], ("x", "r2"): [4.0, 6.0]}, "D")
    found = find(sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP), actor="x")
    assert found["value"] == pytest.approx((0.5 * 1 + 0.5 * 4 + 0.5 * 6) / 1.5)
    assert (found["n"], found["n_undefined"], found["n_records"]) == (3, 1, 2)


def test_a_record_without_draws_does_not_count_as_the_fewest():
    rows = drawn("c", {("x", "r1"): [1.0, 2.0], ("x", "r3"): [1.0, 2.0, 3.0]}) + many("s", [1.0, 2.0, 3.0, 4.0])
    found = find(sessions.session_scores(pd.DataFrame(rows), BOOTSTRAP), system="c", actor="all")
    assert (found["fewest_draws"], found["most_draws"], found["n_records"]) == (2, 3, 2)


def test_differences_from_a_control_are_those_of_its_mean_over_draws_on_common_records():
    system = many("s", [0.5, 0.6, 0.7, 0.8])
    control = drawn("c", {("x", "r0"): [0.1, 0.3], ("x", "r1"): [0.2, 0.2], ("y", "r2"): [0.0, 0.8]})
    found = find(differences(pd.DataFrame(system + control)), system="s", other="c", actor="all")
    assert found["n"] == 3
    assert found["difference"] == pytest.approx(((0.5 - 0.2) + (0.6 - 0.2) + (0.7 - 0.4)) / 3)
    assert found["low"] < found["difference"] < found["high"]
    assert 0 < found["p_value"] < 1


def test_controls_that_share_their_draws_are_compared_in_pairs():
    rng = np.random.default_rng(3)
    values = {(actor, f"{actor}{k}"): rng.normal(0, 1, 8) for actor in ("x", "y") for k in range(5)}
    rows = drawn("one", values) + drawn("two", {key: own + 0.25 for key, own in values.items()})
    found = find(differences(pd.DataFrame(rows)), system="two", other="one", actor="all")
    assert [found["low"], found["difference"], found["high"]] == pytest.approx([0.25] * 3)


def test_many_draws_make_the_interval_independent_of_which_are_drawn():
    """With one draw of a control per record, another draw gives another verdict; their mean does not move as much."""
    rng = np.random.default_rng(1)
    base = {("x", f"r{k}"): rng.normal(0, 0.02) for k in range(20)}

    def difference_of(n_draws, seed):
        draw = np.random.default_rng(seed)
        control = drawn("c", {key: level + draw.normal(0, 0.3, n_draws) for key, level in base.items()})
        system = [row("s", *key, "kappa", level + 0.05) for key, level in base.items()]
        return find(differences(pd.DataFrame(system + control)), system="s", other="c", actor="all")["difference"]

    spread = {n: np.std([difference_of(n, seed) for seed in range(12)]) for n in (1, 8)}
    assert spread[8] < 0.6 * spread[1]  # 1 / sqrt(8) is 0.35


def test_the_same_table_with_one_draw_gives_the_plain_bootstrap():
    rows = pd.DataFrame(scored())
    found = find(sessions.session_scores(rows, BOOTSTRAP), system="good", actor="all", measure="kappa")
    values = rows[(rows["system"] == "good") & (rows["measure"] == "kappa")]["value"].to_numpy()
    counts = bootstrap.draws(["x"] * 4 + ["y"] * 4, 400, 1, "all")
    drawn_means = (counts @ values) / counts.sum(axis=1)
    tail = bootstrap.expanded_tail(0.95, 8, 6)
    assert [found["low"], found["high"]] == pytest.approx(np.quantile(drawn_means, [tail, 1 - tail]).tolist())


def test_actors_count_if_one_of_their_records_has_a_value():
    defined = np.array([[True, False, False, True], [False, True, True, False], [False, False, False, False]])
    strata = np.array(["x", "y", "z", "x"], dtype=object)
    assert sessions._n_strata(defined, strata).tolist() == [1, 2, 0]
