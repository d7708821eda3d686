"""Animations of skinned bodies in binary glTF files (.glb, version 2.0), which 3D programs export.

Lengths are in metres and y is up, as glTF defines. Of a file we read the joints of its first skin, their animations,
and the transforms of the nodes above them. Rotations and positions between keys are interpolated along the shortest
arc and linearly; the tangents of cubic splines are not used. Scales are those of the nodes; animated scales are
ignored.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cospeech.data import frame_rates
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import foreign
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation

MAGIC, VERSION = b"glTF", 2

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Component types of accessors, as numpy names them."""

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

LARGEST = 1e9
"""Numbers in the transform of a node that are as large as this, or larger, are errors."""

STILL = 1e-3
"""Largest range of the position of a joint, relative to its distance from its parent, at which it counts as fixed."""


def read(path: str | Path) -> dict[str, Clip]:
    """Return the animations of a file by name.

    Raises
    ------
    UserError : if it is not a binary glTF file of version 2, is truncated or malformed, refers to other files, or has
        no skin or no animation.
    """
    with opened(path) as file:
        return file.clips()


class Skeleton(NamedTuple):
    """The skeleton of the first skin of a file in its rest pose.

    Attributes
    ----------
    nodes : (J,) node of each joint in the file, parents first.
    names, parents : (J,) of the joints; -1 for the root.
    offsets_m : (J, 3) position of each joint in metres: the root in the world, all others in the frame of the parent.
    rotations : (J, 3, 3) of each joint: the root in the world, all others in the frame of the parent.
    above : rotation (3, 3), position (3,) and scale of the frame in which the root's own transform is given.
    """

    nodes: tuple[int, ...]
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets_m: Floats
    rotations: Floats
    above: tuple[Floats, Floats, float]


def chunks(path: str | Path) -> tuple[dict[str, Any], bytes]:
    """Return the description in a file, and its binary chunk.

    Raises
    ------
    UserError : if it is not a binary glTF file of version 2, or is truncated.
    """
    file = File(foreign.read_bytes(path), str(path))
    return file.json, file.binary


def skeleton(path: str | Path) -> Skeleton:
    """Return the skeleton of the first skin of a file, animated or not.

    Raises
    ------
    UserError : as for ``read``, apart from animations.
    """
    with opened(path) as file:
        return file.skeleton()


@contextmanager
def opened(path: str | Path) -> Iterator[File]:
    """Give the content of a file, and raise UserError if what is read from it turns out to be malformed."""
    content = foreign.read_bytes(path)
    try:
        yield File(content, str(path))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise UserError(f"{path}: is damaged ({type(error).__name__} while reading it); export it again") from error


class File:
    """The JSON and the binary chunk of a file."""

    def __init__(self, content: bytes, where: str) -> None:
        self.where = where
        if content[:4] != MAGIC:
            raise UserError(f"{where}: is not a binary glTF file; export it as .glb")
        if len(content) < 20 or len(content) < struct.unpack_from("<I", content, 8)[0]:
            raise UserError(f"{where}: is truncated; copy or export it again")
        if struct.unpack_from("<I", content, 4)[0] != VERSION:
            raise UserError(f"{where}: is not of glTF version {VERSION}; export it in that version")
        length = struct.unpack_from("<I", content, 12)[0]
        self.json: dict[str, Any] = json.loads(content[20 : 20 + length])
        self.binary = content[28 + length :]
        if any("uri" in buffer for buffer in self.json.get("buffers", [])):
            raise UserError(f"{where}: its data are in other files; export them into the .glb file")
        self.nodes: list[dict[str, Any]] = self.json.get("nodes", [])
        self.parent = {child: node for node, one in enumerate(self.nodes) for child in one.get("children", [])}

    def clips(self) -> dict[str, Clip]:
        """Return the animations."""
        if self.json.get("animations") and not self._moving():
            raise UserError(
                f"{self.where}: its animations move morph targets and no joint; export the motion of the armature"
            )
        if not self.json.get("skins"):
            raise UserError(f"{self.where}: has no skin, and so no joints; export the body with its armature")
        if not self.json.get("animations"):
            raise UserError(f"{self.where}: has no animation; export the body with its animations")
        joints = self.joints()
        found: dict[str, Clip] = {}
        for number, animation in enumerate(self.json["animations"]):
            name = str(animation.get("name", f"animation {number}")).rpartition("|")[2]
            found[name if name not in found else f"{name} {number}"] = self._clip(joints, animation)
        return found

    def skeleton(self) -> Skeleton:
        """Return the skeleton of the first skin."""
        if not self.json.get("skins"):
            raise UserError(f"{self.where}: has no skin, and so no joints; export the body with its armature")
        nodes = self.joints()
        index = {node: place for place, node in enumerate(nodes)}
        above = self._static(self.above(nodes[0]))
        offsets = np.array([self._local(node, "translation") for node in nodes])
        rotations = np.array([_matrices(self._local(node, "rotation")[None])[0] for node in nodes])
        turned, placed, scale = above
        offsets[0], rotations[0] = placed + scale * turned @ offsets[0], turned @ rotations[0]
        sizes = {nodes[0]: scale * self._size(nodes[0])}
        for node in nodes[1:]:
            offsets[index[node]] *= sizes[self.parent[node]]
            sizes[node] = sizes[self.parent[node]] * self._size(node)
        names = tuple(foreign.normalised(str(self.nodes[node].get("name", f"node {node}"))) for node in nodes)
        parents = tuple(index.get(self.parent.get(node, -1), -1) for node in nodes)
        return Skeleton(tuple(nodes), names, parents, offsets, rotations, above)

    def joints(self) -> list[int]:
        """Return the joints of the first skin, and all animated nodes above them, parents first."""
        animated = self._moving()
        wanted = set(self.json["skins"][0]["joints"])
        foreign.check_joint_frames(len(wanted), 0, self.where)
        for joint in list(wanted):
            above = self.above(joint)
            moving = [node for node in above if node in animated or node in wanted]
            wanted.update(above[: above.index(moving[-1]) + 1] if moving else [])
        ordered = sorted(wanted, key=lambda node: (len(self.above(node)), node))
        roots = [node for node in ordered if self.parent.get(node) not in wanted]
        if len(roots) != 1:
            raise UserError(f"{self.where}: its joints have {len(roots)} roots; export one body per file")
        foreign.check_joint_frames(len(ordered), 0, self.where)
        return ordered

    def _moving(self) -> set[int]:
        """Return the nodes that an animation moves, apart from those of which it only changes morph targets."""
        return {
            channel["target"]["node"]
            for animation in self.json.get("animations", [])
            for channel in animation["channels"]
            if "node" in channel["target"] and channel["target"]["path"] != "weights"
        }

    def above(self, node: int) -> list[int]:
        """Return the nodes above a node, from its parent on."""
        path: list[int] = []
        while node in self.parent:
            node = self.parent[node]
            if node in path:
                raise UserError(f"{self.where}: its nodes form a circle; export it again")
            path.append(node)
        return path

    def _clip(self, joints: list[int], animation: dict[str, Any]) -> Clip:
        samplers = animation["samplers"]
        channels = {
            (channel["target"].get("node"), channel["target"]["path"]): samplers[channel["sampler"]]
            for channel in animation["channels"]
        }
        keys = [self.numbers(sampler["input"])[:, 0] for sampler in samplers]
        longest = max(keys, key=len)
        if len(longest) < 2 or not (np.diff(longest) > 0).all():
            raise UserError(f"{self.where}: an animation has fewer than two keys; export its frames")
        seconds = float(np.median(np.diff(longest)))
        fps, notes = frame_rates.from_frame_time(f"{seconds:.5f}", self.where)
        if _has_ends(longest, fps):
            longest = longest[1:-1]
        n_frames = round((longest[-1] - longest[0]) * fps) + 1
        foreign.check_joint_frames(len(joints), n_frames, self.where)
        times = longest[0] + np.arange(n_frames) / fps
        index = {node: place for place, node in enumerate(joints)}
        turned, placed, scale = self._static(self.above(joints[0]))
        rotations, offsets, places = np.empty((n_frames, len(joints), 3, 3)), np.empty((len(joints), 3)), {}
        scales: dict[int, float] = {}
        for node, place in index.items():
            own = self._at(channels.get((node, "translation")), self._local(node, "translation"), times)
            local = self._turns_at(channels.get((node, "rotation")), self._local(node, "rotation"), times)
            if place == 0:
                own, local = placed + scale * own @ turned.T, turned @ local
                scales[node] = scale * self._size(node)
            else:
                own = own * scales[self.parent[node]]
                scales[node] = scales[self.parent[node]] * self._size(node)
            rotations[:, place], offsets[place] = local, own.mean(axis=0)
            if place == 0 or np.ptp(own, axis=0).max() > STILL * np.linalg.norm(offsets[place]):
                places[place] = own
        names = tuple(foreign.normalised(str(self.nodes[node].get("name", f"node {node}"))) for node in joints)
        parents = tuple(index.get(self.parent.get(node, -1), -1) for node in joints)
        return Clip(names, parents, rotations, places, fps, offsets, {}, tuple(notes))

    def _static(self, above: list[int]) -> tuple[Floats, Floats, float]:
        """Return rotation (3, 3), position (3,) and scale of the frame that the nodes above the root define."""
        turned, placed, scale = np.eye(3), np.zeros(3), 1.0
        for node in reversed(above):
            placed = placed + scale * turned @ self._local(node, "translation")
            turned = turned @ _matrices(self._local(node, "rotation")[None])[0]
            scale *= self._size(node)
        return turned, placed, scale

    def _local(self, node: int, what: str) -> Floats:
        if "matrix" in self.nodes[node]:
            raise UserError(f"{self.where}: node {node} has a matrix; export it with translation and rotation")
        default = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}[what]
        values = np.array(self.nodes[node].get(what, default), dtype=float)
        if values.shape != (len(default),) or not (np.abs(values) < LARGEST).all():
            raise UserError(
                f"{self.where}: the {what} of node {node} is not a list of {len(default)} finite numbers of "
                "usual size; export it again"
            )
        return values

    def _size(self, node: int) -> float:
        return float(self._local(node, "scale").mean())

    def _at(self, sampler: dict[str, Any] | None, rest: Floats, times: Floats) -> Floats:
        """Return a translation (T, 3) at ``times``; without a sampler, that of the node."""
        if sampler is None:
            return np.tile(rest, (len(times), 1))
        keys, values = self._keys(sampler)
        if sampler.get("interpolation") == "STEP":
            return values[np.clip(np.searchsorted(keys, times + 1e-6, "right") - 1, 0, None)]
        return np.stack([np.interp(times, keys, column) for column in values.T], axis=1)

    def _turns_at(self, sampler: dict[str, Any] | None, rest: Floats, times: Floats) -> Floats:
        """Return a rotation (T, 3, 3) at ``times``."""
        if sampler is None:
            return np.tile(_matrices(rest[None]), (len(times), 1, 1))
        keys, values = self._keys(sampler)
        matrices = _matrices(values)
        first = np.clip(np.searchsorted(keys, times + 1e-6, "right") - 1, 0, max(len(keys) - 2, 0))
        second = np.minimum(first + 1, len(keys) - 1)
        gap = np.where(second > first, keys[second] - keys[first], 1.0)
        share = np.clip((times - keys[first]) / gap, 0.0, 1.0)
        if sampler.get("interpolation") == "STEP":
            share = np.floor(share + 1e-6)
        between = rotation.to_vectors(np.swapaxes(matrices[first], 1, 2) @ matrices[second])
        return matrices[first] @ rotation.from_vectors(share[:, None] * between)

    def _keys(self, sampler: dict[str, Any]) -> tuple[Floats, Floats]:
        keys, values = self.numbers(sampler["input"])[:, 0], self.numbers(sampler["output"])
        if sampler.get("interpolation") == "CUBICSPLINE":
            values = values[1::3]  # between an incoming and an outgoing tangent
        if len(values) != len(keys):
            raise UserError(f"{self.where}: a channel has {len(keys)} keys and {len(values)} values; export it again")
        return keys, values

    def numbers(self, accessor: int) -> Floats:
        """Return the numbers of an accessor, (n, width); integers are normalised."""
        rows = self.rows(accessor)
        with np.errstate(invalid="ignore"):  # signalling NaNs, which are refused below
            values = rows.astype(np.float64)
        if rows.dtype.kind != "f":
            values = np.maximum(values / np.iinfo(rows.dtype).max, -1.0)
        if not np.isfinite(values).all():
            raise UserError(f"{self.where}: contains NaN or infinite numbers; export it again")
        return values

    def rows(self, accessor: int) -> npt.NDArray[Any]:
        """Return the numbers of an accessor as they are stored, (n, width)."""
        what = self.json["accessors"][accessor]
        view, width, kind = (
            self.json["bufferViews"][what["bufferView"]],
            WIDTHS[what["type"]],
            TYPES[what["componentType"]],
        )
        size, count = np.dtype(kind).itemsize, int(what["count"])
        stride = view.get("byteStride", width * size)
        start = view.get("byteOffset", 0) + what.get("byteOffset", 0)
        if (
            count < 1
            or start < 0
            or stride < width * size
            or start + stride * (count - 1) + width * size > len(self.binary)
        ):
            raise UserError(f"{self.where}: is truncated or damaged; copy or export it again")
        return np.ndarray((count, width), kind, self.binary, start, (stride, size))


def _has_ends(keys: Floats, fps: float) -> bool:
    """Return whether keys are at the centres of frames apart from those at both ends, as ``glb_writer`` sets them."""
    halves = np.array([keys[0], keys[1] - 0.5 / fps, keys[-1] - keys[-2] - 0.5 / fps])
    return len(keys) > 2 and bool(np.abs(halves).max() < 0.01 / fps)


def _matrices(quaternions: Floats) -> Floats:
    """Return the matrices (n, 3, 3) of quaternions (n, 4) x, y, z, w, which are normalised."""
    norms = np.linalg.norm(quaternions, axis=1, keepdims=True)
    unit = quaternions / np.where(norms > 0.0, norms, 1.0)
    return rotation.from_quaternions(unit[:, [3, 0, 1, 2]])
