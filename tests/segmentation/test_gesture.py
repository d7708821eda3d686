"""Gesture phrases of a small virtual actor are recovered from a few examples per class; clamps; invalid input."""

from __future__ import annotations

import actor
import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.markov import labelled_hmm, parallel
from cospeech.markov.parallel import MUST, NEVER
from cospeech.motion import skeleton
from cospeech.segmentation import first_examples, gesture

SETTINGS = {
    "labels": list(vocabulary.GESTURES),
    "states": 4,
    "iterations": 10,
    "variance_floor": 0.1,
    "first_examples": "annotations",
}
NONE = pd.DataFrame({"record": [], "start_s": [], "end_s": [], "gesture": [], "origin": []})


@pytest.fixture(scope="module")
def cast():
    """Four records of one actor, their planted phrases, and five examples per class."""
    rng = np.random.default_rng(1)
    performed = {f"r{i}": actor.perform(f"r{i}", rng) for i in range(4)}
    motions = {record: motion for record, (motion, _) in performed.items()}
    truth = {record: table for record, (_, table) in performed.items()}
    return motions, truth, actor.examples(truth, 5, rng)


@pytest.fixture(scope="module")
def trained(cast):
    motions, _, annotations = cast
    return gesture.train(motions, annotations, SETTINGS)


def agreement(found, true):
    return (segments.to_labels(found) == segments.to_labels(true)).mean()


def test_phrases_are_recovered_from_five_examples_per_class(cast, trained):
    motions, truth, annotations = cast
    assert trained.model.labels == vocabulary.GESTURES
    found = {record: gesture.phrases(trained.model, record, motion, NONE) for record, motion in motions.items()}
    assert np.mean([agreement(found[record], truth[record]) for record in motions]) > 0.9
    ratio = sum(map(len, found.values())) / sum(map(len, truth.values()))
    assert 0.8 < ratio < 1.25
    for record, table in found.items():
        segments.check(table, record)
        tables.validate(table, "segments", record)
    fold = gesture.train(
        {record: motion for record, motion in motions.items() if record != "r0"},
        annotations[annotations["record"] != "r0"],
        SETTINGS,
    )
    assert agreement(gesture.phrases(fold.model, "r0", motions["r0"], NONE), truth["r0"]) > 0.85


def test_the_log_likelihood_rises_in_every_iteration(trained):
    fit = trained.fit
    tables.validate(fit, "hmm_fit", "fit")
    assert fit["restart"].unique().tolist() == list(
        range(1, 9)
    )  # seven classes, then without the branch for everything else
    for _, rows in fit.groupby("restart"):
        assert (np.diff(rows["log_likelihood"]) >= -1e-9 * rows["log_likelihood"].abs().max()).all()
    assert fit[fit["chosen"]]["restart"].unique().tolist() == [8]
    assert trained.notes == ()


def test_manual_corrections_are_preserved(cast, trained):
    motions, _, _ = cast
    corrected = pd.DataFrame(
        {"record": "r1", "start_s": [10.0], "end_s": [12.0], "gesture": ["open"], "origin": ["person"]}
    )
    table = gesture.phrases(trained.model, "r1", motions["r1"], corrected)
    kept = table[(table["start_s"] == 10.0) & (table["end_s"] == 12.0)]
    assert kept["label"].tolist() == ["open"]


def test_a_class_without_examples_is_left_out(cast):
    motions, _, annotations = cast
    few = annotations[annotations["gesture"].isin(["rest", "left"])]
    one = {"r0": motions["r0"]}
    training = gesture.train(one, few[few["record"] == "r0"], SETTINGS | {"iterations": 2})
    assert training.model.labels == ("rest", "left")
    assert "class 'raise_both' has no examples and is left out" in training.notes


def test_a_record_with_one_gesture(cast):
    motions, truth, _ = cast
    rest = truth["r0"].iloc[0]
    only = motions["r0"].iloc[: rest["end_frame"]]
    example = pd.DataFrame(
        {"record": ["r0"], "start_s": [0.0], "end_s": [rest["end_s"]], "gesture": ["rest"], "origin": ["person"]}
    )
    training = gesture.train({"r0": only}, example, SETTINGS)
    assert training.model.labels == ("rest",)
    assert gesture.phrases(training.model, "r0", only, NONE)["label"].unique().tolist() == ["rest"]


def test_locked_joint_angles_are_not_used_as_features(cast):
    motions, _, annotations = cast
    locked = {record: motion.assign(left_forearm_z_deg=0.0) for record, motion in motions.items()}
    training = gesture.train(locked, annotations, SETTINGS | {"iterations": 2})
    assert len(training.model.features) == 22
    assert training.notes == (
        "locked joint angles are not used as features: left_forearm_z_deg, d_left_forearm_z_deg",
    )
    still = {
        record: motion.assign(**dict.fromkeys(skeleton.angle_columns(), 0.0)) for record, motion in motions.items()
    }
    with pytest.raises(UserError, match="all joint angles of the arms are constant"):
        gesture.train(still, annotations, SETTINGS)


def test_training_without_examples_is_rejected(cast):
    motions, _, _ = cast
    with pytest.raises(UserError, match=r"no annotated example .*or set phrases\.gesture\.first_examples to rules"):
        gesture.train(motions, NONE, SETTINGS)


def test_rules_that_find_nothing_are_not_answered_by_rules(cast, monkeypatch):
    motions, _, _ = cast
    monkeypatch.setattr(first_examples, "add_proposals", lambda annotations, motions, labels: annotations)
    with pytest.raises(UserError, match="the rules find no gesture of 4 frames or more") as caught:
        gesture.train(motions, NONE, SETTINGS | {"first_examples": "rules"})
    assert "first_examples" not in str(caught.value)


@given(
    st.lists(st.integers(0, 5000), min_size=2, max_size=12, unique=True).map(sorted), st.sampled_from([20, 25, 30])
)
@example([0, 1100], 25)
def test_an_annotation_holds_the_frames_whose_centres_it_contains(times_ms, fps):
    pairs = list(zip(times_ms[::2], times_ms[1::2], strict=False))
    person = pd.DataFrame(
        [("a", start / 1000, end / 1000, "left", "person") for start, end in pairs],
        columns=["record", "start_s", "end_s", "gesture", "origin"],
    )
    found = gesture.spans(person, fps, 5 * fps, 1)
    # in integers, because a centre may lie exactly on a boundary; it then belongs to the later side
    inside = [
        [k for k in range(5 * fps) if start * 2 * fps <= (2 * k + 1) * 1000 < end * 2 * fps] for start, end in pairs
    ]
    assert [list(range(start, end)) for start, end in zip(found["start"], found["end"], strict=True)] == [
        frames for frames in inside if frames
    ]
    assert found["whole"].all()


def test_features_are_angles_and_their_differences(cast):
    motion = cast[0]["r0"]
    table = gesture.features(motion)
    assert table.shape == (len(motion), 24)
    step = motion["right_arm_y_deg"].iloc[5] - motion["right_arm_y_deg"].iloc[4]
    assert table["d_right_arm_y_deg"].iloc[5] == step
    assert (table.filter(like="d_").iloc[0].to_numpy()[12:] == 0).all()


def test_a_model_survives_the_round_trip_through_a_table(trained):
    table = labelled_hmm.to_table(trained.model)
    tables.validate(table, "hmm_model", "model")
    back = labelled_hmm.from_table(table)
    assert back.labels == trained.model.labels
    assert back.features == trained.model.features
    for one, other in zip(back.hmm, trained.model.hmm, strict=True):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(UserError, match="its table has"):
        labelled_hmm.from_table(table.iloc[1:])


@given(
    lengths=st.lists(st.integers(1, 9), min_size=1, max_size=9),
    labels=st.lists(st.sampled_from(["a", "b", "c", None]), min_size=9, max_size=9),
    whole=st.lists(st.booleans(), min_size=9, max_size=9),
)
def test_annotations_never_forbid_every_path(lengths, labels, whole):
    # The spans have any length, are adjacent or separate, and belong to present classes or to ones added later.
    states, n_frames = 3, sum(lengths)
    edges = np.append(0, np.cumsum(lengths))
    rows = [
        (start, end, label, kind)
        for start, end, label, kind in zip(edges[:-1], edges[1:], labels, whole, strict=False)
        if label is not None and end - start >= states
    ]
    labelled = pd.DataFrame(rows, columns=["start", "end", "gesture", "whole"])
    present = ("a", "b", gesture.OTHER)
    clamp = gesture.clamp(labelled, present, n_frames, states)
    shape = (3, states, 1)
    hmm = parallel.ParallelHMM(np.full(3, 1 / 3), np.full(shape[:2], 0.5), np.zeros(shape), np.ones(shape))
    path = parallel.decode(hmm, np.zeros((n_frames, 1)), clamp)
    for start, end, label, kind in labelled.itertuples(index=False):
        branch = present.index(label) if label in present else 2
        assert (path.branch[start:end] == branch).all()
        if label in present:
            assert not path.begins[start + 1 : end].any()
            if kind and clamp.cuts[start] == MUST:
                assert path.begins[start]
            assert (clamp.cuts[start + 1 : end] == NEVER).all()
