"""Examples that the rules of Table 4.1 propose, on the small virtual actor and on a real one."""

from __future__ import annotations

from pathlib import Path

import actor
import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables, vocabulary
from cospeech.motion import skeleton
from cospeech.segmentation import first_examples, gesture

NONE = pd.DataFrame({"record": [], "start_s": [], "end_s": [], "gesture": [], "origin": []})


@pytest.fixture(scope="module")
def performed():
    rng = np.random.default_rng(4)
    return {f"r{i}": actor.perform(f"r{i}", rng) for i in range(3)}


def test_proposals_are_what_the_actor_did(performed):
    motions = {record: motion for record, (motion, _) in performed.items()}
    proposed = first_examples.complete(NONE, motions, vocabulary.GESTURES)
    tables.validate(proposed, "annotations", "proposed")
    shares = []
    for row in proposed.itertuples():
        labels = segments.to_labels(performed[row.record][1])
        shares.append((labels[round(row.start_s * actor.FPS) : round(row.end_s * actor.FPS)] == row.gesture).mean())
    assert proposed.groupby("gesture").size().max() <= first_examples.EXAMPLES
    assert {"raise_both", "rest", "left", "contact", "open", "right"} <= set(proposed["gesture"])
    assert pd.Series(shares).groupby(proposed["gesture"]).mean().min() > 0.7


def test_annotations_come_first_and_stay_clear_of_proposals(performed):
    motions = {record: motion for record, (motion, _) in performed.items()}
    given = pd.DataFrame(
        {"record": ["r0"], "start_s": [0.0], "end_s": [40.0], "gesture": ["left"], "origin": ["person"]}
    )
    table = first_examples.complete(given, motions, vocabulary.GESTURES)
    assert table[table["gesture"] == "left"]["origin"].tolist() == ["person"]
    in_first = table[(table["record"] == "r0") & (table["origin"] == "rule")]
    assert (in_first["start_s"] >= 40.0).all()


def test_a_body_that_does_not_move_shows_rest_alone():
    rng = np.random.default_rng(0)
    angles = rng.normal(0, 0.4, (400, len(skeleton.JOINTS), 3))
    motion = skeleton.motion_table(np.zeros((400, 3)), angles, actor.FPS)
    proposed = first_examples.complete(NONE, {"r0": motion}, vocabulary.GESTURES)
    assert set(proposed["gesture"]) <= {"rest"}


def test_stretches_need_height_and_length():
    score = np.array([0, 0.4, 0.9, 0.4, 0, 0.5, 0.5, 0.5, 0.5, 0, 0.9, 0])
    assert first_examples.stretches(score, 4.0) == [(1, 4, pytest.approx(1.7 / 3))]


@pytest.mark.recorded
def test_a_real_speaker_runs_unattended():
    path = Path("../shared/data/beat2_scott/2_scott_0_1_1.npz")
    if not path.is_file():
        pytest.skip(f"no recording {path}")
    from cospeech.corpus import motion, retarget

    declared = retarget.Declaration(up="y", unit="m", joints="smplx", zero="t_pose")
    motions = {f"scott_{i}": motion.read(path, declared, 15.8 * i, 15.8 * (i + 1)).table for i in range(4)}
    settings = {
        "labels": list(vocabulary.GESTURES), "states": 4, "iterations": 5, "variance_floor": 0.1,
        "first_examples": "rules",
    }  # fmt: skip
    training = gesture.train(motions, NONE, settings)
    assert {"rest", "raise_both", "right"} <= set(training.model.labels)
    for record, table in motions.items():
        segments.check(gesture.phrases(training.model, record, table, NONE), record)
