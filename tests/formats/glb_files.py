"""Binary glTF files for tests, and the matrices of their nodes."""

import json
import struct

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

COMPONENTS = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def packed(nodes, joints, animations, arrays=(), **changed):
    """A .glb file; ``animations`` go from name to channels (node, path, times, values, interpolation).

    The first accessors are those of ``arrays``; what is in ``changed`` replaces parts of the description.
    """
    binary, views, accessors, listed = b"", [], [], []

    def accessor(values, kind="f4"):
        nonlocal binary
        data = np.asarray(values, dtype=f"<{kind}")
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": data.nbytes})
        width = KINDS[1 if data.ndim == 1 else data.shape[1]]
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": COMPONENTS[kind], "count": len(data), "type": width}
        )
        binary += data.tobytes() + b"\0" * (-data.nbytes % 4)
        return len(accessors) - 1

    for values in arrays:
        accessor(values, values.dtype.str[1:])
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
