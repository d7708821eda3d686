"""An independent reader finds our joints where our own kinematics does; files are read completely or rejected."""

import numpy as np
import pybvh
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import frame_rates
from cospeech.errors import UserError
from cospeech.formats import bvh, foreign
from cospeech.motion import skeleton

TINY = """HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Zrotation Xrotation Yrotation Xposition Yposition Zposition
  JOINT Left Arm
  {
    OFFSET 10 50 0
    CHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation Xrotation
    JOINT Elbow
    {
      OFFSET 30 0 0
      CHANNELS 1 Yrotation
      End Site
      {
        OFFSET 25 0 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
10 20 30 1 2 3 10 50 0 40 50 60 70
11 21 31 1 2 4 10 50 0 41 51 61 71
"""


def random_motion(seed, n_frames=7, fps=20.0):
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-80, 80, (n_frames, len(skeleton.JOINTS), 3))
    return skeleton.motion_table(rng.normal(0, 0.1, (n_frames, 3)), turns, fps)


def turn(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrices = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    return np.array(matrices.get(axis, [[c, -s, 0], [s, c, 0], [0, 0, 1]]))


def test_an_independent_reader_finds_every_joint_where_forward_kinematics_puts_it(tmp_path):
    motion = random_motion(1)
    bvh.write(motion, tmp_path / "a.bvh")
    other = pybvh.read_bvh_file(tmp_path / "a.bvh", world_up="+y")
    placed = skeleton.forward(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(motion))
    positions = other.node_positions()
    assert other.fps == pytest.approx(20.0)
    seen = set()
    for index, node in enumerate(other.nodes):
        name = f"{node.parent.name}_tip" if node.is_end_site() else node.name
        seen.add(name)
        # six decimals in the file, metres and degrees, through a chain of at most seven joints
        np.testing.assert_allclose(positions[:, index], placed[name], atol=1e-6)
    assert seen == set(placed)


def test_our_own_reader_gives_back_what_was_written(tmp_path):
    motion = random_motion(2, fps=30.0)
    bvh.write(motion, tmp_path / "a.bvh")
    clip = bvh.read(tmp_path / "a.bvh")
    assert set(clip.names) == set(skeleton.JOINTS)
    assert clip.fps == 30.0
    order = [clip.names.index(name) for name in skeleton.JOINTS]
    turned = skeleton.rotations(skeleton.angles(motion))
    np.testing.assert_allclose(clip.rotations[:, order], turned, atol=1e-7)
    hips = motion[list(skeleton.ROOT_COLUMNS)].to_numpy() + skeleton.OFFSET_M["hips"]
    np.testing.assert_allclose(clip.places[0], hips, atol=1e-6)
    for joint, parent in zip(clip.names[1:], clip.parents[1:], strict=True):
        assert clip.names[parent] == skeleton.PARENT[joint]


@settings(max_examples=12)
@given(seed=st.integers(0, 999), n_frames=st.integers(1, 2 * bvh.CHUNK + 1), fps=st.sampled_from(frame_rates.COMMON))
def test_motion_of_any_length_and_rate_is_read_as_written(tmp_path_factory, seed, n_frames, fps):
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    motion = random_motion(seed, n_frames, fps)
    bvh.write(motion, path)
    clip = bvh.read(path)
    assert (clip.fps, clip.notes) == (fps, ())
    hips = motion[list(skeleton.ROOT_COLUMNS)].to_numpy() + skeleton.OFFSET_M["hips"]
    np.testing.assert_allclose(clip.places[0], hips, atol=1e-6)
    order = [clip.names.index(name) for name in skeleton.JOINTS]
    turned = skeleton.rotations(skeleton.angles(motion.iloc[[0, -1]]))
    np.testing.assert_allclose(clip.rotations[[0, -1]][:, order], turned, atol=1e-7)


def test_writing_twice_gives_the_same_bytes(tmp_path):
    for name in "ab":
        bvh.write(random_motion(3), tmp_path / f"{name}.bvh")
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_a_motion_without_frames_has_a_frame_rate_only_if_it_is_given_one(tmp_path):
    bvh.write(random_motion(1).iloc[:0], tmp_path / "empty.bvh", 20.0)
    lines = (tmp_path / "empty.bvh").read_text().splitlines()
    assert lines[-2:] == ["Frames: 0", "Frame Time: 0.0500000000"]
    with pytest.raises(IndexError):
        bvh.write(random_motion(1).iloc[:0], tmp_path / "empty.bvh")


def test_any_order_of_channels_is_read_as_declared(tmp_path):
    (tmp_path / "a.bvh").write_text(TINY)
    clip = bvh.read(tmp_path / "a.bvh")
    assert clip.names == ("Hips", "Left Arm", "Elbow")
    assert clip.fps == 30.0  # the rounded 0.033333 is one thirtieth
    np.testing.assert_array_equal(clip.places[0], [[1, 2, 3], [1, 2, 4]])
    np.testing.assert_allclose(clip.rotations[0, 0], turn("z", 10) @ turn("x", 20) @ turn("y", 30))
    np.testing.assert_allclose(clip.rotations[0, 1], turn("y", 40) @ turn("z", 50) @ turn("x", 60))
    np.testing.assert_allclose(clip.rotations[1, 2], turn("y", 71))
    np.testing.assert_array_equal(clip.places[1], [[10, 50, 0], [10, 50, 0]])
    np.testing.assert_array_equal(clip.tips[2], [25, 0, 0])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not a BVH"),
        ("RIFF....WAVE", "not a BVH"),
        (TINY[:200], "truncated"),
        (TINY.replace("MOTION", ""), "truncated"),
        (TINY[: TINY.rindex("11 21")], "announces 2 frames and holds 1: empty or truncated; copy"),
        (TINY[:-10], "frame 1 has 10 of 13 values; the file is truncated: copy it again"),
        (TINY.replace("50 60 70", "50 60"), "frame 0 has 12 of 13 values; export"),
        (TINY + 2 * TINY.splitlines(keepends=True)[-1], "announces 2 frames and holds more, 4; correct 'Frames:'"),
        (TINY.replace("41", "nan"), "'Left Arm' is missing .NaN. in frame 1"),
        (TINY.replace("41", "x1"), "frame 1: 'x1' is not a number"),
        (TINY.replace("41", "41,5"), "frame 1: '41,5' is not a number; write decimal points"),
        (TINY.replace("41", "1e30"), r"'Left Arm' has the value 1e\+30 in frame 1"),
        (TINY.replace("Frame Time: 0.033333", "Frame Time: 33.3"), "seconds per frame"),
        (TINY.replace("0.033333", "0,033333"), "frame time '0,033333' is not a number"),
        (
            TINY.replace("OFFSET 10 50 0", "OFFSET 0 0 0")
            .replace("OFFSET 30 0 0", "OFFSET 0 0 0")
            .replace("10 50 0 4", "0 0 0 4"),
            "offsets of all joints are zero",
        ),
        (TINY.replace("Left Arm", "左腕").encode("euc_jp"), "line 6 is not in UTF-8 .*'左腕' in EUC-JP"),
        (TINY.replace("Left Arm", "左腕").encode("shift_jis"), "line 6 is not in UTF-8 .*'左腕' in Shift-JIS"),
        (TINY.replace("Left Arm", "Bras_levé").encode("cp1252"), "line 6 is not in UTF-8 .*'Bras_levé' in Windows"),
        (TINY.replace("CHANNELS 1", "CHANNELS 3"), "CHANNELS announces 3"),
        (TINY.replace("Yrotation\n      End", "Wrotation\n      End"), "not BVH channels"),
        (TINY.replace("OFFSET 10 50 0", "OFFSET 10 50"), "three numbers"),
    ],
)
def test_a_broken_file_ends_in_one_line_that_names_it(tmp_path, text, says):
    path = tmp_path / "broken.bvh"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UserError, match=says) as caught:
        bvh.read(path)
    assert "broken.bvh" in str(caught.value)
    assert "\n" not in str(caught.value)


def read_text(tmp_path, text, **encoding):
    (tmp_path / "a.bvh").write_text(text, **({"encoding": "utf-8"} | encoding))
    return bvh.read(tmp_path / "a.bvh")


@pytest.mark.parametrize(("written", "fps"), [("0.017", 60), ("0.0083", 120), ("0.033", 30), ("0.033367", 29.97)])
def test_a_rounded_frame_time_is_that_of_a_common_rate(tmp_path, written, fps):
    clip = read_text(tmp_path, TINY.replace("0.033333", written))
    assert clip.fps == fps
    assert [written in note for note in clip.notes] == ([] if fps == 29.97 else [True])


def test_headers_in_other_cases_are_read_and_what_follows_the_motion_is_shown(tmp_path):
    other = TINY.replace("Frames: 2", "FRAMES: 2.0").replace("Frame Time", "FRAME TIME")
    np.testing.assert_array_equal(read_text(tmp_path, other).rotations, read_text(tmp_path, TINY).rotations)
    with pytest.raises(UserError, match="'# by hand' follows the last frame; remove"):
        read_text(tmp_path, TINY + "# by hand\n")
    with pytest.raises(UserError, match="'0,033333' is not a number; write a decimal point"):
        read_text(tmp_path, TINY.replace("0.033333", "0,033333"))


def test_one_frame_more_than_announced_is_read_and_noted(tmp_path):
    clip = read_text(tmp_path, TINY.replace("Frames: 2", "Frames: 1"))
    assert len(clip.rotations) == 2
    assert clip.notes == ("the file holds one frame more than the 1 that it announces; all were read",)


def test_offsets_that_are_zero_are_read_from_constant_position_channels(tmp_path):
    clip = read_text(tmp_path, TINY.replace("OFFSET 10 50 0", "OFFSET 0 0 0"))
    np.testing.assert_array_equal(clip.offsets[1], [10, 50, 0])
    assert clip.notes == ("offsets of 1 joints, zero in the file, read from their position channels",)
    moving = read_text(tmp_path, TINY.replace("OFFSET 10 50 0", "OFFSET 0 0 0").replace("4 10 50 0", "4 90 50 0"))
    np.testing.assert_array_equal(moving.offsets[1], [0, 0, 0])


def test_position_channels_that_are_zero_are_relative_to_the_offset(tmp_path):
    clip = read_text(tmp_path, TINY.replace("3 10 50 0", "3 0 0 0").replace("4 10 50 0", "4 0 0 0"))
    assert 1 not in clip.places
    np.testing.assert_array_equal(clip.offsets[1], [10, 50, 0])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("name", ["Bras lev\u00e9", "Bras leve\u0301", '"Bras  lev\u00e9"'])
def test_names_that_look_the_same_are_the_same(tmp_path, name, encoding):
    assert read_text(tmp_path, TINY.replace("Left Arm", name), encoding=encoding).names[1] == "Bras lev\u00e9"


def test_a_second_joint_of_a_name_braces_on_the_same_line_and_old_line_ends_are_read(tmp_path):
    assert read_text(tmp_path, TINY.replace("Elbow", "Hips")).names == ("Hips", "Left Arm", "Hips")
    expected = read_text(tmp_path, TINY)
    for changed in (TINY.replace("\n  {", " {"), TINY.replace("\n", "\r"), TINY.replace("\n", "\r\n")):
        (tmp_path / "a.bvh").write_bytes(changed.encode())
        clip = bvh.read(tmp_path / "a.bvh")
        assert clip.names == expected.names
        np.testing.assert_array_equal(clip.rotations, expected.rotations)


def test_a_chain_of_thousands_of_joints_and_too_much_motion_are_rejected(tmp_path, monkeypatch):
    chain = "".join(f"JOINT j{number}\n{{\nOFFSET 0 1 0\n" for number in range(20000))
    with pytest.raises(UserError, match="has more than 1000 joints"):
        read_text(tmp_path, f"HIERARCHY\nROOT r\n{{\nOFFSET 0 0 0\n{chain}{20001 * '}'}\nMOTION\n")
    monkeypatch.setattr(foreign, "MAX_JOINT_FRAMES", 5)
    with pytest.raises(UserError, match="has 2 frames of 3 joints, more than the limit of 1 frames"):
        read_text(tmp_path, TINY)
    monkeypatch.setattr(foreign, "MAX_FILE_MB", 0)
    with pytest.raises(UserError, match="more than the limit of 0 MB"):
        read_text(tmp_path, TINY)
    with pytest.raises(UserError, match="is not a regular file"):
        bvh.read("/dev/null")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(UserError, match=r"none\.bvh"):
        bvh.read(tmp_path / "none.bvh")


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_a_corrupt_file_is_read_or_rejected_and_nothing_else(tmp_path_factory, data):
    lines = TINY.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["drop", "double", "junk", "word"]))
        if kind == "drop" and len(lines) > 1:
            del lines[at]
        elif kind == "double":
            lines.insert(at, lines[at])
        elif kind == "junk":
            lines[at] = data.draw(st.text(max_size=30))
        else:
            words = lines[at].split() or [""]
            words[data.draw(st.integers(0, len(words) - 1))] = data.draw(st.text(max_size=8))
            lines[at] = " ".join(words)
    path = tmp_path_factory.mktemp("bvh") / "spoilt.bvh"
    path.write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")
    try:
        clip = bvh.read(path)
    except UserError:
        return
    assert clip.rotations.shape == (len(clip.places[0]), len(clip.names), 3, 3)
    assert np.isfinite(clip.rotations).all()
    assert np.isfinite(clip.places[0]).all()
