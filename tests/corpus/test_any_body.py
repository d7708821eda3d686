"""Folders of motion files as recordings of one body."""

import shutil

import numpy as np
import pandas as pd
import pytest

from cospeech.corpus import any_body
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD

SQUID = """HIERARCHY
ROOT {root}
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
{limbs}}}
MOTION
Frames: {n}
Frame Time: {seconds}
{rows}
"""

LIMB = """  JOINT {name}
  {{
    OFFSET {x} 0 0
    CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT {name}_end
    {{
      OFFSET 0 -{length} 0
      CHANNELS 3 Zrotation Yrotation Xrotation
    }}
  }}
"""


def squid(path, swings=(40.0, 30.0, 1.0), n=60, fps=30, length=2.0, root="mantle"):
    """A body with one limb per swing, each of which swings by that many degrees."""
    limbs = "".join(LIMB.format(name=f"arm{i}", x=i, length=length) for i in range(len(swings)))
    times = np.arange(n) / fps
    columns = [np.sin(times), np.ones(n), times, *[np.zeros(n)] * 3]
    for i, swing in enumerate(swings):
        columns += [swing * np.sin(5 * times + i), *[np.zeros(n)] * 5]
    rows = "\n".join(" ".join(f"{value:.6f}" for value in row) for row in np.array(columns).T)
    path.write_text(SQUID.format(root=root, limbs=limbs, n=n, seconds=f"{1 / fps:.6f}", rows=rows))


def test_hands_are_the_ends_that_move_and_positions_are_in_metres(tmp_path):
    squid(tmp_path / "one.bvh")
    squid(tmp_path / "two.bvh", n=40)
    found = any_body.read(tmp_path, "cm", "y")
    assert list(found.recordings) == ["one", "two"]
    assert (found.fps, found.hands, found.notes) == (30.0, ("arm0_end", "arm1_end"), [])
    assert found.body.joints[0] == "mantle"
    times = np.arange(60) / 30
    np.testing.assert_allclose(
        found.recordings["one"].root_m, np.column_stack([np.sin(times), np.ones(60), times]) / 100, atol=1e-8
    )
    angle = np.radians(40.0 * np.sin(5 * times))
    expected = np.column_stack([0.02 * np.sin(angle), -0.02 * np.cos(angle), np.zeros(60)])
    np.testing.assert_allclose(any_body.places(found, "one")[:, 0], expected, atol=1e-7)
    assert any_body.reach_m(found.body, found.hands) == pytest.approx((0.02 + 0.03) / 2)


def test_the_axis_that_points_up_is_turned_to_y(tmp_path):
    squid(tmp_path / "one.bvh")
    upright = any_body.read(tmp_path, "m", "y")
    turned = any_body.read(tmp_path, "m", "z")
    rotated = any_body.places(upright, "one") @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).T
    np.testing.assert_allclose(any_body.places(turned, "one"), rotated, atol=1e-9)


def test_motion_of_the_skeleton_of_cospeech_is_motion_of_the_standard_body(tmp_path):
    rng = np.random.default_rng(1)
    motion = skeleton.motion_table(
        rng.normal(0, 0.1, (30, 3)), np.cumsum(rng.normal(0, 4, (30, len(skeleton.JOINTS), 3)), axis=0), 30.0
    )
    bvh.write(motion, tmp_path / "talk.bvh")
    found = any_body.read(tmp_path, "m", "y")
    assert found.body is STANDARD
    assert found.hands == ("left_hand", "right_hand")
    back = library.to_motion(found.recordings["talk"], 30.0)
    places = [
        skeleton.forward(table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(table))
        for table in (motion, back)
    ]
    for name in skeleton.JOINTS:
        np.testing.assert_allclose(places[1][name], places[0][name], atol=1e-5)
    assert isinstance(back, pd.DataFrame)


def test_another_rate_is_resampled_and_said_so(tmp_path):
    squid(tmp_path / "one.bvh", n=60, fps=30)
    squid(tmp_path / "two.bvh", n=120, fps=60)
    found = any_body.read(tmp_path, "m", "y")
    assert found.notes == ["two: resampled from 60 to 30 frames per second"]
    assert len(found.recordings["two"].root_m) == 60


def wrong(folder):
    """Folders that cannot be a library, with the reason."""
    for name in ("empty", "still", "mixed", "bones", "same"):
        (folder / name).mkdir()
    squid(folder / "still" / "one.bvh", swings=(0.0, 0.0))
    squid(folder / "mixed" / "one.bvh")
    squid(folder / "mixed" / "two.bvh", root="head")
    squid(folder / "bones" / "one.bvh")
    squid(folder / "bones" / "two.bvh", length=2.6)
    squid(folder / "same" / "one.bvh")
    shutil.copy(folder / "same" / "one.bvh", folder / "same" / "one.BVH")


@pytest.mark.parametrize(
    ("name", "hands", "reason"),
    [
        ("nowhere", (), "is not a folder"),
        ("empty", (), "contains no .bvh and no .glb file"),
        ("still", (), "no hand moves in any file"),
        ("mixed", (), r"two.bvh: has another skeleton than one.bvh \(joint 'head' is only in one of them\)"),
        ("bones", (), r"two.bvh: the bone of joint 'arm0_end' differs from that in one.bvh by 0.6 m"),
        ("bones", ("arm0_ende",), "differs"),
        ("same", (), "another recording 'one'"),
    ],
)
def test_a_folder_that_is_no_library_is_one_line(name, hands, reason, tmp_path):
    wrong(tmp_path)
    with pytest.raises(UserError, match=reason) as caught:
        any_body.read(tmp_path / name, "m", "y", hands)
    assert "\n" not in str(caught.value)


def test_an_unknown_hand_is_named_with_the_nearest_joint(tmp_path):
    squid(tmp_path / "one.bvh")
    with pytest.raises(UserError, match="no joint 'arm0_ende'; did you mean 'arm0_end'"):
        any_body.read(tmp_path, "m", "y", ("arm0_ende",))
    assert any_body.read(tmp_path, "m", "y", ("arm2_end",)).hands == ("arm2_end",)
