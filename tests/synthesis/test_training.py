"""Training data hold the phrases and speech of the training records on one frame grid."""

import numpy as np
import pandas as pd
import pytest
from coupled_actor import FRAME_S, PATTERNS, corpus
from one_fold import ACTOR, SHARED, prosody_tables

from cospeech.data import segments
from cospeech.data.vocabulary import GESTURES
from cospeech.errors import UserError
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session
from cospeech.synthesis.training import fold


@pytest.fixture(scope="module")
def actor():
    return corpus(3, 4, 40.0, 0.8)


def at_motion_rate(gestures, fps=20.0):
    """The gesture segments at the frame rate of the motion."""
    parts = [
        segments.resample(table, round(table["end_s"].iloc[-1] * fps), fps)
        for _, table in gestures.groupby("record", sort=False)
    ]
    return pd.concat(parts, ignore_index=True)


def test_gestures_at_the_rate_of_the_motion_are_resampled_to_the_prosody_frame(actor):
    gestures, prosody = actor
    training, streams = fold(ACTOR, "r1", at_motion_rate(gestures), prosody)
    assert list(training.gestures) == ["r0", "r2", "r3"]
    assert list(training.speech) == ["r0", "r2", "r3"]
    assert list(streams.labels) == ["r0", "r1", "r2", "r3"]
    assert streams.lengths["r1"] == 1600
    for name, table in training.gestures.items():
        segments.check(table, name)
        assert table["end_frame"].iloc[-1] == len(training.speech[name]) == 1600
        planted = gestures[gestures["record"] == name]
        assert table["label"].tolist() == planted["label"].tolist()
        np.testing.assert_allclose(table["start_s"], planted["start_s"], atol=0.5 / 20)


def test_frames_and_labels_are_those_of_the_actor(actor):
    training, _ = fold(ACTOR, "r1", *actor)
    assert (training.actor, training.frame_s, training.order) == ("ada", FRAME_S, ("r0", "r1", "r2", "r3"))
    assert (training.labels, training.symbols) == (GESTURES, tuple(PATTERNS))


def test_phases_and_subunits_are_split_by_record_and_leave_out_the_held_out_one(actor):
    records = list(ACTOR.records)
    phases = pd.DataFrame({"record": np.repeat(records, 3), "phase": np.tile(np.arange(3), len(records))})
    tables = {name: pd.DataFrame({"record": [name], "syllable": [0]}) for name in records}
    subunits = {section: phases.assign(section=section) for section in ("head", "arms")}
    training, streams = fold(ACTOR, "r1", *actor, syllables=tables, phases=phases, subunits=subunits)
    assert list(training.phases) == list(training.syllables) == list(training.subunits) == ["r0", "r2", "r3"]
    assert list(streams.syllables) == records
    assert training.phases["r2"]["record"].tolist() == ["r2"] * 3
    assert training.subunits["r3"]["arms"][["record", "section"]].to_numpy().tolist() == [["r3", "arms"]] * 3


def test_tables_of_other_records_stay_with_the_speech(actor):
    tables = prosody_tables(ACTOR.records)
    training, streams = fold(ACTOR, "r1", *actor, tables)
    assert list(training.prosody) == ["r0", "r2", "r3"]
    assert list(streams.prosody) == list(ACTOR.records)
    assert training.motions == {}
    assert training.planted is None
    assert streams.planted == {}


def test_what_is_missing_is_named(actor):
    gestures, prosody = actor
    with pytest.raises(UserError, match="record r9: has no prosody segments"):
        fold(ACTOR, "r9", gestures, prosody)
    with pytest.raises(UserError, match="record r1: has gesture segments but no prosody segments"):
        fold(ACTOR, "r0", gestures, prosody[prosody["record"] != "r1"])
    with pytest.raises(UserError, match="record r0: its actor has no other record"):
        fold(ACTOR, "r0", gestures[gestures["record"] == "r0"], prosody)
    gap = gestures.drop(index=gestures.index[gestures["record"] == "r1"][3])
    with pytest.raises(UserError, match="gesture segments of record r1: segment 2"):
        fold(ACTOR, "r0", gap, prosody)
    gap = prosody.drop(index=prosody.index[prosody["record"] == "r1"][3])
    with pytest.raises(UserError, match="prosody segments of record r1: segment 2"):
        fold(ACTOR, "r0", gestures, gap)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"labels": ("rest",)}, r"record r1: label '.*' at .*; known are rest$"),
        ({"symbols": ("p1", "p2")}, r"record r1: label 'p.' at .*; known are p1, p2$"),
    ],
)
def test_a_label_that_the_configuration_lacks_is_named(actor, changed, message):
    training, _ = fold(ACTOR._replace(**changed), "r0", *actor)
    with pytest.raises(UserError, match=message):
        Session(training, SHARED, {}).trained(installed("hsmm"))
