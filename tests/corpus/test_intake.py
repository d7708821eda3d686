"""Motion and speech of a record are trimmed to their common duration; inconsistent records are rejected."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.corpus import intake, motion
from cospeech.corpus.head_angles import HeadConventions
from cospeech.corpus.retarget import MotionConventions
from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.motion import skeleton
from cospeech.speech import melody
from cospeech.workflow.records import RECORD_FIELDS

CONVENTIONS = MotionConventions("y", "m", "cospeech", "hanging")
LABELS = list(vocabulary.GESTURES)


def record_entry(**fields):
    return dict.fromkeys(RECORD_FIELDS) | {"record": "a", "actor": "x"} | fields


def write_bvh(path, seconds, fps=20.0):
    n_frames = round(seconds * fps)
    angles = np.zeros((n_frames, len(skeleton.JOINTS), 3))
    angles[:, skeleton.JOINTS.index("left_arm"), 0] = -np.arange(n_frames) / 10
    bvh.write(skeleton.motion_table(np.zeros((n_frames, 3)), angles, fps), path)
    return str(path)


def write_wav(path, seconds, rate=16000):
    soundfile.write(path, 0.3 * np.sin(np.arange(round(seconds * rate)) / 20), rate)
    return str(path)


def test_a_bvh_file_in_radians_is_refused(tmp_path):
    angles = np.random.default_rng(0).uniform(-0.5, 0.5, (60, len(skeleton.JOINTS), 3))
    for name, unit in (("radians.bvh", 1.0), ("degrees.bvh", 180.0 / np.pi)):
        bvh.write(skeleton.motion_table(np.zeros((60, 3)), unit * angles, 20.0), tmp_path / name)
    with pytest.raises(
        UserError, match=r"no joint turns by more than 0\.\d+ degrees, so the angles seem to be in rad"
    ):
        motion.read(tmp_path / "radians.bvh", CONVENTIONS)
    assert motion.read(tmp_path / "degrees.bvh", CONVENTIONS).notes == []


def read_record(tolerance_s=1.0, skipped_s=0.0, **fields):
    return intake.read_record(
        record_entry(**fields), fields.get("motion"), skipped_s, CONVENTIONS, LABELS, 0.025, tolerance_s
    )


@pytest.mark.parametrize(("body_s", "voice_s"), [(3.0, 3.0), (3.0, 3.4), (3.4, 3.0), (3.05, 3.02)])
def test_motion_and_speech_are_trimmed_to_their_common_duration(tmp_path, body_s, voice_s):
    taken = read_record(motion=write_bvh(tmp_path / "a.bvh", body_s), audio=write_wav(tmp_path / "a.wav", voice_s))
    shared = min(body_s, voice_s)
    row = taken.row.iloc[0]
    assert row["duration_s"] == pytest.approx(shared)
    assert len(taken.voice) == round(shared * 16000)
    assert len(taken.body) == int(shared * 20 + 1e-6)
    assert (row["motion_source"], row["motion_fps"], row["audio_rate_hz"]) == ("bvh", 20.0, 16000)
    longer = "body" if body_s > voice_s else "voice"
    assert row["note"] == (
        None if body_s == voice_s else f"{longer} trimmed by {abs(body_s - voice_s):.3f} s at its end"
    )
    tables.validate(taken.row, "records", "row")
    tables.validate(taken.body, "motion", "body")


def test_durations_that_differ_too_much_are_rejected(tmp_path):
    with pytest.raises(
        UserError, match=r"record 'a': its motion lasts 5.000 s and its sound 3.000 s.*length_tolerance"
    ):
        read_record(motion=write_bvh(tmp_path / "a.bvh", 5), audio=write_wav(tmp_path / "a.wav", 3))
    with pytest.raises(UserError, match="too short"):
        read_record(motion=write_bvh(tmp_path / "a.bvh", 0.5), audio=write_wav(tmp_path / "a.wav", 0.5))


def test_an_excerpt_is_the_same_part_of_motion_and_speech(tmp_path):
    motion, audio = write_bvh(tmp_path / "a.bvh", 10), write_wav(tmp_path / "a.wav", 10)
    whole = read_record(motion=motion, audio=audio)
    part = read_record(motion=motion, audio=audio, start_s=2.5, end_s=6.0)
    assert part.row["duration_s"].iloc[0] == pytest.approx(3.5)
    np.testing.assert_allclose(part.voice, whole.voice[40000:96000])
    np.testing.assert_allclose(skeleton.angles(part.body), skeleton.angles(whole.body)[50:120], atol=1e-6)
    assert part.body["time_s"].iloc[0] == pytest.approx(0.025)
    with pytest.raises(UserError, match=r"a\.bvh: lasts 10.000 s and does not contain.*start_s and end_s"):
        read_record(motion=motion, audio=audio, start_s=2.5, end_s=11.0)


def test_sound_before_the_start_of_the_films_is_skipped(tmp_path):
    motion, audio = write_bvh(tmp_path / "a.bvh", 4), write_wav(tmp_path / "a.wav", 5)
    whole = read_record(motion=motion, audio=audio)
    late = read_record(motion=motion, audio=audio, skipped_s=0.75)
    np.testing.assert_allclose(late.voice[: 3 * 16000], whole.voice[12000 : 12000 + 3 * 16000])
    assert late.row["note"].iloc[0].startswith("sound taken from 0.750 s on, where the films begin")
    part = read_record(motion=motion, audio=audio, skipped_s=0.75, start_s=1.0, end_s=3.0)
    np.testing.assert_allclose(part.voice, late.voice[16000:48000])
    np.testing.assert_allclose(skeleton.angles(part.body), skeleton.angles(late.body)[20:60], atol=1e-6)


def test_joint_angles_from_films_and_markers_name_their_source_files(tmp_path):
    moved = read_record(motion=write_bvh(tmp_path / "a.bvh", 5), audio=write_wav(tmp_path / "a.wav", 5)).body
    moved.to_parquet(tmp_path / "motion.parquet")
    for field, path, source in (("views", "films/a", "video"), ("motion", "a.c3d", "markers")):
        entry = record_entry(audio=str(tmp_path / "a.wav"), **{field: path})
        row = intake.read_record(
            entry, str(tmp_path / "motion.parquet"), 0.0, CONVENTIONS, LABELS, 0.025, 1.0
        ).row.iloc[0]
        assert (row["motion_source"], row["motion_path"], row["motion_fps"]) == (source, path, 20.0)


def test_adjacent_excerpts_share_no_frame_and_lose_none(tmp_path):
    motion, audio = write_bvh(tmp_path / "a.bvh", 10, 30.0), write_wav(tmp_path / "a.wav", 10)
    cuts = [0.0, 2.51, 5.0, 7.777, None]
    parts = [read_record(motion=motion, audio=audio, start_s=start, end_s=end) for start, end in pairwise(cuts)]
    arm = np.concatenate([part.body["left_arm_x_deg"] for part in parts])
    # an excerpt whose sound is a fraction of a frame shorter than its motion loses its last frame
    assert set(np.round(np.diff(arm), 3)) <= {-0.1, -0.2}
    assert sum(len(part.voice) for part in parts) == pytest.approx(160000, abs=4 * 16000 / 30)


def test_stereo_at_another_rate_is_converted_and_noted(tmp_path):
    tone = 0.3 * np.sin(np.arange(24000) / 10)
    soundfile.write(tmp_path / "a.wav", np.column_stack([tone, tone]), 8000)
    taken = read_record(motion=write_bvh(tmp_path / "a.bvh", 3), audio=str(tmp_path / "a.wav"))
    note = taken.row["note"].iloc[0]
    assert "2 channels mixed down to one" in note
    assert "resampled from 8000 Hz" in note
    assert taken.row["audio_rate_hz"].iloc[0] == 8000


def test_the_channel_of_a_record_is_taken_and_noted(tmp_path):
    left, right = (0.3 * np.sin(np.arange(48000) / period) for period in (10, 20))
    soundfile.write(tmp_path / "a.wav", np.column_stack([left, right]), 16000)
    files = {"motion": write_bvh(tmp_path / "a.bvh", 3), "audio": str(tmp_path / "a.wav")}
    taken = read_record(**files, channel=2)
    np.testing.assert_allclose(taken.voice, right, atol=1 / 32768)
    assert taken.row["note"].iloc[0] == "only channel 2 used"


def test_user_supplied_tables_replace_motion_and_sound(tmp_path):
    rng = np.random.default_rng(0)
    table = tables.pd.DataFrame({"frame": np.arange(400), "time_s": segments.frame_times(400, 40.0)})
    for name, spread in (("intensity", 1.7), ("pitch_lag", 0.005), ("pitch_gain", 1.0)):
        table[name] = rng.uniform(-spread, spread, 400)
        table[f"d_{name}"] = table[name].diff().fillna(0.0)
    table.to_csv(tmp_path / "p.csv", index=False)
    phrases = segments.from_starts("a", [0, 50, 90], ["rest", "left", "rest"], 202, 20.0)
    phrases.to_csv(tmp_path / "g.csv", index=False)
    spoken = tables.pd.DataFrame({"peak_s": [0.5, 1.95, 2.05, 4.9, 9.9]})
    spoken = spoken.assign(start_s=spoken["peak_s"] - 0.04, end_s=spoken["peak_s"] + 0.05)
    spoken = spoken.assign(known_s=spoken["peak_s"] + 0.12, f0_hz=180.0, intensity_db=-30.0)
    spoken.to_csv(tmp_path / "s.csv", index=False)
    files = {name: str(tmp_path / f"{name[0]}.csv") for name in ("gestures", "prosody", "syllables")}
    taken = read_record(**files)
    tables.validate(taken.syllables, "syllables", "voice")
    assert len(taken.syllables) == 5
    assert taken.syllables["known_s"].iloc[-1] == pytest.approx(10.0)  # nobody listens after the end
    assert taken.row["duration_s"].iloc[0] == pytest.approx(10.0)
    assert taken.row["motion_source"].iloc[0] is None
    assert taken.body["end_frame"].tolist() == [50, 90, 200]
    tables.validate(taken.body, "segments", "body")
    tables.validate(taken.voice, "prosody", "voice")
    part = read_record(**files, start_s=2.0, end_s=5.0)
    assert part.body["label"].tolist() == ["rest", "left", "rest"]
    assert part.body["start_frame"].tolist() == [0, 10, 50]
    assert len(part.voice) == 120
    assert part.voice["intensity"].iloc[0] == pytest.approx(table["intensity"].iloc[80])
    np.testing.assert_allclose(part.syllables["peak_s"], [0.05, 2.9])
    np.testing.assert_allclose(part.syllables["start_s"], [0.01, 2.86])
    assert part.syllables["syllable"].tolist() == [0, 1]
    assert read_record(gestures=files["gestures"], prosody=files["prosody"]).syllables is None


@given(st.lists(st.integers(1, 30), min_size=1, max_size=12), st.integers(0, 100), st.integers(1, 200))
@settings(max_examples=200, deadline=None)
def test_cut_segments_have_the_labels_of_the_selected_frames(lengths, first, width):
    labels = np.repeat(np.arange(len(lengths)), lengths)
    table = segments.from_labels("a", labels.astype(str), 25.0)
    first = min(first, len(labels) - 1)
    last = min(first + width, len(labels))
    part = intake.cut_segments(table, 25.0, first, last)
    segments.check(part, "part")
    assert segments.to_labels(part).tolist() == labels[first:last].astype(str).tolist()


def write_head(path, seconds, fps=30.0):
    n_frames = round(seconds * fps)
    frames = np.arange(n_frames)
    angles = {f"{axis}_deg": 10.0 * np.sin(frames / 9.0) for axis in "xyz"}
    pd.DataFrame({"time_s": (frames + 0.5) / fps} | angles).to_csv(path, index=False)
    return str(path)


def write_melody(path, seconds):
    rng = np.random.default_rng(0)
    n_frames = round(seconds * 100)
    melody.table("a", 150.0 + rng.normal(0, 5, n_frames), rng.normal(-30, 3, n_frames), 0).to_csv(path, index=False)
    return str(path)


HEAD = HeadConventions("XYZ", "deg", "y", "z", {"time": "time_s", "x": "x_deg", "y": "y_deg", "z": "z_deg"})


def read_with_head(**fields):
    return intake.read_record(
        record_entry(**fields), fields.get("motion"), 0.0, CONVENTIONS, LABELS, 0.025, 1.0, fields["head"], HEAD
    )


def test_a_head_alone_is_a_record_and_is_trimmed_with_its_sound(tmp_path):
    files = {"head": write_head(tmp_path / "a.csv", 5.0), "audio": write_wav(tmp_path / "a.wav", 4.6)}
    taken = read_with_head(**files)
    assert taken.body is None
    assert len(taken.head) == 138
    assert len(taken.voice) == round(4.6 * 16000)
    row = taken.row.iloc[0]
    assert (row["head_source"], row["head_fps"], row["note"]) == ("table", 30.0, "head trimmed by 0.400 s at its end")
    tables.validate(taken.row, "records", "row")
    tables.validate(taken.head, "head", "head")
    part = read_with_head(**files, start_s=1.0, end_s=3.0)
    assert part.head["x_deg"].to_numpy() == pytest.approx(taken.head["x_deg"].to_numpy()[30:90])
    assert part.head["time_s"].iloc[0] == pytest.approx(0.5 / 30)


def test_a_head_can_come_with_a_melody_and_with_a_body(tmp_path):
    files = {"head": write_head(tmp_path / "a.csv", 5.0), "melody": write_melody(tmp_path / "m.csv", 5.2)}
    taken = read_with_head(**files)
    assert taken.voice is None
    assert len(taken.melody) == 500
    tables.validate(taken.melody, "melody", "melody")
    body = {"motion": write_bvh(tmp_path / "a.bvh", 4.0), "audio": write_wav(tmp_path / "a.wav", 4.0)}
    taken = read_with_head(head=files["head"], **body)
    assert (len(taken.body), len(taken.head)) == (80, 120)
    with pytest.raises(UserError, match=r"record 'a': its motion lasts 4.000 s and its head 6.000 s"):
        read_with_head(head=write_head(tmp_path / "long.csv", 6.0), **body)
