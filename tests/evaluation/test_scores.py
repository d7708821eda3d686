"""All scores of one record: a record worked out by hand, and what must hold of any."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.evaluation import scores

RULES = scores.Rules(
    gestures=("rest", "left", "right"),
    bins_s=(0.025, 1.0),
    max_duration_s=10.0,
    tolerance_s=0.5,
    head_s=3.0,
    tail_s=1.5,
    frame_s=0.025,
)
FPS = 40.0


def table(phrases, fps=FPS, record="r"):
    """Segments of (label, seconds) pairs."""
    ends = np.cumsum([seconds for _, seconds in phrases])
    starts = np.round(np.append(0, ends[:-1]) * fps).astype(int)
    return segments.from_starts(record, starts, [label for label, _ in phrases], round(ends[-1] * fps), fps)


def score(actual, synthesised, rules=RULES):
    rows = scores.record_scores(scores.phrases(actual, rules), scores.phrases(synthesised, rules), rules)
    return pd.DataFrame(rows)


def value(found, measure, part="whole", **where):
    for column, wanted in where.items():
        found = found[found[column] == wanted]
    return found.loc[(found["measure"] == measure) & (found["part"] == part), "value"].item()


ACTUAL = table([("rest", 4), ("left", 2), ("rest", 3), ("right", 1), ("rest", 2)])
MADE = table([("rest", 3), ("left", 2), ("left", 1), ("rest", 4), ("right", 2)])


def test_a_record_by_hand():
    found = score(ACTUAL, MADE)
    # Boundaries: actual 0 4 6 9 10, synthesised 0 3 5 6 10: distances 0 1 1 0 0.
    assert value(found, "D") == pytest.approx(2 / 5)
    assert value(found, "boundary_f1") == pytest.approx(2 * 3 / 10)
    assert value(found, "phrase_ratio") == 1
    # Right: rest in [0, 3), left in [4, 6), rest in [6, 9); wrong: [3, 4), and right against rest in [9, 12).
    assert value(found, "frames_right") == pytest.approx((3 + 2 + 3) / 12)
    # S, 1 s bins: rest {4, 3, 2} and {3, 4}; left {2} and {2, 1}; right {1} and {2}.
    assert value(found, "S", gesture="rest", bin_s=1.0) == pytest.approx(2 / math.sqrt(6))
    assert value(found, "S", gesture="left", bin_s=1.0) == pytest.approx(1 / math.sqrt(2))
    assert value(found, "S", gesture="right", bin_s=1.0) == 0


def test_the_interior_by_hand():
    found = score(ACTUAL, MADE)
    # [3, 10.5): boundaries actual 4 6 9 10, synthesised 3 5 6 10; 3 and 5 lie 1 s from 4, those at 6 and 10 at 0.
    assert value(found, "D", "interior") == pytest.approx((1 + 1 + 0 + 0) / 4)
    assert value(found, "boundary_f1", "interior") == pytest.approx(2 * 2 / 8)
    # Right: [4, 6) and [6, 9) of 7.5 s; [3, 4) is rest against left, [9, 10) and [10, 10.5) differ.
    assert value(found, "frames_right", "interior") == pytest.approx(5 / 7.5)
    # Whole phrases inside: actual left 2, rest 3, right 1; synthesised left 2 and 1, rest 4; none of right.
    assert value(found, "S", "interior", gesture="left", bin_s=1.0) == pytest.approx(1 / math.sqrt(2))
    assert value(found, "S", "interior", gesture="rest", bin_s=1.0) == 0
    assert value(found, "S", "interior", gesture="right", bin_s=1.0) == 0
    assert (found.loc[found["part"] == "interior", "duration_s"] == 7.5).all()


def test_a_boundary_at_the_interior_s_edge_may_look_for_one_outside_it():
    actual = table([("rest", 2.9), ("left", 9.1)])
    found = score(actual, table([("rest", 3), ("left", 9)]))
    assert value(found, "D", "interior") == pytest.approx(0.1)
    assert value(found, "boundary_f1", "interior") == 0  # the actual one is outside
    assert math.isnan(value(found, "phrase_ratio", "interior"))


def test_only_the_trivial_boundary():
    found = score(ACTUAL, table([("rest", 12)]))
    assert value(found, "D") == 0  # as printed: the one boundary is right
    assert math.isnan(value(found, "D", "interior"))
    assert value(found, "boundary_f1", "interior") == 0
    assert value(found, "kappa") == 0


def test_actual_phrases_at_another_rate_are_compared_by_time():
    at_20 = table([("rest", 4), ("left", 2), ("rest", 3), ("right", 1), ("rest", 2)], fps=20.0)
    pd.testing.assert_frame_equal(score(at_20, MADE), score(ACTUAL, MADE))


def test_a_longer_actual_sequence_is_cut():
    longer = table([("rest", 4), ("left", 2), ("rest", 3), ("right", 1), ("rest", 2.5)])
    pd.testing.assert_frame_equal(score(longer, MADE), score(ACTUAL, MADE))


def test_a_record_shorter_than_head_and_tail_has_no_interior():
    short = table([("rest", 2), ("left", 1)])
    found = score(short, short)
    assert found.loc[found["part"] == "interior", "value"].isna().all()
    assert (found.loc[found["part"] == "interior", "duration_s"] == 0).all()


def test_an_unknown_gesture_is_named():
    with pytest.raises(UserError, match=r"record 'r': gesture 'wave' is not in"):
        scores.phrases(table([("rest", 1), ("wave", 1)]), RULES)


PHRASES = st.lists(
    st.tuples(st.sampled_from(RULES.gestures), st.integers(1, 160).map(lambda frames: frames * 0.025)),
    min_size=1,
    max_size=12,
)


@given(PHRASES)
@settings(max_examples=60)
def test_a_sequence_against_itself_is_perfect(phrases):
    found = score(table(phrases), table(phrases)).dropna(subset=["value"])
    perfect = {"S": 1, "D": 0, "boundary_f1": 1, "phrase_ratio": 1, "frames_right": 1, "kappa": 1}
    for measure, wanted in perfect.items():
        assert found.loc[found["measure"] == measure, "value"].tolist() == pytest.approx(
            [wanted] * (found["measure"] == measure).sum(), abs=1e-12
        )


@given(PHRASES, PHRASES)
@settings(max_examples=60)
def test_bounds(one, two):
    found = score(table(one), table(two))
    by = {measure: rows["value"].dropna() for measure, rows in found.groupby("measure")}
    for measure in ("S", "boundary_f1", "frames_right"):
        assert by[measure].between(0, 1).all()
    assert by["kappa"].between(-1, 1).all()
    assert (by["D"] >= 0).all()
    assert (by["phrase_ratio"] >= 0).all()


def test_the_trivial_boundary_is_not_a_target_of_the_interior():
    short_head = RULES.__class__(**{**RULES.__dict__, "head_s": 0.5})
    found = score(table([("rest", 6), ("left", 6)]), table([("rest", 1), ("left", 11)]), short_head)
    assert value(found, "D") == pytest.approx((0 + 1) / 2)  # as printed: 0 s is the nearest boundary of both
    assert value(found, "D", "interior") == pytest.approx(5)


def test_the_end_of_a_record_is_not_a_boundary():
    found = score(table([("rest", 4), ("left", 8)]), table([("rest", 10), ("left", 2)]))
    assert value(found, "D") == pytest.approx((0 + 6) / 2)
    assert value(found, "D", "interior") == pytest.approx(6)


@pytest.mark.parametrize(
    ("phrases", "inside"),
    [
        ([("rest", 3), ("left", 2), ("rest", 7)], True),  # [3, 5): begins with the interior
        ([("rest", 8.5), ("left", 2), ("rest", 1.5)], True),  # [8.5, 10.5): ends with it
        ([("rest", 2.975), ("left", 2), ("rest", 7.025)], False),
        ([("rest", 8.525), ("left", 2), ("rest", 1.475)], False),
        ([("rest", 10), ("left", 2)], False),
    ],
)
def test_only_phrases_that_lie_completely_in_the_interior_count_in_its_similarity(phrases, inside):
    actual = table([("rest", 5), ("left", 2), ("rest", 5)])
    found = score(actual, table(phrases))
    assert value(found, "S", "interior", gesture="left", bin_s=1.0) == (1 if inside else 0)
    counted = found[(found["measure"] == "S") & (found["part"] == "interior") & (found["gesture"] == "left")]
    assert counted["n_synthesised"].tolist() == [int(inside)] * 2
    assert counted["n_actual"].tolist() == [1, 1]


def test_counts_are_those_of_the_part():
    found = score(ACTUAL, MADE).set_index(["measure", "part"])
    assert found.loc[("D", "whole"), ["n_actual", "n_synthesised"]].tolist() == [5, 5]
    assert found.loc[("D", "interior"), ["n_actual", "n_synthesised"]].tolist() == [4, 4]
    assert found.loc[("D", "whole"), "duration_s"] == 12
    fewer = score(ACTUAL, table([("rest", 4), ("left", 8)])).set_index(["measure", "part"])
    assert fewer.loc[("D", "whole"), ["n_actual", "n_synthesised"]].tolist() == [5, 2]
    assert fewer.loc[("phrase_ratio", "whole"), "value"] == 2 / 5


def test_a_boundary_at_the_end_of_the_interior_is_outside():
    found = score(table([("rest", 4), ("left", 8)]), table([("rest", 4), ("left", 6.5), ("rest", 1.5)]))
    assert value(found, "phrase_ratio", "interior") == 1


def test_the_tolerance_includes_its_limit():
    actual = table([("rest", 4), ("left", 8)])
    for distance, matched in ((0.5, 2), (0.525, 1)):
        assert (
            value(score(actual, table([("rest", 4 + distance), ("left", 8 - distance)])), "boundary_f1")
            == matched / 2
        )


def test_phrases_longer_than_the_longest_count_in_the_last_bin():
    found = score(table([("rest", 11), ("left", 12)]), table([("rest", 13), ("left", 10)]))
    for gesture in ("rest", "left"):
        assert value(found, "S", gesture=gesture, bin_s=1.0) == 1


ACTORS = {"a": "x", "b": "x"}


def tables_of(made, decoders=None):
    """Scores of segment tables by (system, record, draw)."""
    synthesised = {scores.Scored(s, "main", record, "planned", draw): own for (s, record, draw), own in made.items()}
    return scores.table(
        synthesised, {record: ACTUAL.assign(record=record) for record in ACTORS}, ACTORS, RULES, decoders
    )


def test_a_system_that_failed_is_left_out_with_its_controls_and_a_control_only_where_it_has_nothing():
    nothing, whole = MADE.iloc[:0], MADE
    made = {(s, record, 0): whole for s in ("good", "bad", "good_shifted", "bad_shifted") for record in ACTORS}
    made |= {("bad", "b", 0): nothing, ("good_shifted", "a", 0): nothing}
    found = tables_of(made, {"good_shifted": "good", "bad_shifted": "bad"})
    assert set(zip(found["system"], found["record"], strict=True)) == {
        ("good", "a"), ("good", "b"), ("good_shifted", "b"),
    }  # fmt: skip


def test_every_draw_is_scored_and_named():
    one = table([("rest", 4), ("left", 8)])
    found = tables_of({("c", "a", 0): MADE, ("c", "a", 1): one})
    kappa = found[(found["measure"] == "kappa") & (found["part"] == "whole")].set_index("draw")["value"]
    assert kappa[0] == value(score(ACTUAL, MADE), "kappa")
    assert kappa[1] == value(score(ACTUAL, one), "kappa") != kappa[0]


def test_planned_phrases_are_found_by_their_draw():
    own = pd.concat([MADE.assign(system="s", variant="v", draw=draw) for draw in (0, 1)])
    assert list(scores.of_draws([own], "planned")) == [
        scores.Scored("s", "v", "r", "planned", draw) for draw in (0, 1)
    ]
