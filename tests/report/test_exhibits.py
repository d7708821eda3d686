"""The numbers behind the exhibits, by hand and against the scores."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import plausible
import pytest
from plausible import RUN

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.metrics import similarity
from cospeech.report import systems
from cospeech.report.exhibits import (
    corpus,
    differences,
    leaderboard,
    motion,
    motion_quality,
    phrases,
    pictures,
    recovery,
    sweep,
    timeline,
    transplant,
)
from cospeech.report.page import content, videos

RUN_OF_TWO = dataclasses.replace(RUN, actors={"r1": "x", "r2": "y"})


def table(record, *pairs, fps=40.0):
    ends = np.cumsum([seconds for _, seconds in pairs])
    starts = np.round(np.append(0, ends[:-1]) * fps).astype(int)
    return segments.from_starts(record, starts, [label for label, _ in pairs], round(ends[-1] * fps), fps)


def test_scenarios_by_hand():
    records = plausible.records().iloc[[0, 1, 4]].assign(duration_s=[30.0, 90.0, 60.0])
    found = corpus.scenarios(RUN, records).numbers.set_index("scenario")
    assert found.loc["memory", ["records", "participants", "minutes"]].tolist() == [2, 2, 1.5]
    assert found.loc["all", ["records", "participants", "minutes", "longest_s"]].tolist() == [3, 2, 3.0, 90.0]
    unnamed = corpus.scenarios(RUN, records.assign(scenario=None, language=None)).numbers
    assert unnamed["scenario"].tolist() == ["not stated", "all"]


def test_gesture_classes_by_hand():
    both = pd.concat([table("r1", ("rest", 4), ("left", 2)), table("r2", ("rest", 2), ("left", 1), ("rest", 3))])
    found = corpus.gesture_classes(RUN_OF_TWO, both, ["rest", "left", "right"]).numbers.set_index("label")
    assert found["phrases"].tolist() == [3, 2, 0]
    assert found[["phrases_x", "phrases_y"]].to_numpy().tolist() == [[1, 2], [1, 1], [0, 0]]
    assert found["mean_s"].tolist()[:2] == [3.0, 1.5]
    assert found["share_of_time_pct"].tolist() == [75, 25, 0]


@pytest.mark.parametrize("bin_s", [0.025, 0.25, 0.5])
def test_duration_histograms_are_those_of_s(bin_s):
    actual = plausible.actual_phrases()["ada_1"]
    labels = list(plausible.GESTURES)
    found = phrases.durations(actual, {}, labels, bin_s, 10.0)
    codes = pd.Index(labels).get_indexer(pd.Index(actual["label"]))
    expected = similarity.duration_histograms(actual["end_s"] - actual["start_s"], codes, len(labels), bin_s, 10.0)
    for place, label in enumerate(labels):
        assert found.loc[found["gesture"] == label, "phrases"].tolist() == expected[place].tolist()


def test_frequencies_by_hand():
    actual = pd.concat([table("r1", ("rest", 1), ("left", 1), ("rest", 1)), table("r2", ("left", 1))])
    found = phrases.shares({"actual": actual}, {"r1": "x", "r2": "y"}, ["rest", "left"])
    assert found["share"].tolist() == [2 / 3, 1 / 3, 0, 1]


def test_duration_histograms_of_an_actor_leave_out_the_others():
    actual = pd.concat([table("r1", ("rest", 1), ("left", 1)), table("r2", ("left", 1))])
    for draw, counts in ((phrases.durations_of_first_actor, [1, 1]), (phrases.durations_of_second_actor, [0, 1])):
        drawn = draw(RUN_OF_TWO, actual, {"hsmm": actual}, ["rest", "left"], [0.5, 0.1, 0.25], 2.0)
        plt.close(drawn.figure)
        for sequence in ("actual", "hsmm"):
            own = drawn.numbers[drawn.numbers["sequence"] == sequence]
            assert own.groupby("gesture", sort=False)["phrases"].sum().tolist() == counts
        assert drawn.numbers["low_s"].iloc[1] == 0.25


def test_a_long_record_is_shown_from_its_middle():
    assert timeline.window(50.0) == (0.0, 50.0)
    assert timeline.window(600.0) == (270.0, 330.0)


def scored(*lines):
    return pd.DataFrame(lines, columns=["system", "phrases"])


def test_each_system_is_above_its_own_controls():
    shown = leaderboard.lines(scored(*((name, "planned") for name in plausible.DECLARED)), plausible.SYSTEMS)
    names = [line.system for line in shown]
    assert sorted(names) == sorted(plausible.DECLARED)
    for system in systems.driven(plausible.SYSTEMS):
        at = names.index(system.name)
        assert names[at + 1 : at + 3] == list(system.controls)
        assert {(line.group, line.depth) for line in shown[at + 1 : at + 3]} == {("wrong speech", 1)}
    assert shown[1].title == "another record's speech"


def test_phrases_seen_in_motion_are_below_the_planned_ones_or_in_their_place():
    board = scored(("hsmm", "planned"), ("hsmm", "seen"), ("random", "seen"), ("original", "seen"))
    shown = leaderboard.lines(board, plausible.SYSTEMS)
    assert [(line.system, line.title, line.depth) for line in shown] == [
        ("hsmm", "HSMM as printed", 0),
        ("hsmm", "as seen in its motion", 1),
        ("random", "Random phrases", 0),
        ("original", "Original motion, labelled by the same model", 0),
    ]


def test_the_leaderboard_of_the_page_has_the_scores_that_fit_it(exhibits):
    board = pd.read_csv(exhibits.reports / "tables/leaderboard.csv")
    found = leaderboard.boards(RUN, board)
    assert found.heads[:3] == ["S (25 ms bins)", "S (0.5 s bins)", "D (s)"]  # all bins are in the CSV file
    for rows, part in ((found.whole, "whole"), (found.interior, "interior")):
        assert len(rows) == len(plausible.DECLARED) + len(plausible.ANIMATED)
        row = next(row for row in rows if row.line[:2] == ("hsmm", "seen"))
        own = board[(board["system"] == "hsmm") & (board["phrases"] == "seen") & (board["actor"] == "all")]
        kappa = own.loc[(own["measure"] == "kappa") & (own["part"] == part), "value"].item()
        assert row.cells[found.heads.index("kappa")].value == f"{kappa:.2f}"


def test_a_system_of_another_package_says_where_it_comes_from():
    foreign = dict(plausible.SYSTEMS, hsmm=dataclasses.replace(plausible.SYSTEMS["hsmm"], origin="nods"))
    shown = leaderboard.lines(scored(("hsmm", "planned"), ("hsmm", "seen"), ("random", "planned")), foreign)
    assert [line.origin for line in shown] == ["nods", None, None]


def test_pairs_are_every_system_against_every_control(tables_of_a_run):
    every = tables.read(tables_of_a_run.path("evaluation/differences.parquet"), "differences")
    found = differences.pairs(every, plausible.SYSTEMS, "interior", 0.5)
    kinds = found[found["measure"] == "kappa"].groupby("kind").size().to_dict()
    assert kinds == {"own controls": 6, "other controls": 3 * 4, "systems": 3}
    assert set(found["actor"]) == {"all"}
    assert set(found.loc[found["measure"] == "S", "bin_s"]) == {0.5}
    assert set(found["phrases"]) == {"planned"}


def test_a_system_that_only_moves_is_compared_by_what_is_seen_in_its_motion(tables_of_a_run):
    every = tables.read(tables_of_a_run.path("evaluation/differences.parquet"), "differences")
    moving = dict(plausible.SYSTEMS, hsmm=dataclasses.replace(plausible.SYSTEMS["hsmm"], plans=False))
    found = differences.pairs(every, moving, "interior", 0.5)
    own = found[(found["system"] == "hsmm") | (found["other"] == "hsmm")]
    assert set(own["phrases"]) == {"seen"}
    assert set(own["other"]) == {"random", "hsmm"}
    assert set(found.drop(own.index)["phrases"]) == {"planned"}


@pytest.mark.parametrize(
    ("variant", "found"), [("clusters~12,states~5", (12, 5)), ("main", (None, None)), ("clusters~12", (None, None))]
)
def test_clusters_and_states_are_read_from_a_variant(variant, found):
    assert sweep.setting(variant) == found


def test_sweep_keeps_the_other_axis_at_its_main_value(tables_of_a_run):
    scores = tables.read(tables_of_a_run.path("evaluation/session_scores.parquet"), "session_scores")
    found = sweep.table(scores, "states", {"clusters": 8, "states": 3}, ["hsmm"])
    assert set(found["clusters"]) == {8}
    assert set(found["states"]) == {3, 5}
    assert set(found["measure"]) == {"S", "D"}
    assert sweep.best_published(RUN.published["fig-7.2a"], "clusters") == {"at": 8, "S": 0.8313, "D": 1.0714}
    assert sweep.best_published(RUN.published["fig-7.2b"], "states") == {"at": 3}
    pairs = sweep.best_states(RUN, found, RUN.published["fig-7.2b"])
    assert [pair.published for pair in pairs] == ["about the same for 3 and 5", "3"]
    assert {pair.ours for pair in pairs} <= {"3", "5"}


def test_the_sweep_is_shown_next_to_the_first_ceiling_and_the_strictest_control(tables_of_a_run):
    scores = tables.read(tables_of_a_run.path("evaluation/session_scores.parquet"), "session_scores")
    levels = sweep.references(scores, plausible.SYSTEMS)
    assert set(zip(levels["system"], levels["role"], strict=True)) == {("another", "ceiling"), ("shifted", "control")}
    assert not levels.duplicated(["system", "measure", "bin_s"]).any()


def test_best_of_a_sweep_by_hand():
    rows = [
        {"system": "hsmm", "actor": "all", "measure": m, "bin_s": 0.025 if m == "S" else np.nan, "clusters": c,
         "states": 3, "value": v, "low": v - 0.1, "high": v + 0.1}
        for c, s, d in ((4, 0.3, 0.5), (8, 0.6, 0.7), (16, 0.2, 0.4))
        for m, v in (("S", s), ("D", d))
    ]  # fmt: skip
    pairs = sweep.best_clusters(RUN, pd.DataFrame(rows), RUN.published["fig-7.2a"])
    assert [pair.ours for pair in pairs] == ["8", "0.60 (0.50 to 0.70)", "16", "0.40 (0.30 to 0.50) s"]


def test_motion_summary_is_a_mean_over_records():
    rows = [
        {"system": "hsmm", "actor": "x", "record": r, "quantity": "speed", "joint": j, "fps": 20.0, "unit": "m/s",
         "mean": 1.0, "hellinger": h, "n_frames": 10}
        for r, values in (("r1", (0.1, 0.3)), ("r2", (0.5, 0.7)))
        for j, h in zip(("left_hand", "right_hand"), values, strict=True)
    ]  # fmt: skip
    found = motion.distances(pd.DataFrame(rows)).iloc[0]
    assert found[["hellinger", "lowest", "highest", "records"]].tolist() == pytest.approx([0.4, 0.2, 0.6, 2])


def test_recovery_summary_takes_prosody_at_the_main_setting():
    from cospeech.evaluation import recovery as measured

    found = recovery.summary(measured.table(plausible.recovery_rows()), 8, 3)
    ami = found[found["quantity"] == "prosody_ami"]
    assert ami["on"].tolist() == ["held-out record", "training records"]
    assert ami["values"].tolist() == [8, 8]
    assert len(found) == 9


def test_a_transplant_is_next_to_the_own_model():
    drawn = transplant.draw(RUN, plausible.transplant())
    rows = transplant.table(RUN, drawn.numbers).rows
    assert [row[1] for row in rows] == ["ada, own model", "deniz, transplant"]
    assert [row[-1] for row in rows] == ["", "0.27"]


def test_a_system_that_failed_leaves_the_others_as_they_are():
    """It has neither phrases nor scores, and its decoding says why."""
    actual = plausible.actual_phrases()["ada_1"]
    drawn = phrases.frequencies(RUN, actual, {"hsmm": actual, "nodding": actual.iloc[:0]}, list(plausible.GESTURES))
    plt.close(drawn.figure)
    by_sequence = drawn.numbers.groupby("sequence")["phrases"].sum()
    assert by_sequence["nodding"] == 0
    assert by_sequence["hsmm"] == by_sequence["actual"] == len(actual)
    strips = timeline.strips(plausible.clusters("ada_1", np.random.default_rng(1)), {"nodding": actual.iloc[:0]})
    assert set(strips["strip"]) == {"prosody clusters"}
    decoding = pd.DataFrame({"record": ["a", "b", "c"], "failure": [None, "too few frames", "no frames"]})
    assert content.failures({"nodding": decoding, "hsmm": decoding.assign(failure=None)}) == [
        ("nodding", "too few frames (2 of 3 records)")
    ]


def test_a_picture_becomes_an_svg_of_its_own_size(tables_of_a_run):
    png = (tables_of_a_run.results / "animation/strip.png").read_bytes()
    assert 'viewBox="0 0 640 240"' in pictures.as_svg(pictures.checked(png, "strip.png"))
    with pytest.raises(UserError, match=r"strip\.png is not a PNG picture"):
        pictures.checked(b"GIF89a" + b"0" * 30, "strip.png")


def test_videos_are_shared_out_fairly_and_never_beyond_the_budget():
    groups = ["a", "a", "a", "b"]
    assert videos.choose([10] * 4, groups, 25) == {0, 3}
    assert videos.choose([10] * 4, groups, 100) == {0, 1, 2, 3}
    assert videos.choose([50, 10, 10, 10], groups, 30) == {1, 2, 3}
    assert videos.choose([10] * 4, groups, 5) == set()


def test_videos_without_room_are_linked(tables_of_a_run):
    path = tables_of_a_run.path("animation/ada_1/comparison.mp4")
    clip = videos.Clip(path, "watch", "ada", "ada_1", "side by side", "../x.mp4")
    (linked,) = videos.embed([clip], budget=0)
    assert (linked.data, linked.poster, linked.clip.link) == (None, None, "../x.mp4")
    (shown,) = videos.embed([clip], budget=10**6)
    assert shown.data.startswith("data:video/mp4;base64,")
    assert shown.poster.startswith("data:image/jpeg;base64,")


def test_motion_quality_is_shown_next_to_that_of_the_recorded_motion():
    found = {
        "joins_within": (np.nan, 97.5), "frames_within": (99.2, 98.0), "foot_speed": (0.004, 0.01),
        "foot_slip": (0.002, 0.03), "off_floor": (0.0, 1.5), "trunk_depth": (0.001, 0.02),
        "frames_deeper": (0.0, 2.0),
    }  # fmt: skip
    rows = [
        {"system": system, "actor": "ada", "record": record, "quantity": quantity, "unit": "%", "fps": 20.0}
        | {"value": values[place] + extra, "recorded": 96.9 if quantity == "joins_within" else values[0], "n": 10}
        for quantity, values in found.items()
        for record, extra in (("ada_1", 0.0), ("ada_2", 0.001))
        for place, system in enumerate(("original", "hsmm"))
    ]
    drawn = motion_quality.draw(RUN, pd.DataFrame(rows))
    assert len(drawn.numbers) == 14
    table = motion_quality.table(RUN, drawn.numbers)
    assert table.rows[0] == ["original", "–", "99.2", "4.5", "3.0", "0.0", "2.0", "0.00"]
    assert table.rows[1][1:] == ["97.5 (recorded: 96.9)", "98.0", "10.5", "31.0", "1.5", "21.0", "2.00"]
    assert len(table.headings) == len(table.rows[0])
