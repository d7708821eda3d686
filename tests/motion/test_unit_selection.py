"""Unit selection against its definition: brute force over all sequences, and the printed penalties."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from dancer import motion, phrases
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.motion import skeleton, unit_selection

OTHERS = ("ada_2", "ada_3")


def training(n_frames=200):
    motions = {record: motion(n_frames, seed=seed) for seed, record in enumerate(OTHERS)}
    tables = [phrases(n_frames, seed=seed, record=record) for seed, record in enumerate(OTHERS)]
    return pd.concat(tables, ignore_index=True), motions


@pytest.mark.parametrize("seed", range(300))
def test_path_costs_what_the_best_of_all_sequences_costs(seed):
    rng = np.random.default_rng(seed)
    pool, length = rng.integers(1, 7), rng.integers(1, 6)
    candidates = [np.sort(rng.choice(pool, rng.integers(1, pool + 1), replace=False)) for _ in range(length)]
    penalties = [rng.uniform(0, 2, len(options)) for options in candidates]
    jump, weight = rng.uniform(0, 3, (pool, pool)), rng.choice([0.0, 0.3, 0.5, 1.0])

    def cost(places):
        total = penalties[0][places[0]]
        for step in range(1, length):
            before, here = candidates[step - 1][places[step - 1]], candidates[step][places[step]]
            total += weight * jump[before, here] + (1 - weight) * penalties[step][places[step]]
        return total

    found = unit_selection.cheapest_path(candidates, penalties, lambda j, k: jump[np.ix_(j, k)], weight)
    assert found.cost == pytest.approx(min(map(cost, product(*map(range, map(len, candidates))))), abs=1e-12)
    places = [list(options).index(k) for options, k in zip(candidates, found.template, strict=True)]
    assert cost(places) == pytest.approx(found.cost, abs=1e-12)


def test_jump_goes_the_short_way_round():
    ends, begins = np.radians([[179.0, 0.0], [0.0, 0.0]]), np.radians([[-179.0, 0.0], [3.0, 364.0]])
    assert np.degrees(unit_selection.jumps(ends, begins)) == pytest.approx(
        np.array([[2, np.hypot(176, 4)], [179, 5]])
    )


@given(st.integers(0, 50), st.sampled_from([12.5, 20.0, 29.97, 30.0]), st.integers(1, 90))
def test_frames_belong_to_the_phrase_that_holds_their_centre(seed, fps, n_frames):
    table = phrases(120, 40.0, seed)
    first, end = unit_selection.frame_spans(table, n_frames, fps)
    again = segments.resample(table, n_frames, fps)
    shown = first < end
    assert first[shown].tolist() == again["start_frame"].tolist()
    assert end[shown].tolist() == again["end_frame"].tolist()


def test_units_are_of_their_class_and_of_training_records():
    gestures, motions = training()
    pool = unit_selection.templates(gestures, motions)
    found = unit_selection.select(phrases(200, seed=9), pool, 200, 20.0, 0.5)
    label = gestures.set_index(["record", "segment"])["label"]
    assert set(found["template_record"]) <= set(OTHERS)
    for row in found.itertuples():
        assert label[(row.template_record, row.template_segment)] == row.label


def test_penalties_are_the_printed_ones():
    gestures, motions = training()
    shown = phrases(200, seed=9)
    found = unit_selection.select(shown, unit_selection.templates(gestures, motions), 200, 20.0, 0.5)
    template = gestures.set_index(["record", "segment"]).loc[
        list(zip(found["template_record"], found["template_segment"], strict=True))
    ]
    long = (template["end_s"] - template["start_s"]).to_numpy()
    assert found["duration_penalty"].to_numpy() == pytest.approx(np.abs(shown["end_s"] - shown["start_s"] - long))
    pose = {record: np.radians(skeleton.angles(table, skeleton.ARM_JOINTS)) for record, table in motions.items()}
    begin = [pose[r][f] for r, f in zip(found["template_record"], template["start_frame"], strict=True)]
    end = [pose[r][f - 1] for r, f in zip(found["template_record"], template["end_frame"], strict=True)]
    jumped = [np.linalg.norm(b - e) for e, b in zip(end, begin[1:], strict=False)]
    assert found["continuity_penalty"].to_numpy()[1:] == pytest.approx(jumped)
    assert np.isnan(found["continuity_penalty"].iloc[0])


def test_a_training_record_asked_for_again_comes_back_whole():
    gestures, motions = training()
    wanted = gestures[gestures["record"] == "ada_2"].assign(record="ada_1")
    found = unit_selection.select(wanted, unit_selection.templates(gestures, motions), 200, 20.0, 0.5)
    assert set(found["template_record"]) == {"ada_2"}
    assert found["template_segment"].tolist() == found["segment"].tolist()
    assert found["duration_penalty"].max() == pytest.approx(0)


def test_what_cannot_be_shown_has_no_template():
    gestures, motions = training()
    shown = segments.from_starts("ada_1", [0, 40, 41, 80], ["rest", "left", "never", "open"], 400, 40.0)
    found = unit_selection.select(shown, unit_selection.templates(gestures, motions), 100, 10.0, 0.5)
    missing = found["template_record"].isna().tolist()
    assert missing == [
        False,
        True,
        True,
        False,
    ]  # 40 is too short for a frame at 10 frames/s; 'never' has no template
    assert found["template_segment"].isna().tolist() == missing
    assert found["duration_penalty"].isna().tolist() == missing
    line = unit_selection.summary(found, 0.5)
    assert "1 phrases are too short" in line
    assert "bridged, as no training record shows their class: never" in line


def test_the_held_out_record_is_no_template():
    gestures, motions = training()
    held_out = pd.concat([gestures, phrases(200, record="ada_1")])
    with pytest.raises(UserError, match="'ada_1', which has no motion among the training records"):
        unit_selection.templates(held_out, motions)


def test_nothing_to_show_is_said():
    gestures, motions = training()
    with pytest.raises(UserError, match="no gesture of its phrases occurs"):
        unit_selection.select(
            phrases(200, labels=("never",)), unit_selection.templates(gestures, motions), 200, 20.0, 0.5
        )


def test_summary_adds_up_the_penalties():
    gestures, motions = training()
    shown, pool = phrases(200, seed=9), unit_selection.templates(gestures, motions)
    found = unit_selection.select(shown, pool, 200, 20.0, 0.3)
    label = pool.table["label"].to_numpy()
    candidates = [np.flatnonzero(label == wanted) for wanted in shown["label"]]
    long = pool.table["duration_s"].to_numpy()
    penalties = [
        np.abs(wanted - long[options])
        for wanted, options in zip(shown["end_s"] - shown["start_s"], candidates, strict=True)
    ]
    best = unit_selection.cheapest_path(
        candidates, penalties, lambda j, k: unit_selection.jumps(pool.end[j], pool.begin[k]), 0.3
    )
    assert unit_selection.summary(found, 0.3) == f"{len(shown)} units at a total penalty of {best.cost:.6f}"
