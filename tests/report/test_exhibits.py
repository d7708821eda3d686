"""The numbers behind the exhibits, by hand and against the scores."""

import numpy as np
import pandas as pd
import plausible
import pytest
import yaml
from plausible import ROOT

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.metrics import similarity
from cospeech.report import (
    corpus,
    leaderboard,
    motion,
    phrases,
    pictures,
    published,
    recovery,
    sweep,
    timeline,
    videos,
)

PUBLISHED = yaml.safe_load((ROOT / "reports/template/published.yaml").read_text(encoding="utf-8"))


def table(record, *pairs, fps=40.0):
    ends = np.cumsum([seconds for _, seconds in pairs])
    starts = np.round(np.append(0, ends[:-1]) * fps).astype(int)
    return segments.from_starts(record, starts, [label for label, _ in pairs], round(ends[-1] * fps), fps)


def test_scenarios_by_hand():
    records = plausible.records().iloc[[0, 1, 4]].assign(duration_s=[30.0, 90.0, 60.0])
    found = corpus.scenarios(records).set_index("scenario")
    assert found.loc["memory", ["records", "participants", "minutes"]].tolist() == [2, 2, 1.5]
    assert found.loc["all", ["records", "participants", "minutes", "longest_s"]].tolist() == [3, 2, 3.0, 90.0]
    unnamed = corpus.scenarios(records.assign(scenario=None, language=None))
    assert unnamed["scenario"].tolist() == ["not stated", "all"]


def test_gesture_classes_by_hand():
    both = pd.concat([table("r1", ("rest", 4), ("left", 2)), table("r2", ("rest", 2), ("left", 1), ("rest", 3))])
    found = corpus.gesture_classes(both, {"r1": "x", "r2": "y"}, ["rest", "left", "right"]).set_index("label")
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
    found = phrases.frequencies({"actual": actual}, {"r1": "x", "r2": "y"}, ["rest", "left"])
    assert found["share"].tolist() == [2 / 3, 1 / 3, 0, 1]


def test_tables_of_several_systems_are_put_together_in_order():
    made = [table(f"r{k}", (label, 1.0)) for label in ("rest", "left") for k in range(3)]
    found = phrases.by_system(made, ["one", "two"])
    assert found["one"]["label"].tolist() == ["rest"] * 3
    assert found["two"]["record"].tolist() == ["r0", "r1", "r2"]


def test_a_long_record_is_shown_from_its_middle():
    assert timeline.window(50.0) == (0.0, 50.0)
    assert timeline.window(600.0) == (270.0, 330.0)


def test_each_system_stands_above_its_own_controls():
    shown = leaderboard.lines(plausible.SYSTEMS)
    assert {line.name for line in shown} == set(plausible.SYSTEMS)
    assert len(shown) == len(plausible.SYSTEMS)
    names = [line.name for line in shown]
    for name, system in plausible.SYSTEMS.items():
        if system["role"] == "system":
            at = names.index(name)
            assert names[at + 1 : at + 3] == list(system["controls"])
            assert {line.role for line in shown[at + 1 : at + 3]} == {"wrong speech"}
    assert shown[1].title == "another record's speech"


def test_pairs_are_every_system_against_every_control(tables_of_a_run):
    from cospeech.data import tables

    differences = tables.read(tables_of_a_run.path("evaluation/differences.parquet"), "differences")
    found = leaderboard.pairs(differences, plausible.SYSTEMS, "interior", 0.5)
    kinds = found[found["measure"] == "kappa"].groupby("kind").size().to_dict()
    assert kinds == {"own controls": 6, "other controls": 3 * 4, "systems": 3}
    assert set(found["actor"]) == {"all"}
    assert set(found.loc[found["measure"] == "S", "bin_s"]) == {0.5}


def test_sweep_keeps_the_other_axis_at_its_main_value(tables_of_a_run):
    from cospeech.data import tables

    scores = tables.read(tables_of_a_run.path("evaluation/session_scores.parquet"), "session_scores")
    found = sweep.table(scores, "states", {"clusters": 8, "states": 3}, ["hsmm"])
    assert set(found["clusters"]) == {8}
    assert set(found["states"]) == {3, 5}
    assert set(found["measure"]) == {"S", "D"}
    assert sweep.best_published(PUBLISHED, "clusters") == {"at": 8, "S": 0.8313, "D": 1.0714}
    assert sweep.best_published(PUBLISHED, "states") == {"at": 3}
    pairs = published.pairs("fig-7.2b", PUBLISHED, found, {"hsmm": "HSMM"})
    assert [(pair.published, pair.ours in ("3", "5")) for pair in pairs] == [("3", True)]


def test_best_of_a_sweep_by_hand():
    rows = [
        {"system": "hsmm", "actor": "all", "measure": m, "bin_s": 0.025 if m == "S" else np.nan, "clusters": c,
         "states": 3, "value": v, "low": v - 0.1, "high": v + 0.1}
        for c, s, d in ((4, 0.3, 0.5), (8, 0.6, 0.7), (16, 0.2, 0.4))
        for m, v in (("S", s), ("D", d))
    ]  # fmt: skip
    pairs = published.best_clusters(PUBLISHED, pd.DataFrame(rows), {"hsmm": "HSMM"})
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


def test_a_picture_becomes_an_svg_of_its_own_size(tables_of_a_run):
    png = (tables_of_a_run.results / "animation/strip.png").read_bytes()
    assert 'viewBox="0 0 640 240"' in pictures.as_svg(png, "strip.png")
    with pytest.raises(UserError, match=r"strip\.png: no PNG picture"):
        pictures.as_svg(b"GIF89a" + b"0" * 30, "strip.png")


def test_videos_are_shared_out_fairly_and_never_beyond_the_budget():
    actors = {"a1": "a", "a2": "a", "a3": "a", "b1": "b"}
    sizes = dict.fromkeys(actors, 10)
    assert videos.choose(sizes, actors, 25) == {"a1", "b1"}
    assert videos.choose(sizes, actors, 100) == set(actors)
    assert videos.choose(sizes | {"a1": 50}, actors, 30) == {"a2", "a3", "b1"}
    assert videos.choose(sizes, actors, 5) == set()


def test_videos_without_room_are_linked(tables_of_a_run):
    path = tables_of_a_run.path("animation/ada_1/comparison.mp4")
    (left,) = videos.embed({"ada_1": path}, {"ada_1": "../x.mp4"}, {"ada_1": "ada"}, budget=0)
    assert (left.data, left.poster, left.link) == (None, None, "../x.mp4")
    (shown,) = videos.embed({"ada_1": path}, {"ada_1": "../x.mp4"}, {"ada_1": "ada"}, budget=10**6)
    assert shown.data.startswith("data:video/mp4;base64,")
    assert shown.poster.startswith("data:image/jpeg;base64,")
