"""Stretching and joining: the shortest arc, the ends, and the recorded motion that is kept."""

import numpy as np
import pandas as pd
import pybvh
import pytest
from dancer import motion, phrases
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from cospeech.data import segments
from cospeech.formats import bvh
from cospeech.geometry import rotation
from cospeech.motion import assembly, skeleton, smoothing, unit_selection

FPS = 20.0


def turns(*degrees, axis=0):
    """Rotations about one axis of one joint, (n, 1, 3, 3)."""
    angles = np.zeros((len(degrees), 1, 3))
    angles[:, 0, axis] = degrees
    return skeleton.rotations(angles)


def made(filter="none", shown=None):
    motions = {record: motion(200, seed=seed) for seed, record in enumerate(("ada_2", "ada_3"))}
    gestures = pd.concat([phrases(200, seed=k, record=record) for k, record in enumerate(motions)])
    pool = unit_selection.templates(gestures, motions)
    own = motion(150, seed=7, walk_m=0.01, turn_deg=20)
    shown = phrases(150, seed=3) if shown is None else shown
    selected = unit_selection.select(shown, pool, len(own), FPS, 0.5)
    return assembly.motion(selected, pool, motions, own, filter, 5), selected, pool, motions, own


@pytest.mark.parametrize("n_frames", [2, 5, 7, 12])
def test_stretching_keeps_both_ends_and_gives_the_frames_asked_for(n_frames):
    template = turns(10, 40, 30, 80, 20, 5, 60)
    played = assembly.stretch(template, n_frames)
    assert len(played) == n_frames
    assert played[[0, -1]] == pytest.approx(template[[0, -1]])


def test_a_template_of_the_right_length_is_played_as_it_is():
    template = turns(10, 40, 30, 80, 20)
    assert assembly.stretch(template, 5) == pytest.approx(template)


def test_one_frame_shows_the_middle():
    assert assembly.stretch(turns(0, 10, 20, 90, 100), 1) == pytest.approx(turns(20))
    assert assembly.stretch(turns(0, 10), 1) == pytest.approx(turns(5))
    assert assembly.stretch(turns(7), 3) == pytest.approx(turns(7, 7, 7))


def test_stretching_past_180_degrees_does_not_go_round_the_other_way():
    played = assembly.stretch(turns(170, -170), 5)
    assert played == pytest.approx(turns(170, 175, 180, 185, 190))


@given(st.integers(0, 10_000), st.integers(2, 8), st.integers(1, 20))
def test_interpolation_equals_that_of_scipy(seed, n_frames, n_positions):
    rng = np.random.default_rng(seed)
    keys = Rotation.random(n_frames, rng=rng)
    positions = np.sort(rng.uniform(0, n_frames - 1, n_positions))
    found = assembly.interpolate(keys.as_matrix()[:, None], positions)[:, 0]
    other = Slerp(np.arange(n_frames), keys)(positions)
    assert (Rotation.from_matrix(found).inv() * other).magnitude().max() < 1e-9


def test_all_but_arms_and_hands_is_the_records_own_motion():
    table, _, _, _, own = made("exponential")
    kept = [column for column in own if column not in skeleton.angle_columns(assembly.SYNTHESISED)]
    pd.testing.assert_frame_equal(table[kept], own[kept])
    assert list(table) == list(own)


def test_arms_are_the_templates_stretched_to_their_phrases():
    table, selected, pool, motions, _ = made("none")
    arms = skeleton.rotations(skeleton.angles(table, assembly.SYNTHESISED))
    spans = pool.table.set_index(["record", "segment"])
    for unit in selected.itertuples():
        first, end = spans.loc[(unit.template_record, unit.template_segment), ["first_frame", "end_frame"]]
        template = skeleton.rotations(skeleton.angles(motions[unit.template_record], assembly.SYNTHESISED))[first:end]
        wanted = assembly.stretch(template, unit.end_frame - unit.start_frame)
        assert arms[unit.start_frame : unit.end_frame] == pytest.approx(wanted, abs=1e-9)


def test_smoothing_takes_the_jumps_out_and_leaves_the_middle_of_phrases():
    rough, selected, *_ = made("none")
    smoothed = made("exponential")[0]
    joints = skeleton.angle_columns(assembly.SYNTHESISED)
    starts = assembly.boundaries(selected)
    before, after = (np.abs(table[joints].diff().to_numpy()) for table in (rough, smoothed))
    within = np.ones(len(rough), dtype=bool)
    within[[0, *starts]] = False
    jumps = before[starts] > before[within].max()  # larger than any jump inside a phrase
    assert jumps.any()
    assert (after[starts][jumps] < 0.4 * before[starts][jumps]).all()
    far = smoothing.influence(starts, len(rough), 5) == 0
    pd.testing.assert_frame_equal(rough[far], smoothed[far])


def world_turns(table):
    """The angles in radians that arms and forearms turn by in the world from frame to frame, (T - 1, 4)."""
    turned, _ = skeleton.chain(table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(table))
    arms = turned[:, [skeleton.JOINTS.index(name) for name in skeleton.ARM_JOINTS]]
    return np.radians(rotation.angles_deg(np.swapaxes(arms[:-1], -1, -2) @ arms[1:]))


def test_blended_units_do_not_jump_and_move_no_faster_than_their_templates():
    blended, selected, *_ = made(assembly.VELOCITY_PRESERVING)
    rough = made("none")[0]
    starts = assembly.boundaries(selected)
    turned, cut = world_turns(blended), world_turns(rough)
    inside = np.setdiff1d(np.arange(len(cut)), starts - 1)
    assert (turned[inside] <= cut[inside] + 1e-9).all()
    assert turned.max() <= cut[inside].max() + 1e-9 < cut.max()
    kept = [column for column in blended if column not in skeleton.angle_columns(assembly.SYNTHESISED)]
    pd.testing.assert_frame_equal(blended[kept], rough[kept])


def test_a_single_unit_is_blended_into_nothing():
    shown = segments.from_starts("ada_1", [0], ["left"], 150, FPS)
    blended, rough = (
        skeleton.rotations(skeleton.angles(made(name, shown)[0])) for name in (assembly.VELOCITY_PRESERVING, "none")
    )
    assert blended == pytest.approx(rough, abs=1e-9)


def test_a_class_that_nobody_shows_is_bridged():
    shown = segments.from_starts("ada_1", [0, 40, 80, 120], ["never", "rest", "never", "left"], 150, FPS)
    table, selected, *_ = made("none", shown)
    arms = skeleton.rotations(skeleton.angles(table, assembly.SYNTHESISED))
    assert np.ptp(arms[:41], axis=0).max() < 1e-9  # no pose before it: the first known one is held
    ends = arms[[79, 120]]
    assert arms[80:120] == pytest.approx(assembly.interpolate(ends, np.arange(1, 41) / 41), abs=1e-9)
    assert selected["template_record"].isna().tolist() == [True, False, True, False]


def test_trial_shows_every_filter_around_the_widest_jump():
    _, selected, pool, motions, own = made()
    angles = assembly.join(selected, pool, motions, len(own))
    starts = assembly.boundaries(selected)
    table = assembly.trial(angles, starts, 5, FPS)
    assert tuple(table["filter"].unique()) == smoothing.FILTERS
    jump = np.abs(angles[starts] - angles[starts - 1])
    row = table[table["filter"] == "none"]
    at = round(row["boundary_s"].iloc[0] * FPS)
    raw = row.set_index("frame")["angle_deg"]
    assert abs(raw[at] - raw[at - 1]) == pytest.approx(jump.max())
    assert table["time_s"].to_numpy() == pytest.approx((table["frame"] + 0.5) / FPS)


def test_trial_without_a_boundary_is_empty():
    assert assembly.trial(np.zeros((30, 6, 3)), np.array([], dtype=np.int64), 5, FPS).empty


def test_synthesised_motion_survives_another_programs_bvh_reader(tmp_path):
    table, *_ = made("exponential")
    bvh.write(table, tmp_path / "motion.bvh")
    other = pybvh.read_bvh_file(tmp_path / "motion.bvh", world_up="+y")
    placed = skeleton.forward(table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(table))
    read = {node.name: index for index, node in enumerate(other.nodes)}
    for name in skeleton.JOINTS:
        assert other.node_positions()[:, read[name]] == pytest.approx(placed[name], abs=1e-5)
