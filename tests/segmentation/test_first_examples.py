"""Examples proposed by the rules of Table 4.1, for the small virtual actor and for a real speaker."""

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


def test_proposals_match_the_performed_gestures(performed):
    motions = {record: motion for record, (motion, _) in performed.items()}
    proposed = first_examples.add_proposals(NONE, motions, vocabulary.GESTURES)
    tables.validate(proposed, "annotations", "proposed")
    shares = []
    for row in proposed.itertuples():
        labels = segments.to_labels(performed[row.record][1])
        shares.append((labels[round(row.start_s * actor.FPS) : round(row.end_s * actor.FPS)] == row.gesture).mean())
    assert proposed.groupby("gesture").size().max() <= first_examples.MAX_EXAMPLES
    assert {"raise_both", "rest", "left", "contact", "open", "right"} <= set(proposed["gesture"])
    assert pd.Series(shares).groupby(proposed["gesture"]).mean().min() > 0.7


def test_proposals_do_not_replace_or_overlap_annotations(performed):
    motions = {record: motion for record, (motion, _) in performed.items()}
    annotated = pd.DataFrame(
        {"record": ["r0"], "start_s": [0.0], "end_s": [40.0], "gesture": ["left"], "origin": ["person"]}
    )
    table = first_examples.add_proposals(annotated, motions, vocabulary.GESTURES)
    assert table[table["gesture"] == "left"]["origin"].tolist() == ["person"]
    in_first = table[(table["record"] == "r0") & (table["origin"] == "rule")]
    assert (in_first["start_s"] >= 40.0).all()


def test_a_motionless_body_only_shows_rest():
    rng = np.random.default_rng(0)
    angles = rng.normal(0, 0.4, (400, len(skeleton.JOINTS), 3))
    motion = skeleton.motion_table(np.zeros((400, 3)), angles, actor.FPS)
    proposed = first_examples.add_proposals(NONE, {"r0": motion}, vocabulary.GESTURES)
    assert set(proposed["gesture"]) <= {"rest"}


def test_intervals_need_a_high_score_and_a_minimum_duration():
    score = np.array([0, 0.4, 0.9, 0.4, 0, 0.5, 0.5, 0.5, 0.5, 0, 0.9, 0])
    assert first_examples.intervals(score, 4.0) == [(1, 4, pytest.approx(1.7 / 3))]


@pytest.mark.recorded
def test_a_real_speaker_is_segmented_without_annotations():
    path = Path("../shared/data/beat2_scott/2_scott_0_1_1.npz")
    if not path.is_file():
        pytest.skip(f"no recording {path}")
    from cospeech.corpus import motion, retarget

    conventions = retarget.MotionConventions(up="y", unit="m", joints="smplx", zero="t_pose")
    motions = {f"scott_{i}": motion.read(path, conventions, 15.8 * i, 15.8 * (i + 1)).table for i in range(4)}
    settings = {
        "labels": list(vocabulary.GESTURES), "states": 4, "iterations": 5, "variance_floor": 0.1,
        "first_examples": "rules",
    }  # fmt: skip
    training = gesture.train(motions, NONE, settings)
    assert {"rest", "raise_both", "right"} <= set(training.model.labels)
    for record, table in motions.items():
        segments.check(gesture.phrases(training.model, record, table, NONE), record)
