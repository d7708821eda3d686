"""SMPL-X files in the layout of BEAT2 are read; anything else is rejected in one line."""

import io
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
from cospeech.formats import foreign, smplx
from cospeech.motion import skeleton

BEAT2 = Path(__file__).parents[3] / "shared/data/beat2_scott/2_scott_0_1_1.npz"
DECLARED = MotionConventions("y", "m", "smplx", "t_pose")


def arrays(n_frames=8):
    rng = np.random.default_rng(0)
    return {
        "poses": rng.uniform(-0.3, 0.3, (n_frames, 165)).astype(np.float32),
        "trans": rng.normal(0, 0.01, (n_frames, 3)),
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


@pytest.mark.parametrize(("written", "fps"), [(1, 1), (1000, 1000), (29, 29.97), (np.float32(59.94), 59.94)])
def test_rates_are_read_up_to_their_limit(tmp_path, written, fps):
    assert smplx.read(save(tmp_path / "a.npz", mocap_frame_rate=np.array(written))).fps == fps


@settings(max_examples=40)
@given(
    dtype=st.sampled_from(["<f2", "<f4", ">f4", "<f8", ">f8"]), by_column=st.booleans(), compressed=st.booleans(),
    n_frames=st.integers(1, 50), fps=st.integers(30, 1000).filter(lambda fps: fps not in (59, 119, 239)),
)  # fmt: skip
def test_arrays_of_any_layout_are_read_as_written(tmp_path_factory, dtype, by_column, compressed, n_frames, fps):
    given_arrays = arrays(n_frames)
    poses = np.array(given_arrays["poses"], dtype=dtype, order="F" if by_column else "C")
    path = tmp_path_factory.mktemp("npz") / "a.npz"
    write = np.savez_compressed if compressed else np.savez
    write(path, **given_arrays | {"poses": poses, "mocap_frame_rate": np.array(fps)})
    clip = smplx.read(path)
    assert clip.fps == fps
    expected = Rotation.from_rotvec(poses[:, 54:57].astype(float)).as_matrix()
    np.testing.assert_allclose(clip.rotations[:, 18], expected, atol=1e-12)


@pytest.mark.parametrize("n_columns", [66, 72, 156, 165])
def test_every_body_model_has_the_same_first_joints(tmp_path, n_columns):
    poses = arrays()["poses"][:, :n_columns]
    for layout in (poses, poses.reshape(len(poses), -1, 3)):
        clip = smplx.read(save(tmp_path / "a.npz", poses=layout))
        expected = Rotation.from_rotvec(poses[2, 54:57]).as_matrix()
        np.testing.assert_allclose(clip.rotations[2, 18], expected, atol=1e-6)


def positions(n_frames=8):
    """Positions of the joints of a body that moves its arms, in the layout of ``poses``."""
    rng = np.random.default_rng(1)
    bones = rng.normal(0, 0.3, (55, 3))
    parents = (*smplx.PARENTS, *[21] * 33)
    turns = Rotation.from_rotvec(rng.normal(0, 0.5, (n_frames * 55, 3))).as_matrix().reshape(n_frames, 55, 3, 3)
    placed = np.zeros((n_frames, 55, 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            placed[:, joint] = placed[:, parent] + turns[:, joint] @ bones[joint]
    return placed.reshape(n_frames, 165)


def test_rotations_up_to_a_full_turn_are_read(tmp_path):
    poses = np.zeros((8, 165))
    poses[:, 54:57] = [3.6, -3.6, 3.6]  # 6.24 rad
    assert len(smplx.read(save(tmp_path / "a.npz", poses=poses)).rotations) == 8


def test_arms_that_do_not_move_are_no_positions(tmp_path):
    poses = np.zeros((8, 165))
    poses[:, 48:66] = [0.1, 0.2, -1.1, 0.1, 0.2, 1.1, 0, -0.3, 0.2, 0.1, 0.2, 0, 0.1, 0, 0, 0, 0.1, 0]
    assert len(smplx.read(save(tmp_path / "a.npz", poses=poses)).rotations) == 8


def nan_at(frame, joint):
    poses = arrays()["poses"]
    poses[frame, 3 * smplx.NAMES.index(joint) + 1] = np.nan
    return poses


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"poses": None}, "needs poses, trans and mocap_frame_rate; the file holds gender, mocap_frame_rate, trans;"),
        ({"poses": None, "body_pose": np.zeros((8, 63))}, "the file holds body_pose, gender"),
        (
            {"poses": np.zeros((8, 132))},
            "not .frames, 165.*66 for the body alone, 72 for SMPL, 156 for SMPL-H, 165 for",
        ),
        ({"poses": np.zeros((8, 55, 6))}, "not .frames, 165."),
        (
            {"poses": np.degrees(arrays()["poses"])},
            "rad in frame ., more than a full turn, so poses seems to be in deg",
        ),
        ({"poses": arrays()["poses"] + np.repeat([0, 4, 0], [54, 3, 108])}, "'left_elbow' turns by [67].* full turn"),
        ({"poses": positions()}, "poses seems to hold positions of joints"),
        ({"mocap_frame_rate": np.array(1001.0)}, "mocap_frame_rate is 1001.0; it must be one number from 1 to 1000"),
        ({"mocap_frame_rate": np.array(np.inf)}, "from 1 to 1000"),
        ({"mocap_frame_rate": np.array("30")}, "mocap_frame_rate has the type <U2 and must hold numbers"),
        ({"trans": np.array(["a"])}, "are not .frames, 165."),
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


def packed(path, **members):
    """An archive with the given bytes as members; other members as in ``arrays``."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays().items():
            file = io.BytesIO()
            np.save(file, array)
            archive.writestr(f"{name}.npy", members.get(name, file.getvalue()))
    return path


def header(shape, dtype="<f8"):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": dtype, "fortran_order": False, "shape": shape})
    return file.getvalue()


@pytest.mark.parametrize(
    ("members", "says"),
    [
        ({"poses": b"hello"}, "poses is not an array; save the file with numpy.savez"),
        ({"mocap_frame_rate": b"30"}, "mocap_frame_rate is not an array"),
        ({"trans": b""}, "trans is not an array"),
        ({"poses": b"\x93NUMPY\x09\x00"}, "poses is not an array"),
        ({"poses": header((10**9, 165))}, "poses announces an array of shape .1000000000, 165. and is shorter"),
        ({"poses": header((-1, 165))}, "announces an array of shape .-1, 165."),
        ({"poses": header((8, 165)) + bytes(100)}, "and is shorter; export it again"),
        ({"poses": bytes(60_000_000)}, r"unpacks from 0\.. to 60 MB, unlike motion data"),
    ],
)
def test_members_that_are_not_arrays_and_bombs_are_rejected(tmp_path, members, says):
    with pytest.raises(UserError, match=r"bad\.npz.*" + says):
        smplx.read(packed(tmp_path / "bad.npz", **members))


def test_files_beyond_the_limits_are_rejected(tmp_path, monkeypatch):
    path = save(tmp_path / "a.npz")
    monkeypatch.setattr(foreign, "MAX_JOINT_FRAMES", 175)
    with pytest.raises(UserError, match="has 8 frames of 22 joints, more than the limit of 7 frames"):
        smplx.read(path)
    monkeypatch.setattr(foreign, "MAX_FILE_MB", 0.005)
    with pytest.raises(UserError, match=r"more than the limit of 0.005 MB"):
        smplx.read(path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no more", b"RIFF....WAVE", b"\x93NUMPY"])
def test_damaged_and_mislabelled_files_are_rejected(tmp_path, content):
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(UserError, match=r"bad\.npz"):
        smplx.read(tmp_path / "bad.npz")
    with pytest.raises(UserError, match=r"none\.npz: cannot be read"):
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
