"""Write a moving body as binary glTF (.glb, version 2.0), for Blender, Unity, Unreal and browsers.

The file contains the joints as nodes in their rest pose, a surface that is skinned to them, and one animation.
Lengths are in metres, y is up, and a body faces +z, as glTF recommends. Keys of the animation are at the centres of
frames, and the first and the last pose also stand at its start and its end, so that it lasts exactly as long as its
frames.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import glb
from cospeech.formats.glb import MAGIC, VERSION
from cospeech.geometry import rotation
from cospeech.motion.body import Body
from cospeech.motion.library import Poses

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125
COMPONENT = {"f4": FLOAT, "u2": UNSIGNED_SHORT, "u4": UNSIGNED_INT}
KIND = {0: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942

BONE_SHARE = 0.12
"""Half width of a drawn bone, relative to its length."""


class Surface(NamedTuple):
    """A surface of V vertices and F triangles around a body in its rest pose, where all rotations are zero.

    Attributes
    ----------
    position, normal : (V, 3) in metres, and of length 1.
    joint, weight : (V, 4) joints that a vertex follows, and how much it follows each; weights sum to 1.
    triangle : (F, 3) vertices, counter-clockwise seen from outside.
    colour : (V, 3) linear red, green and blue, 0 to 1.
    """

    position: Floats
    normal: Floats
    joint: npt.NDArray[np.uint16]
    weight: Floats
    triangle: npt.NDArray[np.uint32]
    colour: Floats


def bones(body: Body) -> Surface:
    """Return a surface for a body that has none: a four-sided spindle along each bone, a small one at each end."""
    rest = body.world(np.zeros((1, 3)), np.tile([1.0, 0, 0, 0], (1, len(body.joints), 1)))[1][0]
    lengths = np.linalg.norm(body.offsets_m[1:], axis=1)
    small = 0.15 * float(np.median(lengths[lengths > 0])) if (lengths > 0).any() else 0.05
    parts = []
    for joint in range(len(body.joints)):
        children = np.flatnonzero(body.parents == joint)
        ends = rest[children] if len(children) else [rest[joint] + [0.0, small, 0.0]]
        parts += [(joint, rest[joint], end) for end in ends if np.linalg.norm(end - rest[joint]) > 1e-9]
    corners = np.concatenate([_spindle(start, end) for _, start, end in parts])
    joints = np.zeros((len(corners), 4), dtype=np.uint16)
    joints[:, 0] = np.repeat([number for number, _, _ in parts], 24)
    a, b, c = corners[0::3], corners[1::3], corners[2::3]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    n_vertices = len(corners)
    return Surface(
        corners,
        np.repeat(normal, 3, axis=0),
        joints,
        np.tile([1.0, 0.0, 0.0, 0.0], (n_vertices, 1)),
        np.arange(n_vertices, dtype=np.uint32).reshape(-1, 3),
        np.full((n_vertices, 3), 0.5),
    )


def _spindle(start: Floats, end: Floats) -> Floats:
    """Return the corners (24, 3) of eight triangles between two points, widest at a fifth of the way."""
    along = end - start
    length = np.linalg.norm(along)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across *= BONE_SHARE * length / np.linalg.norm(across)
    other = np.cross(along, across) / length
    ring = start + 0.2 * along + np.array([across, other, -across, -other])
    faces = [[start, ring[(k + 1) % 4], ring[k]] for k in range(4)]
    faces += [[end, ring[k], ring[(k + 1) % 4]] for k in range(4)]
    return np.array(faces).reshape(24, 3)


def write(path: str | Path, name: str, body: Body, poses: Poses, fps: float, surface: Surface | None = None) -> None:
    """Write a moving body.

    Parameters
    ----------
    name : name of the animation.
    body, poses, fps : the body, its poses in T frames, and their rate.
    surface : the surface of the body; None draws its bones (see ``bones``).

    Raises
    ------
    UserError : if there is no frame.
    """
    n_frames = len(poses.root_m)
    if n_frames == 0:
        raise UserError(f"{path}: there is no frame to write; name a file with motion")
    file = _File(bytearray(), [], [])
    skin = _skin(file, body, bones(body) if surface is None else surface)
    root, turns = at_keys(poses.root_m + body.offsets_m[0], poses.rotations)
    file.animate(name, key_times(n_frames, fps), range(len(body.joints)), root, turns)
    with tables.replacing(path) as temporary:
        temporary.write_bytes(file.content(skin))


def write_animation(
    path: str | Path, model: str | Path, name: str, body: glb.Skeleton, poses: Poses, fps: float
) -> None:
    """Write a copy of a GLB file with another animation in place of its own.

    Parameters
    ----------
    model : the file to copy.
    name : name of the animation.
    body : its skeleton.
    poses, fps : poses in T frames, and their rate. The displacement of the root is that from its rest position, in
        the world in metres; all rotations are in parent space, that of the root in the world.
    """
    described, binary = glb.chunks(model)
    turned, placed, scale = body.above
    file = _File(bytearray(binary), described.get("bufferViews", []), described.get("accessors", []))
    root = (poses.root_m + body.offsets_m[0] - placed) @ turned / scale
    turns = np.array(poses.rotations)
    turns[:, 0] = rotation.to_quaternions(turned.T @ rotation.from_quaternions(turns[:, 0]))
    file.animate(name, key_times(len(root), fps), body.nodes, *at_keys(root, turns))
    kept = {key: value for key, value in described.items() if key not in ("asset", "animations")}
    with tables.replacing(path) as temporary:
        temporary.write_bytes(file.content(kept))


def key_times(n_frames: int, fps: float) -> Floats:
    """Return the times (T + 2,) of keys in seconds: the start, the centre of each frame, and the end."""
    return np.concatenate([[0.0], (np.arange(n_frames) + 0.5) / fps, [n_frames / fps]])


def at_keys(root: Floats, turns: Floats) -> tuple[Floats, Floats]:
    """Return the positions (T, 3) and rotations (T, J, 4) of frames at the keys: the first and the last one twice."""
    keys = np.concatenate([[0], np.arange(len(root)), [len(root) - 1]])
    return root[keys], turns[keys]


def _skin(file: _File, body: Body, surface: Surface) -> dict[str, Any]:
    """Add the nodes, the mesh and the skin to a file, and return its description of them."""
    n_joints = len(body.joints)
    rest = body.world(np.zeros((1, 3)), np.tile([1.0, 0, 0, 0], (1, n_joints, 1)))[1][0]
    inverse = np.tile(np.eye(4), (n_joints, 1, 1))
    inverse[:, :3, 3] = -rest
    nodes: list[dict[str, Any]] = []
    for joint, title in enumerate(body.joints):
        children = np.flatnonzero(body.parents == joint).tolist()
        node = {"name": title, "translation": body.offsets_m[joint].tolist()}
        nodes.append(node | ({"children": children} if children else {}))
    nodes.append({"name": "body", "mesh": 0, "skin": 0})
    attributes = {
        "POSITION": file.add(surface.position.astype("<f4"), ARRAY_BUFFER, bounds=True),
        "NORMAL": file.add(surface.normal.astype("<f4"), ARRAY_BUFFER),
        "JOINTS_0": file.add(surface.joint.astype("<u2"), ARRAY_BUFFER),
        "WEIGHTS_0": file.add(surface.weight.astype("<f4"), ARRAY_BUFFER),
        "COLOR_0": file.add(surface.colour.astype("<f4"), ARRAY_BUFFER),
    }
    indices = file.add(surface.triangle.ravel().astype("<u4"), ELEMENT_ARRAY_BUFFER)
    matrices = np.swapaxes(inverse, 1, 2).reshape(n_joints, 16)  # column by column
    material = {"name": "body", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9}}
    return {
        "scene": 0,
        "scenes": [{"nodes": [0, n_joints]}],
        "nodes": nodes,
        "materials": [material],
        "meshes": [{"name": "body", "primitives": [{"attributes": attributes, "indices": indices, "material": 0}]}],
        "skins": [
            {"joints": list(range(n_joints)), "skeleton": 0, "inverseBindMatrices": file.add(matrices.astype("<f4"))}
        ],
    }


class _File:
    """The binary chunk of a file, and the descriptions of what is in it."""

    def __init__(self, binary: bytearray, views: list[dict[str, Any]], accessors: list[dict[str, Any]]) -> None:
        self.binary = binary + bytes(-len(binary) % 4)
        self.views = list(views)
        self.accessors = list(accessors)
        self.animations: list[dict[str, Any]] = []

    def add(self, values: npt.NDArray[Any], target: int | None = None, bounds: bool = False) -> int:
        """Add numbers (n,) or (n, width), and return the number of their accessor."""
        content = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)}
        self.views.append(view | ({"target": target} if target else {}))
        self.binary += content + bytes(-len(content) % 4)
        accessor = {
            "bufferView": len(self.views) - 1,
            "componentType": COMPONENT[values.dtype.str[1:]],
            "count": len(values),
            "type": KIND[values.shape[1] if values.ndim > 1 else 0],
        }
        if bounds:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def animate(self, name: str, times: Floats, nodes: Sequence[int], root: Floats, turns: Floats) -> None:
        """Add an animation that moves the first node (K, 3) and turns all nodes (K, J, 4; w, x, y, z) at K keys."""
        keys = self.add(times.astype("<f4"), bounds=True)
        samplers = [{"input": keys, "output": self.add(root.astype("<f4")), "interpolation": "LINEAR"}]
        channels: list[dict[str, Any]] = [{"sampler": 0, "target": {"node": nodes[0], "path": "translation"}}]
        for joint, node in enumerate(nodes):
            values = self.add(np.roll(turns[:, joint], -1, axis=1).astype("<f4"))  # x, y, z, w
            samplers.append({"input": keys, "output": values, "interpolation": "LINEAR"})
            channels.append({"sampler": joint + 1, "target": {"node": node, "path": "rotation"}})
        self.animations.append({"name": name, "samplers": samplers, "channels": channels})

    def content(self, described: dict[str, Any]) -> bytes:
        """Return the file: header, JSON and binary chunk."""
        whole = {
            "asset": {"version": "2.0", "generator": "cospeech"},
            **described,
            "animations": self.animations,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.binary)}],
        }
        text = json.dumps(whole, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(self.binary)
        return b"".join(
            [
                MAGIC,
                struct.pack("<II", VERSION, length),
                struct.pack("<II", len(text), JSON_CHUNK),
                text,
                struct.pack("<II", len(self.binary), BINARY_CHUNK),
                self.binary,
            ]
        )
