"""Binary glTF files against products of 4 x 4 matrices down the node tree."""

import struct
from pathlib import Path

import numpy as np
import pytest
from glb_files import by_matrices, packed, random_body
from scipy.spatial.transform import Rotation, Slerp

from cospeech.corpus.retarget import world_positions, world_rotations
from cospeech.errors import UserError
from cospeech.formats import glb

SPIDER = Path(__file__).parents[3] / "shared" / "data" / "creatures" / "Spider.glb"


def test_joints_are_where_the_node_tree_puts_them(tmp_path):
    rng = np.random.default_rng(1)
    for _ in range(10):
        nodes, joints, channels = random_body(rng)
        path = tmp_path / "body.glb"
        path.write_bytes(packed(nodes, joints, {"Rig|Wave": channels}))
        clip = glb.read(path)["Wave"]
        assert (clip.names, clip.parents, clip.fps) == (("root", "a", "c", "b"), (-1, 0, 0, 1), 24.0)
        turned = world_rotations(clip)
        placed = np.stack(world_positions(clip, turned), axis=1)
        for frame in range(13):
            world = by_matrices(nodes, channels, frame / 24)
            for joint, node in enumerate((2, 3, 5, 4)):
                np.testing.assert_allclose(placed[frame, joint], world[node][:3, 3], atol=2e-5)
                matrix = world[node][:3, :3]
                np.testing.assert_allclose(turned[frame, joint], matrix / np.cbrt(np.linalg.det(matrix)), atol=2e-5)


def test_frames_between_keys_are_interpolated_and_steps_are_held(tmp_path):
    rng = np.random.default_rng(2)
    nodes, joints, channels = random_body(rng)
    coarse = np.array([0.0, 0.25, 0.5])
    turns, places = Rotation.random(3, random_state=rng).as_quat(), rng.normal(size=(3, 3))
    channels = [*channels[:2], (3, "rotation", coarse, turns, "LINEAR"), (5, "translation", coarse, places, "STEP")]
    path = tmp_path / "body.glb"
    path.write_bytes(packed(nodes, joints, {"Wave": channels}))
    clip = glb.read(path)["Wave"]
    expected = Slerp(coarse, Rotation.from_quat(turns))(np.arange(13) / 24).as_matrix()
    np.testing.assert_allclose(clip.rotations[:, 1], expected, atol=1e-6)
    held = clip.places[2][:, 0]
    assert len(np.unique(held.round(9))) == 3
    np.testing.assert_array_equal(held[:6], held[0])
    np.testing.assert_array_equal(held[6:12], held[6])


def test_cubic_splines_pass_through_their_keys(tmp_path):
    rng = np.random.default_rng(3)
    nodes, joints, channels = random_body(rng)
    turns = Rotation.random(13, random_state=rng).as_quat()
    spline = np.stack([rng.normal(size=(13, 4)), turns, rng.normal(size=(13, 4))], axis=1).reshape(39, 4)
    path = tmp_path / "body.glb"
    path.write_bytes(
        packed(nodes, joints, {"Wave": [channels[0], (3, "rotation", np.arange(13) / 24, spline, "CUBICSPLINE")]})
    )
    np.testing.assert_allclose(
        glb.read(path)["Wave"].rotations[:, 1], Rotation.from_quat(turns).as_matrix(), atol=1e-6
    )


GOOD = random_body(np.random.default_rng(4))

MORPH = [(2, "weights", np.arange(13) / 24, np.zeros(13), "LINEAR")]
CHAIN = [{"name": f"n{k}", "children": [k + 1] if k < 9999 else []} for k in range(10_000)]

WRONG = {
    "another format": (b"HIERARCHY", "is not a binary glTF file"),
    "truncated": (packed(*GOOD[:2], {"Wave": GOOD[2]})[:-40], "is truncated"),
    "version 1": (b"glTF" + struct.pack("<II", 1, 20) + b"\0" * 8, "is not of glTF version 2"),
    "no animation": (packed(*GOOD[:2], {}), "has no animation"),
    "no skin": (packed(*GOOD[:2], {"Wave": GOOD[2]}, skins=[]), "has no skin"),
    "morph targets only": (packed(*GOOD[:2], {"Smile": MORPH}), "morph targets and no joint"),
    "morph targets without skin": (packed(*GOOD[:2], {"Smile": MORPH}, skins=[]), "morph targets and no joint"),
    "a single key": (
        packed(*GOOD[:2], {"Wave": [(2, "translation", [0.0], np.zeros((1, 3)), "LINEAR")]}),
        "two keys",
    ),
    "10,000 joints": (packed(CHAIN, list(range(10_000)), {"Wave": GOOD[2]}), "more than 1000 joints"),
    "data elsewhere": (packed(*GOOD[:2], {"Wave": GOOD[2]}, buffers=[{"uri": "x.bin"}]), "in other files"),
    "no accessors": (packed(*GOOD[:2], {"Wave": GOOD[2]}, accessors=[]), "is damaged"),
    "two roots": (packed(GOOD[0], [3, 5], {"Wave": GOOD[2][2:]}), "2 roots"),
    "circle": (packed([*GOOD[0][:4], {"children": [2]}, GOOD[0][5]], GOOD[1], {"Wave": GOOD[2]}), "form a circle"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_line(case, tmp_path):
    content, reason = WRONG[case]
    path = tmp_path / "body.glb"
    path.write_bytes(content)
    with pytest.raises(UserError, match=reason) as caught:
        glb.read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.recorded
def test_a_rigged_spider_has_its_five_animations():
    if not SPIDER.is_file():
        pytest.skip("the creature is not there: ../shared/data/creatures")
    clips = glb.read(SPIDER)
    assert [name.removeprefix("Spider_") for name in clips] == ["Attack", "Death", "Idle", "Jump", "Walk"]
    for clip in clips.values():
        assert len(clip.names) == 39
        turns = np.linalg.det(clip.rotations)
        np.testing.assert_allclose(turns, 1.0, atol=1e-6)
