"""Scores of motion by draw and part, what the recorded motion reaches, and how they join the scores of phrases."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import beat_alignment, hand_speed, motion_scores, scores
from cospeech.motion import skeleton

FPS = 20.0


def swinging(deg_per_frame):
    """A body with one forearm that turns by these angles from frame to frame."""
    motion = skeleton.standing(len(deg_per_frame) + 1, FPS)
    motion["left_forearm_x_deg"] = np.concatenate([[0.0], np.cumsum(deg_per_frame)])
    return motion


@pytest.fixture
def original():
    return swinging(np.random.default_rng(1).exponential(2.0, 799))


@pytest.fixture
def syllables():
    peaks = np.arange(0.3, 39.7, 0.2)
    voiced = np.arange(len(peaks)) % 3 > 0
    return pd.DataFrame({"peak_s": peaks, "f0_hz": np.where(voiced, 120.0, np.nan)})


def test_scores_are_those_of_each_draw_and_part(original, syllables):
    backward = swinging(np.diff(original["left_forearm_x_deg"])[::-1])
    draws = [original, backward, skeleton.standing(800, FPS), original.iloc[:0]]
    named = {"system": "s", "variant": "main", "record": "r"}
    table = motion_scores.table(named, original, draws, syllables, 3.0, 1.5)
    tables.validate(table, "motion_scores", "scores")
    by = table.set_index(["measure", "draw", "part"]).sort_index()
    assert len(table) == 3 * 3 * 2
    value, recorded = by["value"], by["recorded"]
    assert value["hand_speed_r", 0, "whole"] == pytest.approx(1.0)
    assert value["frechet_distance", 0, "interior"] == pytest.approx(0.0, abs=1e-8)
    assert value["beat_alignment", 0].tolist() == recorded["beat_alignment", 1].tolist()
    one, other = (motion_scores.measure(motion) for motion in (original, backward))
    smooth = [hand_speed.smoothed(hands.speed, FPS)[60:770] for hands in (one, other)]
    assert value["hand_speed_r", 1, "interior"] == pytest.approx(np.corrcoef(*smooth)[0, 1])
    assert by.loc[("hand_speed_r", 1, "interior"), "duration_s"] == pytest.approx(35.5)
    voiced = syllables.loc[syllables["f0_hz"].notna(), "peak_s"].to_numpy()
    expected = beat_alignment.score(voiced, other.speed, FPS, 60, 770)
    assert value["beat_alignment", 1, "interior"] == pytest.approx(expected)
    assert value["hand_speed_r", 2].isna().all()  # hands that do not move
    assert (value["beat_alignment", 2] == 0.0).all()
    assert value["frechet_distance", 2, "whole"] > recorded["frechet_distance", 2, "whole"] > 0.0


def test_records_without_syllables_have_no_beat_alignment(original):
    table = motion_scores.table(
        {"system": "s", "variant": "main", "record": "r"}, original, [original], None, 3.0, 1.5
    )
    tables.validate(table, "motion_scores", "scores")
    assert set(table["measure"]) == {"hand_speed_r", "frechet_distance"}


def test_records_that_are_too_short_have_undefined_scores(syllables):
    short = swinging(np.ones(20))
    table = motion_scores.table(
        {"system": "s", "variant": "main", "record": "r"}, short, [short], syllables, 3.0, 1.5
    ).set_index(["measure", "part"])
    tables.validate(table.reset_index(), "motion_scores", "scores")
    assert table.loc["frechet_distance", "value"].isna().all()
    assert table.loc[("beat_alignment", "interior"), ["value", "recorded"]].isna().all()


def test_scores_of_the_motion_join_those_of_the_phrases_seen_in_it():
    rows = [
        {"system": system, "variant": "main", "record": "r", "phrases": phrases, "draw": 0, "actor": "a"}
        | {"measure": "kappa", "part": "whole", "gesture": None, "bin_s": np.nan, "value": 0.5, "recorded": np.nan}
        | {"n_actual": 3, "n_synthesised": 4, "duration_s": 20.0}
        for system, phrases in (("s", "planned"), ("s", "seen"), ("failed", "planned"))
    ]
    made = [
        {"system": system, "variant": "main", "record": "r", "draw": 0, "measure": "hand_speed_r", "part": "whole"}
        | {"value": 0.25, "recorded": 1.0, "duration_s": 20.0}
        for system in ("s", "failed")
    ]
    joined = scores.with_motion(pd.DataFrame(rows), [pd.DataFrame(made)], {"r": "a"})
    tables.validate(joined, "record_scores", "scores")
    added = joined[joined["measure"] == "hand_speed_r"]
    assert added[["system", "phrases", "actor", "value"]].to_numpy().tolist() == [["s", "seen", "a", 0.25]]
    assert added["n_actual"].isna().all()
    assert joined["n_actual"].dropna().tolist() == [3, 3, 3]
