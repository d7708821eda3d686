"""Binary glTF files against products of 4 x 4 matrices down the node tree."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from cospeech.corpus.retarget import world_positions, world_rotations
from cospeech.errors import UserError
from cospeech.formats import glb

SPIDER = Path(__file__).parents[3] / "shared" / "data" / "creatures" / "Spider.glb"


def packed(nodes, joints, animations, **changed):
    """A .glb file; ``animations`` go from name to channels (node, path, times, values, interpolation)."""
    binary, views, accessors, listed = b"", [], [], []

    def accessor(values):
        nonlocal binary
        data = np.asarray(values, dtype="<f4")
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": data.nbytes})
        width = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[1 if data.ndim == 1 else data.shape[1]]
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": len(data), "type": width})
        binary += data.tobytes()
        return len(accessors) - 1

    for name, channels in animations.items():
        samplers = [
            {"input": accessor(times), "output": accessor(values), "interpolation": how}
            for _, _, times, values, how in channels
        ]
        targets = [
            {"sampler": place, "target": {"node": node, "path": path}}
            for place, (node, path, *_) in enumerate(channels)
        ]
        listed.append({"name": name, "samplers": samplers, "channels": targets})
    content = {
        "asset": {"version": "2.0"}, "nodes": nodes, "skins": [{"joints": joints}], "animations": listed,
        "bufferViews": views, "accessors": accessors, "buffers": [{"byteLength": len(binary)}],
    } | changed  # fmt: skip
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def random_body(rng):
    """Two still nodes above a chain of joints with a branch; the root moves and turns, the others turn."""

    def node(name, children):
        return {
            "name": name, "children": children, "translation": rng.normal(size=3).tolist(),
            "rotation": Rotation.random(random_state=rng).as_quat().tolist(),
            "scale": [float(rng.uniform(0.5, 2))] * 3,
        }  # fmt: skip

    nodes = [
        node("scene", [1]),
        node("armature", [2]),
        node("root", [3, 5]),
        node("a", [4]),
        node("b", []),
        node("c", []),
    ]
    times = np.arange(13) / 24
    channels = [(2, "translation", times, rng.normal(size=(13, 3)), "LINEAR")]
    channels += [(n, "rotation", times, Rotation.random(13, random_state=rng).as_quat(), "LINEAR") for n in (2, 3, 5)]
    return nodes, [2, 3, 4, 5], channels


def by_matrices(nodes, channels, time):
    """World matrix of every node at a time."""
    local = []
    for index, node in enumerate(nodes):
        moved, turned = np.array(node["translation"]), Rotation.from_quat(node["rotation"])
        for target, path, times, values, _ in channels:
            if target == index and path == "translation":
                moved = np.array([np.interp(time, times, column) for column in np.asarray(values).T])
            elif target == index:
                turned = Slerp(times, Rotation.from_quat(values))(time)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turned.as_matrix() * node["scale"][0], moved
        local.append(matrix)
    world = [None] * len(nodes)
    world[0] = local[0]
    for index, node in enumerate(nodes):
        for child in node["children"]:
            world[child] = world[index] @ local[child]
    return world


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

WRONG = {
    "another format": (b"HIERARCHY", "is not a binary glTF file"),
    "truncated": (packed(*GOOD[:2], {"Wave": GOOD[2]})[:-40], "is truncated"),
    "version 1": (b"glTF" + struct.pack("<II", 1, 20) + b"\0" * 8, "is not of glTF version 2"),
    "no animation": (packed(*GOOD[:2], {}), "has no animation"),
    "no skin": (packed(*GOOD[:2], {"Wave": GOOD[2]}, skins=[]), "has no skin"),
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
