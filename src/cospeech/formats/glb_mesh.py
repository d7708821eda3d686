"""The surface of the body in a binary glTF file, as triangles that follow its joints.

All triangles that are skinned to the joints, or hang on one of them, become one mesh; what hangs on no joint, such as
scenery, is left out. Morph targets have the weights that the file gives them at rest. A vertex has one colour: the
base colour of its material times its own colour times that of the texture at its place.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import glb
from cospeech.geometry import rotation

TRIANGLES = 4
"""The mode of primitives that consist of separate triangles, the only ones that are read."""

MAX_PIXELS = 8192 * 8192
"""Largest texture; what has a larger one is drawn in its base colour."""

DRACO = "KHR_draco_mesh_compression"


class Mesh(NamedTuple):
    """A surface of n vertices, m triangles and S slots; in each slot, a joint carries vertices.

    Attributes
    ----------
    position : (n, 3) places of the vertices in the frame of their slots, from -1 to 1.
    normal : (n, 3) unit vectors in the same frame.
    colour : (n, 3) linear red, green and blue, from 0 to 1.
    slot, weight : (n, 4) slots that carry a vertex, and their weights, whose sum is 1.
    triangle : (m, 3) vertices of each triangle.
    joint : (S,) index of the joint of each slot.
    bind : (S, 4, 4) matrices from the frame of the vertices to that of the joint, in metres.
    """

    position: Floats
    normal: Floats
    colour: Floats
    slot: npt.NDArray[np.integer[Any]]
    weight: Floats
    triangle: npt.NDArray[np.integer[Any]]
    joint: npt.NDArray[np.integer[Any]]
    bind: Floats


def read(path: str | Path) -> Mesh | None:
    """Return the surface of the body in a file, or None if it has none; its joints are those of ``glb.skeleton``.

    Raises
    ------
    UserError : as for ``glb.skeleton``, or if the meshes are compressed.
    """
    with glb.opened(path) as file:
        parts = list(_Body(file).parts())
    return _joined(parts) if parts else None


def unit_frame(position: Floats) -> tuple[Floats, Floats]:
    """Return positions (n, 3) scaled into the range from -1 to 1, and the matrix (4, 4) that undoes this."""
    low, high = position.min(axis=0), position.max(axis=0)
    undo = np.diag([*[max(float(np.max(high - low)) / 2, 1e-9)] * 3, 1.0])
    undo[:3, 3] = (low + high) / 2
    return (position - undo[:3, 3]) / undo[0, 0], undo


def _joined(parts: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    vertices = np.cumsum([0, *(len(part.position) for part in parts)])
    slots = np.cumsum([0, *(len(part.joint) for part in parts)])
    moved = [
        part._replace(slot=part.slot + slot, triangle=part.triangle + vertex)
        for part, vertex, slot in zip(parts, vertices[:-1], slots[:-1], strict=True)
    ]
    return Mesh(*(np.concatenate(columns) for columns in zip(*moved, strict=True)))


class _Body:
    """A file, its joints, and where they are in the rest pose."""

    def __init__(self, file: glb.File) -> None:
        self.file = file
        skeleton = file.skeleton()
        self.index = {node: joint for joint, node in enumerate(skeleton.nodes)}
        self.rigid = np.tile(np.eye(4), (len(skeleton.nodes), 1, 1))
        for joint, parent in enumerate(skeleton.parents):
            self.rigid[joint, :3, :3], self.rigid[joint, :3, 3] = skeleton.rotations[joint], skeleton.offsets_m[joint]
            if parent >= 0:
                self.rigid[joint] = self.rigid[parent] @ self.rigid[joint]

    def parts(self) -> Iterator[Mesh]:
        """Yield the mesh of each primitive that follows joints."""
        for node, content in enumerate(self.file.nodes):
            if "mesh" not in content:
                continue
            mesh = self.file.json["meshes"][content["mesh"]]
            weights = content.get("weights", mesh.get("weights", []))
            skin = self.file.json["skins"][content["skin"]] if "skin" in content else None
            carriers = [node] if skin is None else skin["joints"]
            anchors = [self._anchor(carrier) for carrier in carriers]
            if None in anchors:
                continue
            joint = np.array(anchors, dtype=np.int64)
            bind = np.linalg.inv(self.rigid[joint]) @ np.array([self._world(carrier) for carrier in carriers])
            if skin is not None and "inverseBindMatrices" in skin:
                inverse = self.file.numbers(skin["inverseBindMatrices"])[: len(carriers)]
                bind = bind @ inverse.reshape(-1, 4, 4).swapaxes(1, 2)  # glTF stores columns
            for primitive in mesh["primitives"]:
                if primitive.get("mode", TRIANGLES) == TRIANGLES and "POSITION" in primitive["attributes"]:
                    yield self._part(primitive, weights, joint, bind, skin is not None)

    def _part(
        self,
        primitive: dict[str, Any],
        weights: list[float],
        joint: npt.NDArray[np.int64],
        bind: Floats,
        skinned: bool,
    ) -> Mesh:
        if DRACO in primitive.get("extensions", {}):
            raise UserError(f"{self.file.where}: its meshes are compressed (Draco); export it without compression")
        attributes = primitive["attributes"]
        placed = self.file.numbers(attributes["POSITION"])
        for weight, target in zip(weights, primitive.get("targets", []), strict=False):
            if weight and "POSITION" in target:
                placed = placed + weight * self.file.numbers(target["POSITION"])
        position, undo = unit_frame(placed)
        triangle = self._triangles(primitive, len(position))
        normal = self.file.numbers(attributes["NORMAL"]) if "NORMAL" in attributes else _normals(position, triangle)
        slot, share = self._shares(attributes, len(joint)) if skinned else _hanging(len(position))
        colour = self._colours(primitive, len(position))
        return Mesh(position, normal, colour, slot, share, triangle, joint, bind @ undo)

    def _triangles(self, primitive: dict[str, Any], n: int) -> npt.NDArray[np.int64]:
        vertices = np.arange(n) if "indices" not in primitive else self.file.rows(primitive["indices"])[:, 0]
        triangle = vertices[: len(vertices) // 3 * 3].reshape(-1, 3).astype(np.int64)
        if triangle.max(initial=0) >= n:
            raise UserError(f"{self.file.where}: a triangle has a vertex that does not exist; export it again")
        return triangle

    def _shares(self, attributes: dict[str, int], n_slots: int) -> tuple[npt.NDArray[np.int64], Floats]:
        """Return the slots (n, 4) that carry skinned vertices, and their weights (n, 4)."""
        slot = self.file.rows(attributes["JOINTS_0"]).astype(np.int64)
        if slot.max() >= n_slots:
            raise UserError(f"{self.file.where}: a vertex has a joint that does not exist; export it again")
        weight = self.file.numbers(attributes["WEIGHTS_0"])
        return slot, weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-9)

    def _colours(self, primitive: dict[str, Any], n: int) -> Floats:
        attributes = primitive["attributes"]
        material = self.file.json["materials"][primitive["material"]] if "material" in primitive else {}
        surface = material.get("pbrMetallicRoughness", {})
        colours = np.tile(np.array(surface.get("baseColorFactor", [1.0] * 4), dtype=float)[:3], (n, 1))
        if "COLOR_0" in attributes:
            colours = colours * self.file.numbers(attributes["COLOR_0"])[:, :3]
        texture = surface.get("baseColorTexture")
        if texture is None:
            return colours
        image = self._image(self.file.json["textures"][texture["index"]])
        places = attributes.get(f"TEXCOORD_{texture.get('texCoord', 0)}")
        return colours if image is None or places is None else colours * _sampled(image, self.file.numbers(places))

    def _image(self, texture: dict[str, Any]) -> npt.NDArray[np.uint8] | None:
        """Return an image (h, w, 3) in sRGB; None if it cannot be decoded, or is larger than ``MAX_PIXELS``."""
        source = self.file.json["images"][texture["source"]] if "source" in texture else {}
        if "bufferView" not in source:
            return None
        view = self.file.json["bufferViews"][source["bufferView"]]
        start = view.get("byteOffset", 0)
        try:
            with Pillow.open(io.BytesIO(self.file.binary[start : start + view["byteLength"]])) as image:
                return np.asarray(image.convert("RGB")) if image.width * image.height <= MAX_PIXELS else None
        except (OSError, SyntaxError, Pillow.DecompressionBombError):  # what Pillow raises for damaged images
            return None

    def _anchor(self, node: int) -> int | None:
        """Return the joint that carries a node: the node itself, or the closest one above it."""
        return next((self.index[one] for one in (node, *self.file.above(node)) if one in self.index), None)

    def _world(self, node: int) -> Floats:
        """Return the matrix (4, 4) of a node in the world, in the rest pose."""
        matrix = np.eye(4)
        for one in (node, *self.file.above(node)):
            matrix = _matrix(self.file.nodes[one]) @ matrix
        return matrix


def _matrix(node: dict[str, Any]) -> Floats:
    """Return the matrix (4, 4) of a node in the frame of its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    quaternion = np.array([w, x, y, z]) / (np.linalg.norm([w, x, y, z]) or 1.0)
    matrix[:3, :3] = rotation.from_quaternions(quaternion) * np.array(node.get("scale", [1.0] * 3))
    matrix[:3, 3] = node.get("translation", [0.0] * 3)
    return matrix


def _hanging(n: int) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return slots and weights (n, 4) of vertices that the first slot carries."""
    return np.zeros((n, 4), dtype=np.int64), np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))


def _normals(position: Floats, triangle: npt.NDArray[np.int64]) -> Floats:
    """Return the mean direction of the triangles around each vertex, weighted by their area."""
    a, b, c = (position[triangle[:, corner]] for corner in range(3))
    across = np.cross(b - a, c - a)
    total = np.zeros_like(position)
    for corner in range(3):
        np.add.at(total, triangle[:, corner], across)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def _sampled(image: npt.NDArray[np.uint8], places: Floats) -> Floats:
    """Return the linear colours (n, 3) of an image, which repeats itself, at texture coordinates (n, 2)."""
    height, width = image.shape[:2]
    pixel = np.minimum((places % 1.0 * [width, height]).astype(int), [width - 1, height - 1])
    srgb = image[pixel[:, 1], pixel[:, 0]] / 255.0
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
