"""Mesh of the drawn body: a surface around the skeleton, skinned to its joints.

Each part is lofted through rings along one axis in the rest pose (upright, hanging arms), so that a small table of
dimensions in metres defines its shape. Each vertex follows one joint, or a blend of two near the bend between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from cospeech.motion import skeleton

MATERIALS = ("skin", "hair", "shirt", "trousers", "shoe", "left_arm", "right_arm", "eye", "pupil", "lips")
"""Names of the materials, in the order of the indices in ``Mesh.material``."""


@dataclass(frozen=True)
class Part:
    """One lofted part.

    Attributes
    ----------
    material : name of the material.
    axis : direction of the loft, y or z. Width is along x; depth is along z, or along y if the axis is z.
    rings : one row per ring: position along the axis, half width, half depth, centre in width, centre in depth, in m.
    joints : the joints that the part spans.
    bends : positions along the axis at which the skin passes from one joint to the next, in m.
    blend : distance from a bend, to either side, over which the two joints are blended, in m.
    exponent : exponent of the superelliptic outline: 2 gives an ellipse, larger values a rounded box.
    sides : number of vertices around a ring in the coarsest mesh.
    """

    material: str
    axis: str
    rings: tuple[tuple[float, float, float, float, float], ...]
    joints: tuple[str, ...]
    bends: tuple[float, ...] = ()
    blend: float = 0.05
    exponent: float = 2.0
    sides: int = 9


def _bulge(material: str, centre_m: tuple[float, float, float], radii_m: tuple[float, float, float]) -> Part:
    """Return an ellipsoid on the head, by the position of its centre and its half width, height and depth."""
    levels = (-0.98, -0.8, -0.4, 0.0, 0.4, 0.8, 0.98)
    rings = [(level, math.sqrt(1.0 - level * level)) for level in levels]
    (x, y, z), (width, height, depth) = centre_m, radii_m
    table = tuple((y + height * level, width * share, depth * share, x, z) for level, share in rings)
    return Part(material, "y", table, ("head",), sides=8)


class Mesh(NamedTuple):
    """A mesh of V vertices and F quadrilateral faces in the rest pose.

    Attributes
    ----------
    position : (V, 3) vertex positions in metres.
    normal : (V, 3) unit normals.
    joint : (V, 2) indices of the two joints that a vertex follows.
    weight : (V,) skinning weight of the first joint; the second has 1 - weight.
    face : (F, 4) vertex indices, counter-clockwise seen from outside.
    material : (F,) index into ``MATERIALS``.
    """

    position: npt.NDArray[np.float32]
    normal: npt.NDArray[np.float32]
    joint: npt.NDArray[np.int32]
    weight: npt.NDArray[np.float32]
    face: npt.NDArray[np.int32]
    material: npt.NDArray[np.uint8]


MIDDLE = (
    Part(
        "shirt", "y",
        (
            (0.935, 0.010, 0.010, 0, -0.005), (0.937, 0.150, 0.100, 0, -0.005), (0.948, 0.164, 0.115, 0, -0.006),
            (1.010, 0.156, 0.110, 0, -0.005), (1.070, 0.143, 0.102, 0, -0.003), (1.130, 0.140, 0.100, 0, -0.002),
            (1.210, 0.151, 0.108, 0, -0.004), (1.290, 0.167, 0.117, 0, -0.008), (1.350, 0.175, 0.116, 0, -0.012),
            (1.400, 0.172, 0.102, 0, -0.018), (1.440, 0.146, 0.083, 0, -0.022), (1.465, 0.100, 0.069, 0, -0.024),
            (1.482, 0.062, 0.056, 0, -0.022), (1.486, 0.010, 0.010, 0, -0.022),
        ),
        ("hips", "spine", "chest"), (1.06, 1.21), 0.07, 2.5, 12,
    ),
    Part(
        "trousers", "y",
        (
            (0.800, 0.010, 0.010, 0, -0.005), (0.805, 0.050, 0.060, 0, -0.005), (0.835, 0.125, 0.090, 0, -0.006),
            (0.880, 0.156, 0.107, 0, -0.008), (0.930, 0.157, 0.107, 0, -0.007), (0.970, 0.150, 0.100, 0, -0.005),
            (0.980, 0.010, 0.010, 0, -0.005),
        ),
        ("hips",), exponent=2.4, sides=12,
    ),
    Part(
        "skin", "y",
        (
            (1.420, 0.010, 0.010, 0, -0.022), (1.425, 0.058, 0.058, 0, -0.022), (1.490, 0.051, 0.053, 0, -0.014),
            (1.540, 0.049, 0.051, 0, -0.006), (1.600, 0.047, 0.048, 0, -0.004), (1.610, 0.010, 0.010, 0, 0),
        ),
        ("chest", "neck", "head"), (1.45, 1.55), 0.04,
    ),
    Part(
        "skin", "y",
        (
            (1.512, 0.008, 0.008, 0, 0.040), (1.516, 0.026, 0.030, 0, 0.036), (1.535, 0.047, 0.056, 0, 0.026),
            (1.570, 0.063, 0.078, 0, 0.015), (1.610, 0.071, 0.090, 0, 0.010), (1.655, 0.075, 0.096, 0, 0.006),
            (1.700, 0.071, 0.091, 0, 0.002), (1.730, 0.058, 0.073, 0, -0.001), (1.750, 0.037, 0.046, 0, -0.003),
            (1.757, 0.008, 0.010, 0, -0.003),
        ),
        ("head",), exponent=2.2, sides=11,
    ),
    Part(
        "skin", "y",
        (
            (1.586, 0.004, 0.004, 0, 0.098), (1.590, 0.014, 0.014, 0, 0.103), (1.602, 0.016, 0.017, 0, 0.105),
            (1.625, 0.011, 0.014, 0, 0.101), (1.645, 0.008, 0.009, 0, 0.097), (1.650, 0.002, 0.002, 0, 0.095),
        ),
        ("head",), sides=6,
    ),
    Part(
        "hair", "y",
        (
            (1.575, 0.010, 0.008, 0, -0.062), (1.582, 0.044, 0.026, 0, -0.055), (1.610, 0.066, 0.050, 0, -0.045),
            (1.655, 0.080, 0.072, 0, -0.030), (1.700, 0.079, 0.091, 0, -0.009), (1.735, 0.067, 0.085, 0, -0.004),
            (1.760, 0.045, 0.058, 0, -0.006), (1.772, 0.020, 0.026, 0, -0.008), (1.774, 0.004, 0.006, 0, -0.008),
        ),
        ("head",), exponent=2.2, sides=11,
    ),
    _bulge("lips", (0.0, 1.5555, 0.0825), (0.0215, 0.0060, 0.0085)),
)  # fmt: skip

LEFT = (
    _bulge("eye", (0.0305, 1.6530, 0.0905), (0.0145, 0.0070, 0.0095)),
    _bulge("pupil", (0.0315, 1.6530, 0.0962), (0.0058, 0.0060, 0.0048)),
    _bulge("hair", (0.033, 1.6715, 0.0885), (0.0185, 0.0040, 0.0085)),
    _bulge("skin", (0.075, 1.6380, 0.0020), (0.0070, 0.0280, 0.0160)),
    Part(
        "left_arm", "y",
        (
            (1.462, 0.006, 0.006, 0.166, -0.020), (1.458, 0.026, 0.028, 0.170, -0.020),
            (1.440, 0.050, 0.052, 0.174, -0.020), (1.405, 0.062, 0.062, 0.179, -0.020),
            (1.360, 0.061, 0.061, 0.182, -0.020), (1.300, 0.054, 0.056, 0.182, -0.020),
            (1.220, 0.048, 0.050, 0.181, -0.020), (1.150, 0.043, 0.045, 0.180, -0.020),
            (1.110, 0.042, 0.044, 0.180, -0.020), (1.070, 0.043, 0.045, 0.180, -0.018),
            (1.010, 0.040, 0.043, 0.180, -0.018), (0.940, 0.034, 0.036, 0.180, -0.020),
            (0.885, 0.030, 0.032, 0.180, -0.020), (0.868, 0.029, 0.032, 0.180, -0.020),
            (0.864, 0.006, 0.006, 0.180, -0.020),
        ),
        ("left_arm", "left_forearm"), (1.11,), 0.035,
    ),
    Part(
        "skin", "y",
        (
            (0.890, 0.005, 0.005, 0.180, -0.020), (0.888, 0.021, 0.026, 0.180, -0.020),
            (0.860, 0.020, 0.027, 0.180, -0.020), (0.825, 0.020, 0.037, 0.180, -0.018),
            (0.790, 0.019, 0.043, 0.178, -0.016), (0.755, 0.017, 0.042, 0.174, -0.016),
            (0.715, 0.015, 0.037, 0.166, -0.018), (0.690, 0.012, 0.028, 0.158, -0.019),
            (0.678, 0.008, 0.016, 0.153, -0.020), (0.675, 0.002, 0.003, 0.152, -0.020),
        ),
        ("left_forearm", "left_hand"), (0.86,), 0.02, 2.3,
    ),
    Part(
        "skin", "y",
        (
            (0.835, 0.003, 0.003, 0.176, 0.006), (0.832, 0.013, 0.013, 0.176, 0.007),
            (0.805, 0.014, 0.015, 0.172, 0.026), (0.775, 0.012, 0.013, 0.167, 0.042),
            (0.752, 0.010, 0.011, 0.163, 0.050), (0.742, 0.006, 0.006, 0.161, 0.052),
            (0.740, 0.001, 0.001, 0.161, 0.052),
        ),
        ("left_hand",), sides=6,
    ),
    Part(
        "trousers", "y",
        (
            (0.960, 0.010, 0.010, 0.082, -0.008), (0.950, 0.060, 0.075, 0.084, -0.008),
            (0.900, 0.082, 0.096, 0.086, -0.006), (0.830, 0.084, 0.096, 0.088, -0.004),
            (0.720, 0.075, 0.085, 0.089, 0.000), (0.600, 0.064, 0.070, 0.090, 0.002),
            (0.500, 0.057, 0.061, 0.090, 0.002), (0.450, 0.056, 0.061, 0.090, -0.003),
            (0.370, 0.056, 0.064, 0.090, -0.010), (0.270, 0.050, 0.056, 0.090, -0.008),
            (0.160, 0.044, 0.048, 0.090, -0.002), (0.085, 0.043, 0.049, 0.090, 0.002),
            (0.075, 0.040, 0.046, 0.090, 0.002), (0.072, 0.006, 0.006, 0.090, 0.002),
        ),
        ("left_thigh", "left_shin"), (0.49,), 0.06, 2.1,
    ),
    Part(
        "shoe", "z",
        (
            (-0.062, 0.006, 0.006, 0.090, 0.035), (-0.058, 0.026, 0.026, 0.090, 0.038),
            (-0.030, 0.037, 0.046, 0.090, 0.048), (0.010, 0.039, 0.050, 0.090, 0.052),
            (0.060, 0.040, 0.040, 0.091, 0.041), (0.115, 0.045, 0.029, 0.093, 0.030),
            (0.165, 0.043, 0.023, 0.093, 0.024), (0.200, 0.030, 0.018, 0.091, 0.020),
            (0.212, 0.015, 0.010, 0.090, 0.018), (0.215, 0.003, 0.003, 0.090, 0.018),
        ),
        ("left_foot",), exponent=2.5,
    ),
)  # fmt: skip


def mesh(detail: int) -> Mesh:
    """Return the mesh of the body; ``detail`` is the number of subdivisions between two rings of the table."""
    parts = [_loft(part, detail, mirrored=False) for part in (*MIDDLE, *LEFT)]
    parts += [_loft(part, detail, mirrored=True) for part in LEFT]
    offsets = np.cumsum([0, *(len(part.position) for part in parts[:-1])])
    return Mesh(
        position=np.concatenate([part.position for part in parts]),
        normal=np.concatenate([part.normal for part in parts]),
        joint=np.concatenate([part.joint for part in parts]),
        weight=np.concatenate([part.weight for part in parts]),
        face=np.concatenate([part.face + np.int32(offset) for part, offset in zip(parts, offsets, strict=True)]),
        material=np.concatenate([part.material for part in parts]),
    )


def hull(surface: Mesh) -> npt.NDArray[np.float64]:
    """Return the corners (J, 8, 3) of the bounding box of each joint's vertices, in the joint's frame, in metres.

    A vertex that follows two joints is in the boxes of both. Whatever the pose, the whole surface therefore lies
    within the convex hull of all corners.
    """
    rest = skeleton.chain(np.zeros((1, 3)), np.zeros((1, len(skeleton.JOINTS), 3)))[1][0]
    corners = np.zeros((len(skeleton.JOINTS), 8, 3))
    for number, origin in enumerate(rest):
        follows = (surface.joint[:, 0] == number) & (surface.weight > 0)
        follows |= (surface.joint[:, 1] == number) & (surface.weight < 1)
        if follows.any():
            ends = surface.position[follows].min(axis=0) - origin, surface.position[follows].max(axis=0) - origin
            corners[number] = [[ends[i][0], ends[j][1], ends[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    return corners


def _loft(part: Part, detail: int, mirrored: bool) -> Mesh:
    if mirrored:
        joints = tuple(joint.replace("left_", "right_") for joint in part.joints)
        part = replace(part, joints=joints, material=part.material.replace("left_", "right_"))
    table = np.array(part.rings)
    steps = np.linspace(0, len(table) - 1, (len(table) - 1) * detail + 1)
    along, width, depth, middle_width, middle_depth = PchipInterpolator(np.arange(len(table)), table)(steps).T
    around = part.sides * (1 + detail) // 2
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    outline_width = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** (2 / part.exponent)
    outline_depth = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** (2 / part.exponent)
    across = middle_width[:, None] + width[:, None] * outline_width
    deep = middle_depth[:, None] + depth[:, None] * outline_depth
    level = np.broadcast_to(along[:, None], across.shape)
    position = np.stack([across, level, deep] if part.axis == "y" else [across, deep, level], axis=-1)
    if mirrored:
        position = position * [-1, 1, 1]
    joint, weight = _skinning(part, level.ravel())
    face = _outward(_strips(len(along), around), position.reshape(-1, 3))
    return Mesh(
        position.reshape(-1, 3).astype(np.float32),
        _normals(position.reshape(-1, 3), face).astype(np.float32),
        joint,
        weight,
        face,
        np.full(len(face), MATERIALS.index(part.material), dtype=np.uint8),
    )


def _strips(n_rings: int, around: int) -> npt.NDArray[np.int32]:
    """Return the faces (F, 4) between adjacent rings of vertices that are numbered ring by ring."""
    ring, side = np.divmod(np.arange((n_rings - 1) * around), around)
    corner, adjacent = ring * around + side, ring * around + (side + 1) % around
    return np.stack([corner, adjacent, adjacent + around, corner + around], axis=-1).astype(np.int32)


def _outward(face: npt.NDArray[np.int32], position: npt.NDArray[np.float64]) -> npt.NDArray[np.int32]:
    """Return the faces of a closed surface, oriented so that they are counter-clockwise seen from outside."""
    a, b, c, d = (position[face[:, k]] for k in range(4))
    volume = np.einsum("fi,fi->", a + b + c + d, np.cross(c - a, d - b))
    return face if volume > 0 else np.ascontiguousarray(face[:, ::-1])


def _normals(position: npt.NDArray[np.float64], face: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
    """Return the unit normals of the vertices: the area-weighted means of the normals of their faces."""
    a, b, c, d = (position[face[:, k]] for k in range(4))
    across = np.cross(c - a, d - b)
    normal = np.zeros_like(position)
    for k in range(4):
        np.add.at(normal, face[:, k], across)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def _skinning(part: Part, level: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float32]]:
    """Return the two joints (V, 2) that vertices at ``level`` along a part follow, and the weight of the first."""
    numbers = [skeleton.JOINTS.index(joint) for joint in part.joints]
    joint = np.full((len(level), 2), numbers[0])
    weight = np.ones(len(level))
    ascending = part.rings[0][0] < part.rings[-1][0]
    for number, before, bend in zip(numbers[1:], numbers, part.bends, strict=False):
        beyond = (level - bend) if ascending else (bend - level)
        step = np.clip(0.5 + beyond / (2 * part.blend), 0, 1)
        reached = step > 0
        joint[reached] = (before, number)
        weight[reached] = (1 - step * step * (3 - 2 * step))[reached]
    return joint.astype(np.int32), weight.astype(np.float32)
