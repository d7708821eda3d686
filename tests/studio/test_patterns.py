"""The world of head gestures: what is planted is found in long records, and nothing of it at coupling 0."""

import numpy as np
import pandas as pd
import parselmouth
import pytest

from cospeech.data import segments, tables
from cospeech.data.rng import random_source
from cospeech.geometry import rotation
from cospeech.motion import head
from cospeech.studio import features, head_gestures, movements, performance, scenes, talking, voice, worlds

FRAME_S, SEED, LONG_S, FPS = 0.025, 2012, 1800.0, 30.0
GESTURES = (*head_gestures.GESTURES, head_gestures.REST)


def scene(world="patterns", coupling=0.8, duration_s=60.0, record="r", actor="ada", head=None):
    someone = scenes.player(actor, world, SEED, FRAME_S, 10.0)
    return scenes.write(someone, record, duration_s, worlds.couplings(world, coupling, {}, head), FRAME_S, SEED)


@pytest.fixture(scope="module")
def hours():
    """Scenes of one hour at several couplings."""
    return {coupling: scene(coupling=coupling, duration_s=LONG_S, record="long") for coupling in (0.0, 0.5, 1.0)}


def labels(table, names):
    return np.array([names.index(label) for label in segments.to_labels(table)])


def information(planted, shift=0):
    """Return the mutual information of movements and head gestures, the head ``shift`` frames earlier.

    It is a share of the entropy of the gestures.
    """
    spoken = labels(planted.movements, (*movements.CONTOURS, movements.NONE))
    moved = labels(planted.heads, GESTURES)
    joint = np.zeros((6, 6))
    np.add.at(joint, (np.roll(spoken, -shift), moved), 1.0 / len(moved))
    apart = np.outer(joint.sum(axis=1), joint.sum(axis=0))
    known = joint > 0
    share = joint.sum(axis=0)
    return (joint[known] * np.log(joint[known] / apart[known])).sum() / -(share * np.log(share)).sum()


def test_all_speech_consists_of_movements_over_several_syllables(hours):
    planted = hours[1.0]
    own = planted.syllables
    spoken = planted.movements[planted.movements["label"] != movements.NONE]
    row = segments.at_times(planted.movements, own["peak_s"].to_numpy())
    assert planted.movements["label"].to_numpy()[row].tolist().count(movements.NONE) == 0
    counts = np.bincount(row, minlength=len(planted.movements))[spoken.index]
    # A stretch may be shorter than a movement, and its last movement takes up the remainder.
    assert counts.max() <= movements.MOST + movements.FEWEST - 1
    assert (counts >= movements.FEWEST).mean() > 0.9
    edges_s = np.append(own["start_s"], own["end_s"])
    assert max(np.abs(edges_s - start).min() for start in spoken["start_s"]) <= FRAME_S / 2 + 1e-9


def test_movements_follow_the_habits_of_the_actor(hours):
    names = list(movements.CONTOURS)
    sequence = [names.index(label) for label in hours[1.0].movements["label"] if label != movements.NONE]
    counts = np.zeros((len(names), len(names)))
    np.add.at(counts, (sequence[:-1], sequence[1:]), 1)
    likely = movements.habits("ada", SEED)
    expected = counts.sum(axis=1, keepdims=True) * likely
    deviation = (counts - expected) / np.sqrt(np.maximum(expected * (1 - likely), 1e-12))
    assert np.all(counts[expected == 0] == 0)
    assert np.abs(deviation[expected > 0]).max() < 4.0


@pytest.mark.parametrize("coupling", [0.5, 1.0])
def test_coupling_is_the_share_of_joint_patterns_that_are_heard(hours, coupling):
    coupled = hours[coupling].joints["coupled"]
    assert abs(coupled.mean() - coupling) < 0.05


def test_a_gesture_is_the_one_that_its_movement_is_joined_with(hours):
    joined = head_gestures.habits("ada", SEED).joined
    assert sorted(joined.values()) == sorted(head_gestures.GESTURES)
    for planted in hours.values():
        joints = planted.joints
        assert (joints["melody"].map(joined) == joints["head"]).all()
        starts = planted.heads.loc[planted.heads["label"] != head_gestures.REST, ["start_s", "label"]]
        assert starts["start_s"].to_numpy() == pytest.approx(joints["head_start_s"].to_numpy(), abs=1e-9)
        assert starts["label"].tolist() == joints["head"].tolist()
        heard = joints[joints["coupled"]]
        spoken = planted.movements.set_index("start_s")["label"]
        assert (spoken.loc[heard["melody_start_s"]].to_numpy() == heard["melody"].to_numpy()).all()


def test_lags_vary_about_that_of_the_actor(hours):
    joints, own = hours[1.0].joints, head_gestures.habits("ada", SEED).lag_s
    assert joints["lag_s"].mean() == pytest.approx(own, abs=0.005)
    assert joints["lag_s"].std() == pytest.approx(head_gestures.LAG_SPREAD_S, rel=0.15)
    assert (joints["melody_start_s"] - joints["head_start_s"]).to_numpy() == pytest.approx(joints["lag_s"].to_numpy())
    found = max(range(20), key=lambda shift: information(hours[1.0], shift))
    assert abs(found * FRAME_S - own) <= FRAME_S


def test_at_coupling_0_the_head_tells_nothing_about_the_voice(hours):
    own = head_gestures.habits("ada", SEED).lag_s
    shift = round(own / FRAME_S)
    assert information(hours[1.0], shift) > 0.75
    assert 0.15 < information(hours[0.5], shift) < 0.5
    apart = [information(hours[0.0], shift + shifted) for shifted in range(4000, 40000, 2000)]
    assert abs(information(hours[0.0], shift) - np.mean(apart)) < 4.0 * np.std(apart) + 1e-4


def test_the_head_moves_alike_at_every_coupling(hours):
    """Its gestures have the same shares of time, so that nothing but the relation to speech depends on coupling."""
    shares = [np.bincount(labels(planted.heads, GESTURES)) / (LONG_S / FRAME_S) for planted in hours.values()]
    assert np.ptp(shares, axis=0).max() < 0.03


def test_the_first_frame_is_neutral_and_gestures_turn_the_head_where_they_say():
    planted = scene(duration_s=600.0)
    angles = performance.head_angles("ada", planted, FPS, SEED)
    assert np.all(angles[0] == 0.0)
    own = head_gestures.habits("ada", SEED)
    times_s = segments.frame_times(len(angles), FPS)
    for gesture, (axis, sign) in head_gestures.AXES.items():
        rows = planted.heads[(planted.heads["label"] == gesture) & (planted.heads["end_s"] < 599.0)]
        if gesture == "nod":
            tops = [angles[(times_s >= a) & (times_s < b), 0].max() for a, b in rows[["start_s", "end_s"]].to_numpy()]
        else:
            tops = np.interp((rows["start_s"] + rows["end_s"]) / 2, times_s, angles[:, axis])
        assert len(tops) > 20
        assert np.mean(tops) == pytest.approx(own.places_deg[gesture][axis], abs=2.0)
        assert np.sign(np.mean(tops)) == sign
    ends = planted.heads["end_s"].to_numpy()[:-1]
    between = np.column_stack([np.interp(ends, times_s, angle) for angle in angles.T])
    assert np.abs(between).mean() < 1.0


def test_the_body_turns_its_head_as_planted():
    planted = scene(duration_s=20.0)
    moved = performance.perform("ada", "r", planted, FPS, SEED)
    assert head.angles(moved) == pytest.approx(performance.head_angles("ada", planted, FPS, SEED), abs=1e-9)


@pytest.mark.parametrize("world", ["phrases", "vigour", "syllables", "all"])
def test_the_head_of_every_world_can_be_joined_with_its_pitch(world):
    """All but the head stays as it is without, and where there are subunits of the head, they are added."""
    without, joined = scene(world, duration_s=30.0), scene(world, duration_s=30.0, head=1.0)
    for attribute in ("gestures", "prosody", "syllables", "spoken", "shown", "subunits"):
        one, other = getattr(without, attribute), getattr(joined, attribute)
        assert one is other is None or pd.testing.assert_frame_equal(one, other) is None
    assert without.heads is without.joints is without.movements is None
    assert joined.joints["coupled"].all()
    assert len(joined.joints) > 3
    still, moved = (performance.perform("ada", "r", one, 20.0, SEED) for one in (without, joined))
    others = [name for name in still.columns if not name.startswith(("head_", "neck_"))]
    pd.testing.assert_frame_equal(still[others], moved[others])
    assert np.ptp(head.angles(moved), axis=0).max() > 12.0


def test_in_the_world_of_phrases_some_intonation_phrases_are_no_movements():
    planted = scene("phrases", duration_s=120.0, head=0.8)
    labelled = planted.movements.merge(planted.prosody, on="start_s", suffixes=("", "_pattern"))
    assert len(labelled) == len(planted.movements)
    named = labelled[labelled["label"] != movements.NONE]
    assert (named["label"].map(movements.CONTOURS) == named["label_pattern"]).all()
    assert set(labelled.loc[labelled["label"] == movements.NONE, "label_pattern"]) <= {"p1", "p6", "p8"}
    assert named["end_s"].to_numpy() == pytest.approx(
        named["start_s"].map(planted.prosody.set_index("start_s")["end_s"]).to_numpy()
    )


def test_tables_follow_their_schemas_and_give_back_the_scene(tmp_path):
    planted = scene(duration_s=60.0)
    whole = scenes.tables([planted, scene(duration_s=60.0, record="s")])
    for name in ("melody_patterns", "head_patterns", "head_joints"):
        tables.validate(whole[name], scenes.TABLES[name][1], name)
    again = scenes.of_record(whole, "r")
    for attribute in ("movements", "heads", "joints"):
        pd.testing.assert_frame_equal(getattr(again, attribute), getattr(planted, attribute))
    habits = head_gestures.truth({"ada": head_gestures.habits("ada", SEED)})
    tables.validate(habits, "head_habits", "habits")
    poses = talking.poses(performance.head_angles("ada", planted, FPS, SEED), FPS, "r", SEED)
    tables.validate(poses, "head_pose", "poses")
    assert np.all(poses[["x_deg", "y_deg", "z_deg", "tx_m", "ty_m", "tz_m"]].iloc[0] == 0.0)


def test_the_simulated_melody_follows_the_movements():
    planted = scene(duration_s=300.0)
    melody = features.melody("r", planted, 200.0, SEED)
    tables.validate(melody, "melody", "melody")
    times_s = melody["time_s"].to_numpy()
    named = planted.movements["label"].to_numpy()[segments.at_times(planted.movements, times_s)]
    assert np.array_equal(melody["active"], named != movements.NONE)
    mean = melody.groupby(named)[["pitch", "intensity"]].mean()
    assert mean["pitch"].idxmax() == "r4"
    assert mean["intensity"].idxmin() == "r1"
    rising = melody["pitch"].rolling(20, center=True).mean().diff().groupby(named).mean()
    assert rising["r1"] > 0.005 > -0.005 > rising["r2"]
    voiceless = melody.loc[~melody["active"], "pitch"]
    assert (voiceless.mean(), voiceless.std()) == pytest.approx((0.0, 1.0), abs=0.05)
    five = np.lib.stride_tricks.sliding_window_view(melody["pitch"].to_numpy(), 5) @ [-0.2, -0.1, 0.0, 0.1, 0.2]
    assert melody["d_pitch"].to_numpy()[2:-2] == pytest.approx(five)


def test_the_movements_are_in_the_voice():
    """The pitch that Praat measures in the sound of a record is the planted one."""
    planted = scene(duration_s=12.0)
    sound, prosody = voice.speak("r", planted.prosody, "Female1", "memory", FRAME_S, SEED, planted.delivery())
    track = parselmouth.Sound(sound, voice.RATE_HZ).to_pitch(0.01, 75.0, 500.0)
    found = np.array([track.get_value_at_time(at) for at in prosody["time_s"]])
    both = ~np.isnan(found) & prosody["lag_s"].notna().to_numpy()
    assert both.mean() > 0.3
    away_st = 12.0 * np.abs(np.log2(found[both] * prosody["lag_s"].to_numpy()[both]))
    assert np.median(away_st) < 0.3


def test_blinks_last_a_quarter_second_and_the_mouth_follows_the_voice():
    times_s = segments.frame_times(1800, FPS)
    shut = talking.blinks(times_s, random_source(1, "blinks"))
    assert shut.min() == 0.0
    assert 0.9 < shut.max() <= 1.0
    starts = np.count_nonzero(np.diff((shut > 0).astype(int)) == 1)
    assert 10 <= starts <= 40
    assert (shut > 0).mean() == pytest.approx(starts * talking.BLINK_S / 60.0, rel=0.1)
    samples = np.concatenate([np.zeros(16000), 0.12 * np.sin(np.arange(16000) * 0.1)])
    mouth = talking.opening(samples, 16000, segments.frame_times(60, FPS))
    assert mouth[:28].max() == 0.0
    assert mouth[32:].min() > 0.9


def test_poses_displace_the_head_as_its_neck_does():
    angles = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    poses = talking.poses(np.repeat(angles, 1, axis=0), FPS, "r", SEED)
    turned = rotation.from_euler("XYZ", angles[1])
    assert turned @ [0.0, 0.0, 1.0] @ [0.0, 1.0, 0.0] < 0  # a nod is downward
    assert poses["tz_m"].iloc[1] > 0.03  # and brings the head forward
    assert abs(poses["tx_m"].iloc[1]) < 0.01
