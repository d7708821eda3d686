"""The speed of the hands is that of the wrists, and its correlation says how well two bodies move together."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import hand_speed, scores
from cospeech.motion import skeleton

FPS = 20.0
FOREARM_M = 0.25


def swinging(deg_per_frame, joint="left_forearm"):
    """A body with one forearm that turns by these angles from frame to frame."""
    motion = skeleton.standing(len(deg_per_frame) + 1, FPS)
    motion[f"{joint}_x_deg"] = np.concatenate([[0.0], np.cumsum(deg_per_frame)])
    return motion


def test_the_speed_is_that_of_the_wrists_on_average_over_half_a_second():
    turns = np.full(60, 3.0)
    speed = hand_speed.speed(swinging(turns))
    chord_m = 2 * FOREARM_M * np.sin(np.radians(3.0) / 2)
    np.testing.assert_allclose(speed, chord_m * FPS / 2)  # the other hand is still
    once = np.zeros(60)
    once[30] = 3.0
    speed = hand_speed.speed(swinging(once))
    moving = np.flatnonzero(speed > 1e-9)
    assert (moving[0], moving[-1]) == (25, 35)
    np.testing.assert_allclose(speed[moving], chord_m * FPS / 2 / 11)


def test_a_body_that_walks_with_still_hands_has_still_hands():
    motion = skeleton.standing(40, FPS)
    motion["root_x_m"] = np.linspace(0.0, 3.0, 40)
    assert hand_speed.speed(motion).max() < 1e-12


@pytest.mark.parametrize("n_frames", [1, 2])
def test_records_of_one_or_two_frames_have_a_speed(n_frames):
    assert hand_speed.speed(skeleton.standing(n_frames, FPS)).tolist() == [0.0] * n_frames


def test_scores_are_those_of_each_draw_and_part():
    rng = np.random.default_rng(1)
    turns = rng.exponential(2.0, 399)
    original = swinging(turns)
    draws = [original, swinging(turns[::-1].copy()), skeleton.standing(400, FPS), original.iloc[:0]]
    named = {"system": "s", "variant": "main", "record": "r"}
    table = hand_speed.scores(named, original, draws, 3.0, 1.5)
    tables.validate(table, "motion_scores", "scores")
    assert table["draw"].tolist() == [0, 0, 1, 1, 2, 2]
    by = table.set_index(["draw", "part"])
    assert by.loc[(0, "whole"), "value"] == pytest.approx(1.0)
    one, other = (hand_speed.speed(draws[k])[60:370] for k in (0, 1))
    assert by.loc[(1, "interior"), "value"] == pytest.approx(np.corrcoef(one, other)[0, 1])
    assert by.loc[(1, "interior"), "duration_s"] == pytest.approx(15.5)
    assert by.loc[2, "value"].isna().all()  # hands that do not move


def test_scores_of_the_motion_join_those_of_the_phrases_seen_in_it():
    rows = [
        {"system": system, "variant": "main", "record": "r", "phrases": phrases, "draw": 0, "actor": "a"}
        | {"measure": "kappa", "part": "whole", "gesture": None, "bin_s": np.nan, "value": 0.5}
        | {"n_actual": 3, "n_synthesised": 4, "duration_s": 20.0}
        for system, phrases in (("s", "planned"), ("s", "seen"), ("failed", "planned"))
    ]
    made = [
        {"system": system, "variant": "main", "record": "r", "draw": 0, "measure": "hand_speed_r", "part": "whole"}
        | {"value": 0.25, "duration_s": 20.0}
        for system in ("s", "failed")
    ]
    joined = scores.with_motion(pd.DataFrame(rows), [pd.DataFrame(made)], {"r": "a"})
    tables.validate(joined, "record_scores", "scores")
    added = joined[joined["measure"] == "hand_speed_r"]
    assert added[["system", "phrases", "actor", "value"]].to_numpy().tolist() == [["s", "seen", "a", 0.25]]
    assert added["n_actual"].isna().all()
    assert joined["n_actual"].dropna().tolist() == [3, 3, 3]
