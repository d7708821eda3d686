"""SMPL-X files in the layout of BEAT2 are read; anything else is rejected in one line."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cospeech.corpus import motion
from cospeech.corpus.retarget import MotionConventions
from cospeech.errors import UserError
from cospeech.formats import smplx
from cospeech.motion import skeleton

BEAT2 = Path(__file__).parents[3] / "shared/data/beat2_scott/2_scott_0_1_1.npz"
DECLARED = MotionConventions("y", "m", "smplx", "t_pose")


def arrays(n_frames=8):
    rng = np.random.default_rng(0)
    return {
        "poses": rng.uniform(-0.3, 0.3, (n_frames, 165)).astype(np.float32),
        "trans": rng.normal(0, 0.1, (n_frames, 3)),
        "mocap_frame_rate": np.array(30, dtype=np.int32),
        "gender": np.array("neutral"),
    }


def save(path, **changes):
    held = {key: value for key, value in (arrays() | changes).items() if value is not None}
    np.savez(path, **held)
    return path


def test_poses_are_read_in_the_order_of_smplx(tmp_path):
    clip = smplx.read(save(tmp_path / "a.npz"))
    held = arrays()
    elbow = smplx.NAMES.index("left_elbow")
    assert elbow == 18
    expected = Rotation.from_rotvec(held["poses"][3, 54:57].astype(float)).as_matrix()
    np.testing.assert_allclose(clip.rotations[3, elbow], expected)
    np.testing.assert_array_equal(clip.places[0], held["trans"])
    assert clip.fps == 30.0
    assert smplx.NAMES[smplx.PARENTS[elbow]] == "left_shoulder"


def test_amass_has_another_name_for_the_frame_rate(tmp_path):
    clip = smplx.read(save(tmp_path / "a.npz", mocap_frame_rate=None, mocap_framerate=np.array(120.0)))
    assert clip.fps == 120.0


def nan_at(frame, joint):
    poses = arrays()["poses"]
    poses[frame, 3 * smplx.NAMES.index(joint) + 1] = np.nan
    return poses


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"poses": None}, "needs poses, trans and mocap_frame_rate"),
        ({"mocap_frame_rate": None}, "needs poses"),
        ({"poses": np.zeros((8, 164))}, "not .frames, 165."),
        ({"poses": np.zeros((8, 9))}, "not .frames, 165."),
        ({"trans": np.zeros((7, 3))}, "not .frames, 165."),
        ({"poses": np.zeros((0, 165)), "trans": np.zeros((0, 3))}, "no frame"),
        ({"poses": np.full((8, 165), "x")}, "must hold numbers"),
        ({"mocap_frame_rate": np.array(0)}, "frames per second"),
        ({"mocap_frame_rate": np.array([30, 30])}, "frames per second"),
        ({"poses": nan_at(5, "right_wrist")}, "'right_wrist' is missing .NaN. in frame 5"),
        ({"trans": np.full((8, 3), np.nan)}, "trans is missing .NaN. in frame 0"),
    ],
)
def test_what_is_not_smplx_motion_is_rejected(tmp_path, changes, says):
    with pytest.raises(UserError, match=says) as caught:
        smplx.read(save(tmp_path / "bad.npz", **changes))
    assert "bad.npz" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_objects_inside_are_never_unpickled(tmp_path):
    np.savez(tmp_path / "bad.npz", **arrays() | {"poses": np.array([{"a": 1}], dtype=object)})
    with pytest.raises(UserError, match=r"bad\.npz"):
        smplx.read(tmp_path / "bad.npz")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no more", b"RIFF....WAVE", b"\x93NUMPY"])
def test_damaged_and_mislabelled_files_are_rejected(tmp_path, content):
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(UserError, match=r"bad\.npz"):
        smplx.read(tmp_path / "bad.npz")
    with pytest.raises(UserError, match=r"none\.npz: no such file"):
        smplx.read(tmp_path / "none.npz")


def test_a_bare_array_is_not_an_archive(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(3))
    (tmp_path / "a.npy").rename(tmp_path / "bad.npz")
    with pytest.raises(UserError, match="bare array"):
        smplx.read(tmp_path / "bad.npz")


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_corrupt_archive_is_read_or_rejected_and_nothing_else(tmp_path_factory, data):
    path = save(tmp_path_factory.mktemp("npz") / "spoilt.npz")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    path.write_bytes(content[:cut])
    try:
        clip = smplx.read(path)
    except UserError:
        return
    assert np.isfinite(clip.rotations).all()


def test_a_zero_pose_other_than_its_own_is_rejected(tmp_path):
    with pytest.raises(UserError, match=r"set corpus\.motion\.zero to t_pose"):
        motion.read(save(tmp_path / "a.npz"), MotionConventions("y", "m", "smplx", "hanging"))


@pytest.mark.recorded
@pytest.mark.skipif(not BEAT2.is_file(), reason="needs the real recordings in ../shared/data/beat2_scott")
def test_a_real_speaker_stands_upright_and_gestures_before_the_body():
    assert zipfile.is_zipfile(BEAT2)
    read = motion.read(BEAT2, DECLARED, 10.0, 40.0)
    assert (len(read.table), read.fps, read.source, read.notes) == (900, 30.0, "smplx", [])
    placed = skeleton.forward(read.table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(read.table))
    trunk = placed["neck"] - placed["hips"]
    assert np.degrees(np.arccos(trunk[:, 1] / np.linalg.norm(trunk, axis=1))).max() < 40
    chest = placed["chest"]
    for side, sign in (("left", 1), ("right", -1)):
        assert np.mean(placed[f"{side}_hand"][:, 2] > chest[:, 2]) > 0.8  # measured 0.88 and 0.98
        assert np.mean(sign * (placed[f"{side}_arm"] - chest)[:, 0] > 0) == 1
        bend = read.table[f"{side}_forearm_x_deg"]
        assert bend.max() < 0  # an elbow bends forward only
        assert bend.median() < -30
    steps = np.abs(np.diff(skeleton.angles(read.table), axis=0))
    assert steps.max() < 25  # degrees per frame at 30 frames/s: no jumps of the representation
