"""Motion files of any kind in the viewer, and the command that shows them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cospeech import cli
from cospeech.corpus import retarget
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import bvh, trc
from cospeech.motion.body import STANDARD
from cospeech.viewer import files, takes

DATA = Path(__file__).parents[3] / "shared" / "data"


def takes_of(path):
    """The takes in a page, as the viewer reads them."""
    return [json.loads(found) for found in re.findall(r"viewer\.add\((.*)\);", path.read_text(encoding="utf-8"))]


def test_our_own_bvh_is_shown_as_a_body(recordings):
    (version,) = files.read(recordings / "talk_1.bvh")
    clip = bvh.read(recordings / "talk_1.bvh")
    places = retarget.world_positions(clip, retarget.world_rotations(clip))
    shown = STANDARD.world(version.motion.poses.root_m, version.motion.poses.rotations)[1]
    assert version.skinned
    for joint, name in enumerate(STANDARD.joints):
        np.testing.assert_allclose(shown[:, joint], places[clip.names.index(name)], atol=1e-5)


def test_another_skeleton_is_shown_as_bones_with_its_ends(tmp_path, recordings):
    text = (recordings / "talk_1.bvh").read_text().replace("ROOT hips", "ROOT pelvis")
    (tmp_path / "other.bvh").write_text(text)
    (version,) = files.read(tmp_path / "other.bvh", unit="cm", up="z")
    assert not version.skinned
    assert "head end" in version.motion.joints
    own = files.read(recordings / "talk_1.bvh")[0].motion
    places = STANDARD.world(own.poses.root_m, own.poses.rotations)[1]
    np.testing.assert_allclose(
        version.motion.places_m[:, version.motion.joints.index("left_hand")],
        0.01 * places[:, STANDARD.joints.index("left_hand")] @ retarget.AXES["z"].T,
        atol=1e-6,
    )


def test_lost_markers_are_lost(tmp_path):
    places = np.ones((4, 2, 3))
    places[2, 1] = np.nan
    trc.write(Trajectories(("a", "b"), places, 100.0), tmp_path / "markers.trc")
    (version,) = files.read(tmp_path / "markers.trc")
    assert np.isnan(version.motion.places_m).all(axis=2).tolist() == [[False] * 2] * 2 + [[False, True]] + [
        [False] * 2
    ]
    takes.packed(takes.Take("markers", [version]))


def test_files_with_one_motion_are_shown_together_with_the_sound(tmp_path, recordings, capsys):
    given = [str(recordings / name) for name in ("talk_1.bvh", "talk_2.bvh", "talk_1.wav")]
    assert cli.main(["view", *given, "--out", str(tmp_path / "page.html")]) == 0
    (take,) = takes_of(tmp_path / "page.html")
    assert [version["title"] for version in take["versions"]] == ["talk_1", "talk_2"]
    assert take["duration"] == pytest.approx(12.0)
    assert [curve["title"] for curve in take["curves"]] == ["Pitch (Hz)", "Intensity (dB)"]
    assert capsys.readouterr().out == f"{tmp_path / 'page.html'}\n"


def test_files_of_one_name_are_told_apart_by_their_kind(tmp_path, recordings):
    talk, copy = recordings / "talk_1.bvh", tmp_path / "talk_1.glb"
    assert cli.main(["convert", str(talk), "--out", str(copy)]) == 0
    assert cli.main(["view", str(talk), str(copy), "--out", str(tmp_path / "page.html")]) == 0
    (take,) = takes_of(tmp_path / "page.html")
    assert [version["title"] for version in take["versions"]] == ["talk_1.bvh", "talk_1.glb"]
    assert [version["surface"] for version in take["versions"]] == [0, 1]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["missing.bvh"], "missing.bvh: cannot be read"),
        (["a.wav"], "no motion to show"),
        (["a.bvh", "a.wav", "b.wav"], "b.wav: is a second sound"),
    ],
)
def test_what_cannot_be_shown_is_one_line(given, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["view", *given, "--out", "page.html"]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "page.html").exists()


def test_sound_and_motion_of_different_length_are_shown_from_their_start_on(tmp_path, recordings, capsys):
    given = [str(recordings / name) for name in ("talk_1.bvh", "speech.wav")]
    assert cli.main(["view", *given, "--out", str(tmp_path / "page.html")]) == 0
    assert takes_of(tmp_path / "page.html")[0]["duration"] == pytest.approx(12.0)
    line = capsys.readouterr().err
    assert "talk_1 lasts 12.0 s and" in line
    assert "speech.wav 10.0 s" in line
    assert line.count("\n") == 1


def body_text(n_joints, n_frames):
    """A BVH file of a root with many children, which do not move."""
    child = (
        "JOINT j{}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
    )
    root = "HIERARCHY\nROOT j0\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition "
    root += "Zrotation Xrotation Yrotation\n"
    frames = " ".join(["0"] * (3 * n_joints + 3)) + "\n"
    head = f"}}\nMOTION\nFrames: {n_frames}\nFrame Time: 0.05\n"
    return root + "".join(child.format(k) for k in range(1, n_joints)) + head + frames * n_frames


def test_a_single_frame_is_a_still_pose(tmp_path, capsys):
    (tmp_path / "one.bvh").write_text(body_text(3, 1))
    assert cli.main(["view", str(tmp_path / "one.bvh"), "--out", str(tmp_path / "page.html")]) == 0
    assert takes_of(tmp_path / "page.html")[0]["versions"][0]["frames"] == 1
    assert "one.bvh: contains a single frame" in capsys.readouterr().err


@pytest.mark.parametrize(("size", "message"), [((3, 0), "holds 0"), ((10_000, 2), "more than 1000 joints")])
def test_a_body_without_motion_or_with_too_many_joints_is_one_line(size, message, tmp_path, capsys):
    (tmp_path / "a.bvh").write_text(body_text(*size))
    assert cli.main(["view", str(tmp_path / "a.bvh"), "--out", str(tmp_path / "page.html")]) == 1
    line = capsys.readouterr().err
    assert message in line
    assert line.count("\n") == 1


def test_an_existing_page_stays(tmp_path, recordings, capsys):
    (tmp_path / "page.html").write_text("mine")
    assert cli.main(["view", str(recordings / "talk_1.bvh"), "--out", str(tmp_path / "page.html")]) == 1
    assert "already exists" in capsys.readouterr().err
    assert (tmp_path / "page.html").read_text() == "mine"


def test_a_file_of_another_kind_is_refused():
    with pytest.raises(UserError, match=r"notes\.txt: is no motion file"):
        files.read(Path("notes.txt"))


@pytest.mark.recorded
def test_each_animation_of_a_creature_is_a_take(tmp_path):
    spider = DATA / "creatures" / "Spider.glb"
    if not spider.exists():
        pytest.skip("needs ../shared/data/creatures")
    assert cli.main(["view", str(spider), "--out", str(tmp_path / "page.html")]) == 0
    assert [take["title"].split("_")[1] for take in takes_of(tmp_path / "page.html")] == [
        "Attack", "Death", "Idle", "Jump", "Walk",
    ]  # fmt: skip
    assert len({id(version.mesh) for version in files.read(spider)}) == 1
