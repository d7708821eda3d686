"""Recordings: complete at the end, and recovered if there was none."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_vmc import random_poses

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.geometry import rotation
from cospeech.live import recording
from cospeech.live.recording import Recorder
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD, Body

CARD = {"corpus": "virtual", "system": "nods"}


@pytest.fixture
def said():
    return []


@pytest.fixture
def record(tmp_path, monkeypatch, said):
    """A function that starts a recording in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def start(name, body=STANDARD, overwrite=False):
        return Recorder(Path(name), body, 25.0, CARD, overwrite, said.append)

    return start


def show(recorder, poses):
    for frame, pose in enumerate(poses):
        recorder.show(frame, (frame + 0.5) / 25, pose)


def files():
    return sorted(str(path) for path in Path().iterdir())


def orientations(motion):
    return skeleton.rotations(skeleton.angles(motion))


def test_a_table_has_the_poses_and_states_its_origin(record):
    poses = random_poses(30)
    recorder = record("talk.parquet")
    show(recorder, poses)
    assert files() == ["talk.parquet.recording"]
    recorder.close()
    assert files() == ["talk.parquet"]
    motion = tables.read("talk.parquet", "motion")
    assert skeleton.frame_rate(motion) == 25
    np.testing.assert_array_equal(motion[list(skeleton.ROOT_COLUMNS)], poses[:, :3])
    expected = rotation.from_quaternions(poses[:, 3:].reshape(30, 17, 4))
    np.testing.assert_allclose(orientations(motion), expected, atol=1e-12)
    assert tables.read_metadata("talk.parquet")["corpus"] == "virtual"


def test_a_bvh_file_is_that_of_the_table(record):
    poses = random_poses(30)
    for name in ("talk.bvh", "talk.parquet"):
        recorder = record(name)
        show(recorder, poses)
        recorder.close()
    bvh.write(tables.read("talk.parquet", "motion"), "other.bvh")
    assert Path("talk.bvh").read_bytes() == Path("other.bvh").read_bytes()
    assert len(bvh.read("talk.bvh").rotations) == 30


def test_another_body_is_recorded_as_poses_and_as_bvh(record):
    creature = Body(("core", "leg"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))
    poses = random_poses(10)[:, :11]
    recorder = record("walk.parquet", creature)
    show(recorder, poses)
    recorder.close()
    found, _ = library.from_tables(creature.to_table(), tables.read("walk.parquet", "poses"))
    np.testing.assert_allclose(found["walk"].frames, poses, atol=1e-12)
    recorder = record("walk.bvh", creature)
    show(recorder, poses)
    recorder.close()
    clip = bvh.read("walk.bvh")
    assert (clip.names, clip.parents, clip.fps) == (creature.joints, (-1, 0), 25.0)
    np.testing.assert_allclose(clip.places[0], poses[:, :3] + [0.0, 1.0, 0.0], atol=1e-6)
    expected = rotation.from_quaternions(poses[:, 3:].reshape(10, 2, 4))
    np.testing.assert_allclose(clip.rotations, expected, atol=1e-6)


KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from test_vmc import random_poses
from test_recording import CARD, show
from cospeech.live.recording import Recorder
from cospeech.motion.body import STANDARD
for name in sys.argv[2:]:
    show(Recorder(Path(name), STANDARD, 25.0, CARD, False, print), random_poses(40))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_killed_recordings_are_recovered_to_the_last_frame(record):
    names = ["killed.bvh", "killed.parquet"]
    subprocess.run([sys.executable, "-c", KILLED, Path(__file__).parent, *names], check=False)
    assert files() == [f"{name}.recording" for name in names]
    for name in names:
        with pytest.raises(UserError, match=rf"complete it with 'cospeech live --recover {name}.recording'"):
            record(name)
        with Path(f"{name}.recording").open("ab") as file:
            file.write(b"half a frame")
        assert recording.recover(Path(f"{name}.recording"), False) == Path(name)
        whole = record(name.replace("killed", "whole"))
        show(whole, random_poses(40))
        whole.close()
    assert files() == [*names, "whole.bvh", "whole.parquet"]
    assert Path("killed.bvh").read_bytes() == Path("whole.bvh").read_bytes()
    killed, whole = (tables.read(f"{name}.parquet", "motion") for name in ("killed", "whole"))
    pd.testing.assert_frame_equal(killed, whole, check_exact=True)


def test_what_cannot_be_recovered_takes_one_line(record):
    record("none.bvh")
    Path("text.bvh.recording").write_text("no recording at all\n")
    for name, complaint in (
        ("none.bvh.recording", "holds no frame; delete it"),
        ("text.bvh.recording", "is not an interrupted recording"),
        ("missing.bvh.recording", "cannot be read"),
        ("text.bvh", "ends in .recording; correct it"),
        ("talk.wav.recording", r"ends in \.bvh, \.parquet or \.csv"),
    ):
        with pytest.raises(UserError, match=complaint):
            recording.recover(Path(name), False)


def test_a_name_that_cannot_be_written_is_refused_and_a_file_kept(record):
    Path("old.bvh").write_text("kept")
    Path("folder.bvh").mkdir()
    for name, complaint in (
        ("old.bvh", "already exists; replace it with --overwrite"),
        ("folder.bvh", "is a folder"),
        ("nowhere/talk.bvh", "the folder nowhere does not exist"),
        ("talk.fbx", r"ends in \.bvh, \.parquet or \.csv"),
        ("/proc/talk.bvh", "cannot be written"),
    ):
        with pytest.raises(UserError, match=complaint):
            record(name)
    assert Path("old.bvh").read_text() == "kept"
    recorder = record("old.bvh", overwrite=True)
    assert Path("old.bvh").read_text() == "kept"
    show(recorder, random_poses(2))
    recorder.close()
    assert len(bvh.read("old.bvh").rotations) == 2


def test_two_recordings_of_one_name_and_one_without_a_frame(record):
    first = record("talk.bvh")
    with pytest.raises(UserError, match="belongs to a recording that runs or was interrupted"):
        record("talk.bvh")
    first.close()
    assert files() == []


def test_a_full_disk_stops_the_recording_and_keeps_what_was_shown(record, said, monkeypatch):
    poses = random_poses(10)
    recorder = record("talk.parquet")
    show(recorder, poses[:4])
    write = os.write

    def full(file, data):
        write(file, data[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    show(recorder, poses[4:])
    assert said == ["talk.parquet: recording stops after 4 frames (No space left on device)"]
    recorder.close()
    np.testing.assert_array_equal(tables.read("talk.parquet", "motion")["root_x_m"], poses[:4, 0])


def test_a_disk_that_is_full_at_the_end_leaves_what_has_grown(record, monkeypatch):
    recorder = record("talk.parquet")
    show(recorder, random_poses(3))

    def full(*_, **__):
        raise UserError("talk.parquet: the disk is full")

    monkeypatch.setattr(recording.tables, "write", full)
    with pytest.raises(UserError, match=r"its frames are in talk.parquet.recording: complete it with"):
        recorder.close()
    assert files() == ["talk.parquet.recording"]
