"""``cospeech convert``: motion in other formats, and back."""

import numpy as np
import pytest

from cospeech import cli
from cospeech.commands import convert
from cospeech.formats import bvh, smplx
from cospeech.motion.body import STANDARD


def places(path):
    body, poses, _ = convert.read(path, None, "m", "y")
    assert body.joints == STANDARD.joints
    return body.world(poses.root_m, poses.rotations)[1]


@pytest.mark.parametrize("suffix", [".bvh", ".glb", ".npz", ".parquet"])
def test_motion_survives_every_format(recordings, tmp_path, suffix):
    given, out, back = recordings / "talk_1.bvh", tmp_path / f"moved{suffix}", tmp_path / "back.bvh"
    assert cli.main(["convert", str(given), "--out", str(out)]) == 0
    assert cli.main(["convert", str(out), "--out", str(back)]) == 0
    difference = places(back) - places(given)
    difference -= difference[:, :1].mean(axis=0) if suffix == ".npz" else 0.0  # which is centred when it is read
    assert np.abs(difference).max() < 1e-4


def test_smplx_files_have_the_layout_of_beat2(recordings, tmp_path):
    assert cli.main(["convert", str(recordings / "talk_1.bvh"), "--out", str(tmp_path / "moved.npz")]) == 0
    with np.load(tmp_path / "moved.npz") as arrays:
        found = {name: (arrays[name].shape[1:], arrays[name].dtype.kind) for name in arrays.files}
    assert found == {
        "betas": ((), "f"), "poses": ((165,), "f"), "expressions": ((100,), "f"), "trans": ((3,), "f"),
        "model": ((), "U"), "gender": ((), "U"), "mocap_frame_rate": ((), "i"),
    }  # fmt: skip
    assert smplx.read(tmp_path / "moved.npz").fps == 20


def test_another_skeleton_keeps_its_joints(recordings, tmp_path):
    text = (recordings / "talk_1.bvh").read_text().replace("ROOT hips", "ROOT pelvis")
    (tmp_path / "other.bvh").write_text(text)
    assert cli.main(["convert", str(tmp_path / "other.bvh"), "--out", str(tmp_path / "other.glb")]) == 0
    assert cli.main(["convert", str(tmp_path / "other.glb"), "--out", str(tmp_path / "back.bvh")]) == 0
    assert set(bvh.read(tmp_path / "back.bvh").names) == {"pelvis", *STANDARD.joints[1:]}


@pytest.mark.parametrize(
    ("given", "out", "message"),
    [
        ("talk_1.bvh", "o.fbx", "unknown format '.fbx'"),
        ("nothing.bvh", "o.glb", "cannot be read"),
        ("talk_1.wav", "o.glb", "is no motion file"),
        ("other.bvh", "o.npz", "has a skeleton of its own"),
    ],
)
def test_what_cannot_be_converted_is_one_line(recordings, tmp_path, given, out, message, capsys):
    text = (recordings / "talk_1.bvh").read_text().replace("ROOT hips", "ROOT pelvis")
    (tmp_path / "other.bvh").write_text(text)
    path = tmp_path / given if given == "other.bvh" else recordings / given
    assert cli.main(["convert", str(path), "--out", str(tmp_path / out)]) == 1
    line = capsys.readouterr().err
    assert message in line
    assert line.count("\n") == 1
    assert not (tmp_path / out).exists()
