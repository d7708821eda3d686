"""A fold holds the training records' phrases and speech on one frame grid, and nothing of the held-out gestures."""

import numpy as np
import pandas as pd
import pytest
from cospeech.synthesis.fold import fold
from coupled_actor import FRAME_S, corpus

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.markov import hsmm as semi
from cospeech.synthesis import hsmm, hsmm_weighted

HOW = hsmm.Estimate(segments.GESTURES, 8, 10.0, 1e-6, "none", 1.0)
WEIGHTS = (0.1, 0.3, 1.0)


@pytest.fixture(scope="module")
def actor():
    return corpus(3, 4, 40.0, 0.8)


def at_motion_rate(gestures, fps=20.0):
    """The gesture segments as the motion's own rate gives them."""
    parts = [
        segments.resample(table, round(table["end_s"].iloc[-1] * fps), fps)
        for _, table in gestures.groupby("record", sort=False)
    ]
    return pd.concat(parts, ignore_index=True)


def test_gestures_at_the_rate_of_the_motion_are_brought_to_the_prosody_frame(actor):
    gestures, prosody = actor
    known = fold("r1", at_motion_rate(gestures), prosody, FRAME_S)
    assert list(known.gestures) == ["r0", "r2", "r3"]
    assert list(known.speech) == ["r0", "r2", "r3"]
    assert known.n_frames == 1600
    for name, table in known.gestures.items():
        segments.check(table, name)
        assert table["end_frame"].iloc[-1] == len(known.speech[name]) == 1600
        planted = gestures[gestures["record"] == name]
        assert table["label"].tolist() == planted["label"].tolist()
        np.testing.assert_allclose(table["start_s"], planted["start_s"], atol=0.5 / 20)


def written(model, folder):
    """The bytes of the model's four tables."""
    folder.mkdir()
    found = {}
    for name, table in semi.to_tables(model, FRAME_S, HOW.floor).items():
        tables.write(table, folder / name, name, corpus="virtual", config_hash="0")
        found[name] = (folder / name).read_bytes()
    return found


def test_nothing_of_the_held_out_record_reaches_the_model_or_the_weight(actor, tmp_path):
    gestures, prosody = actor
    other_gestures, other_prosody = corpus(99, 4, 25.0, 0.1)  # another actor, of another length
    exchanged = [
        pd.concat([mine[mine["record"] != "r2"], theirs[theirs["record"] == "r2"]], ignore_index=True)
        for mine, theirs in ((gestures, other_gestures), (prosody, other_prosody))
    ]
    results = []
    for place, (g, p) in enumerate([(gestures, prosody), exchanged, (gestures[gestures["record"] != "r2"], prosody)]):
        known = fold("r2", g, p, FRAME_S)
        counted = hsmm.counts(known, HOW)
        weight = hsmm_weighted.choose_weight(known, counted, HOW, WEIGHTS, "none")
        results.append((written(hsmm.train(counted.values(), HOW), tmp_path / str(place)), weight))
    assert results[0] == results[1] == results[2]


def test_what_is_missing_is_named(actor):
    gestures, prosody = actor
    with pytest.raises(UserError, match="record r9: has no prosody segments"):
        fold("r9", gestures, prosody, FRAME_S)
    with pytest.raises(UserError, match="record r1: has gesture segments but no prosody segments in the fold of r0"):
        fold("r0", gestures, prosody[prosody["record"] != "r1"], FRAME_S)
    with pytest.raises(UserError, match="record r0: its actor has no other record"):
        fold("r0", gestures[gestures["record"] == "r0"], prosody, FRAME_S)
    gap = gestures.drop(index=gestures.index[gestures["record"] == "r1"][3])
    with pytest.raises(UserError, match="gesture segments of record r1: segment 2"):
        fold("r0", gap, prosody, FRAME_S)
    gap = prosody.drop(index=prosody.index[prosody["record"] == "r1"][3])
    with pytest.raises(UserError, match="prosody segments of record r1: segment 2"):
        fold("r0", gestures, gap, FRAME_S)


def test_a_label_that_the_configuration_lacks_is_named(actor):
    gestures, prosody = actor
    known = fold("r0", gestures, prosody, FRAME_S)
    with pytest.raises(UserError, match=r"record r1: label '.*' at .*; known are rest"):
        hsmm.counts(known, HOW._replace(labels=("rest",)))
    with pytest.raises(UserError, match=r"record r1: label 'p.' at .*; known are p1, p2"):
        hsmm.counts(known, HOW._replace(clusters=2))
