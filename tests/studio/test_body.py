"""Motion of the body: limbs reach their targets, gestures match their class, and no joint bends the wrong way."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import segments, tables
from cospeech.data.vocabulary import GESTURES
from cospeech.motion import skeleton
from cospeech.motion.skeleton import JOINTS, OFFSET_M
from cospeech.studio import cast, choreography, motion, script
from cospeech.studio.limbs import STRETCH, reach

FPS = 20.0
FRAME_S = 0.025


@pytest.fixture(scope="module", params=["ada", "deniz"])
def performance(request):
    """Ten minutes of one actor: gestures, prosody, motion and joint positions."""
    someone = cast.member(request.param, 2012, FRAME_S, 10.0)
    gestures, prosody = script.write(someone, "ten", 600.0, 0.8, FRAME_S, 2012)
    moved = motion.perform(request.param, "ten", gestures, prosody, FPS, 2012)
    root = moved[list(skeleton.ROOT_COLUMNS)].to_numpy()
    return gestures, prosody, moved, skeleton.forward(root, skeleton.angles(moved))


def angle(moved, joint):
    return skeleton.angles(moved)[:, JOINTS.index(joint)]


def strokes(gestures, label):
    """Return the frames in the middle fifth of each phrase of a class that lasts at least 1.5 s."""
    frames = []
    for start, end in gestures.loc[gestures["label"] == label, ["start_s", "end_s"]].itertuples(index=False):
        if end - start >= 1.5:
            middle, width = (start + end) / 2, (end - start) / 10
            frames.extend(range(int((middle - width) * FPS), int((middle + width) * FPS) + 1))
    return np.array(frames)


directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).map(np.array)


@settings(max_examples=200, deadline=None)
@given(
    line=directions.filter(lambda v: np.linalg.norm(v) > 0.2),
    pole=directions.filter(lambda v: np.linalg.norm(v) > 0.2),
    share=st.floats(0.36, 1.3),
    bends=st.sampled_from(["forward", "backward"]),
)
def test_a_limb_ends_at_its_target_and_bends_its_natural_way(line, pole, share, bends):
    line = line / np.linalg.norm(line)
    across = pole - (pole @ line) * line
    if np.linalg.norm(across) < 0.05:  # the pole must not be parallel to the line
        return
    upper, lower = 0.29, 0.25
    target = share * (upper + lower) * line
    rotation, hinge = reach(target[None], pole[None], upper, lower, bends)
    assert hinge[0] < 0 if bends == "forward" else hinge[0] > 0
    np.testing.assert_allclose(rotation[0] @ rotation[0].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(rotation[0]) > 0
    bent = rotation[0] @ skeleton.rotations(np.array([[hinge[0], 0.0, 0.0]]))[0]
    middle = rotation[0] @ [0, -upper, 0]
    end = middle + bent @ [0, -lower, 0]
    expected = line * min(share, STRETCH) * (upper + lower)
    np.testing.assert_allclose(end, expected, atol=1e-6)
    assert middle @ across >= -1e-9


def test_minimum_jerk_rests_at_its_keyframes_and_peaks_at_15_eighths():
    times = np.array([0.0, 1.0, 3.0])
    values = np.array([[0.0], [2.0], [-1.0]])
    at = np.linspace(-0.5, 3.5, 40001)
    course = choreography.minimum_jerk(times, values, at)[:, 0]
    np.testing.assert_allclose(np.interp(times, at, course), values[:, 0], atol=1e-8)
    speed = np.gradient(course, at)
    np.testing.assert_allclose(np.interp(times, at, speed), 0.0, atol=1e-3)
    # A minimum-jerk movement peaks at 15 / 8 of its mean speed (Flash and Hogan 1985).
    np.testing.assert_allclose(np.abs(speed).max(), 15 / 8 * 2.0, rtol=1e-4)


def test_motion_matches_its_schema_and_is_reproducible():
    someone = cast.member("ada", 1, FRAME_S, 10.0)
    made = [
        motion.perform("ada", "a", *script.write(someone, "a", 20.0, 0.8, FRAME_S, 1), fps=fps, seed=1)
        for fps in (20.0, 20.0, 30.0)
    ]
    tables.validate(made[0], "motion", "x")
    pd.testing.assert_frame_equal(made[0], made[1])
    assert len(made[0]) == 400
    # Another frame rate samples the same movement.
    at = np.interp(made[2]["time_s"][30:570], made[0]["time_s"], made[0]["left_forearm_x_deg"])
    assert np.abs(at - made[2]["left_forearm_x_deg"][30:570]).mean() < 1.0


def test_elbows_and_knees_bend_only_their_natural_way(performance):
    _, _, moved, _ = performance
    for side in ("left", "right"):
        assert angle(moved, f"{side}_forearm")[:, 0].min() > -141
        assert angle(moved, f"{side}_forearm")[:, 0].max() < -5
        knee = angle(moved, f"{side}_shin")
        assert 2 < knee[:, 0].min() <= knee[:, 0].max() < 30
        assert not knee[:, 1:].any()


def test_joint_angles_stay_in_natural_ranges_and_away_from_gimbal_lock(performance):
    _, _, moved, _ = performance
    for side in ("left", "right"):
        assert np.abs(angle(moved, f"{side}_arm")[:, 2]).max() < 80
        assert np.abs(angle(moved, f"{side}_forearm")[:, 1]).max() < 110
    for joint, limit in {"hips": 6, "spine": 12, "chest": 14, "neck": 15, "head": 25}.items():
        assert np.abs(angle(moved, joint)).max() < limit
    assert np.abs(np.diff(skeleton.angles(moved), axis=0)).max() < 90  # no jumps by a half or full turn


def test_feet_stay_flat_and_in_place(performance):
    *_, places = performance
    for side, sign in (("left", 1), ("right", -1)):
        spot = np.array([sign * 0.09, 0.95 - 0.03 - 0.85, 0.0])
        np.testing.assert_allclose(places[f"{side}_foot"], np.tile(spot, (len(places["hips"]), 1)), atol=1e-9)
        toes = np.array([*spot[:1], spot[1] - 0.05, 0.18])
        np.testing.assert_allclose(places[f"{side}_foot_tip"], np.tile(toes, (len(places["hips"]), 1)), atol=1e-9)


def test_hips_shift_the_weight_a_little(performance):
    *_, places = performance
    assert 0.01 < np.ptp(places["hips"][:, 0]) < 0.10
    assert np.abs(places["hips"] - OFFSET_M["hips"]).max() < 0.06


def test_hands_move_at_natural_speeds(performance):
    *_, places = performance
    for hand in ("left_hand", "right_hand"):
        speed = np.linalg.norm(np.diff(places[hand], axis=0), axis=1) * FPS
        assert 0.5 < np.quantile(speed, 0.9) < 1.8
        assert np.quantile(speed, 0.999) < 4.0
        assert speed.max() < 5.0


def test_classes_match_table_4_1(performance):
    """The stroke of each class: which hands are up, where they are and how they move (Özkul 2012, Table 4.1)."""
    gestures, _, _, places = performance
    elbow = {side: places[f"{side}_forearm"] for side in ("left", "right")}
    hand = {side: places[f"{side}_hand"] for side in ("left", "right")}
    apart = np.linalg.norm(hand["left"] - hand["right"], axis=1)
    up = {side: hand[side][:, 1] - elbow[side][:, 1] for side in hand}

    both = strokes(gestures, "raise_both")
    assert np.mean((up["left"][both] > -0.12) & (up["right"][both] > -0.12)) > 0.95
    assert np.abs(hand["left"][both, 1] - hand["right"][both, 1]).mean() < 0.05
    rest = strokes(gestures, "rest")
    assert max(up["left"][rest].max(), up["right"][rest].max()) < -0.2
    for side, other in (("left", "right"), ("right", "left")):
        alone = strokes(gestures, side)
        assert np.mean((up[side][alone] > -0.12) & (up[other][alone] < -0.2)) > 0.95
    assert apart[strokes(gestures, "contact")].max() < 0.12
    opened = strokes(gestures, "open")
    assert apart[opened].min() > 0.7
    behind = [hand[side][opened, 2] - places[f"{side}_arm"][opened, 2] for side in hand]
    assert np.mean([part < 0 for part in behind]) > 0.95


def test_perpendicular_moves_one_hand_up_and_down_and_the_other_sideways(performance):
    gestures, _, _, places = performance
    one_up, other_aside = [], []
    for start, end, label in gestures[["start_s", "end_s", "label"]].itertuples(index=False):
        if label == "perpendicular" and end - start > 2.0:
            first, last = (int((start + share * (end - start)) * FPS) for share in (0.3, 0.75))
            spread = [np.ptp(places[hand][first:last], axis=0) for hand in ("left_hand", "right_hand")]
            one_up.append(max(part[1] / part[0] for part in spread))
            other_aside.append(max(part[0] / part[1] for part in spread))
    assert len(one_up) > 8
    assert min(*one_up, *other_aside) > 2


def test_a_phrase_between_rests_starts_and_ends_with_hanging_hands(performance):
    gestures, _, _, places = performance
    labels = gestures["label"].to_numpy()
    alone = np.flatnonzero((labels[:-2] == "rest") & (labels[2:] == "rest") & (labels[1:-1] != "rest")) + 1
    assert len(alone) > 10
    for row in alone:
        phrase = gestures.iloc[row]
        side = "right" if phrase["label"] == "right" else "left"
        shoulder = places[f"{side}_arm"]
        drop = shoulder[:, 1] - places[f"{side}_hand"][:, 1]
        first, middle, last = (
            round(time_s * FPS - 0.5)
            for time_s in (phrase["start_s"], (phrase["start_s"] + phrase["end_s"]) / 2, phrase["end_s"])
        )
        assert min(drop[first], drop[last]) > 0.42
        assert drop[middle] < 0.40


def test_an_accent_comes_with_a_nod():
    someone = cast.member("ada", 1, FRAME_S, 10.0)
    gestures, _ = script.write(someone, "a", 60.0, 0.8, FRAME_S, 1)
    starts = np.arange(0, 2400, 40)
    labels = np.where(np.arange(60) % 2, "p7", "p1").astype(object)
    prosody = segments.from_starts("a", starts, labels, 2400, 1 / FRAME_S)
    moved = motion.perform("ada", "a", gestures, prosody, FPS, 1)
    head = angle(moved, "head")[:, 0] + angle(moved, "neck")[:, 0]
    spoken = np.array(segments.to_labels(segments.resample(prosody, len(moved), FPS)) == "p7")
    assert head[spoken].mean() > head[~spoken].mean() + 1.0


def test_sensor_noise_is_white_with_the_given_deviation_and_only_on_angles(performance):
    _, _, moved, _ = performance
    seen = motion.with_sensor_noise(moved, 0.4, "ten", 2012)
    columns = skeleton.angle_columns()
    noise = (seen[columns] - moved[columns]).to_numpy()
    np.testing.assert_allclose(noise.std(axis=0), 0.4, rtol=0.05)  # standard error 0.6 % with 12,000 frames
    assert abs((noise[1:] * noise[:-1]).mean() / 0.16) < 0.01
    np.testing.assert_array_equal(seen[list(skeleton.ROOT_COLUMNS)], moved[list(skeleton.ROOT_COLUMNS)])
    pd.testing.assert_frame_equal(motion.with_sensor_noise(moved, 0.0, "ten", 2012), moved)


def test_actors_have_individual_styles():
    one, other = (choreography.style(actor, 2012) for actor in ("ada", "deniz"))
    assert one == choreography.style("ada", 2012)
    assert one.beat_s != other.beat_s
    assert one.size != other.size


def test_every_class_has_a_figure():
    assert set(choreography.FIGURES) == set(GESTURES)
