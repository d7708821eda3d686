"""The shape of a person who is filmed: skull, face and ears, neck and shoulders, and a hand, as a mesh of triangles.

The frame of the head has its origin between the ears, x to the person's left, y up and z in the direction that the
face points, metres. The skull is an ellipsoid whose width and depth change with height. Nose, brow ridges, eye
sockets, lips and chin are displacements of its front, and hair is a displacement outward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers

HEIGHT_M, MIDDLE_M = 0.118, 0.002
"""Half of the height of the head, and the height of its middle."""
WIDTH_M, FRONT_M, BACK_M = 0.076, 0.086, 0.100
"""Half of the width, and depth in front of and behind the origin, at the height of the eyes."""

EYE_M = (0.031, 0.006)
EYEBALL_M = 0.0125
MOUTH_M = -0.0655
"""Place of the left eye, to the side and up; radius of an eyeball; height of the line between the lips."""
HAIRLINE_M = 0.072

JAW_M = np.array([0.0, -0.012, -0.005])
JAW_DEG = 8.0
"""The axis about which the jaw turns, which is parallel to x, and by how much in an open mouth."""

NECK_M = np.array([0.0, -0.105, -0.030])
"""The point of the neck about which the head turns."""

COLUMNS, ROWS = 96, 88
"""Cells of the mesh around the head, and from its lowest point to its highest."""

SLIT_M = 0.0009
"""Half of the distance of the two rows of the mesh between which the mouth opens."""


class Bump(NamedTuple):
    """A displacement with a Gaussian profile: its size, and the middle and deviation of the profile, metres."""

    size_m: float
    at_m: tuple[float, float]
    spread_m: tuple[float, float]

    def at(self, x: Floats, y: Floats) -> Floats:
        """Return the displacement at places across and up, on both sides of the face."""
        across = (np.abs(x) - self.at_m[0]) / self.spread_m[0]
        upward = (y - self.at_m[1]) / self.spread_m[1]
        return np.asarray(self.size_m * np.exp(-0.5 * (across * across + upward * upward)))


FEATURES = {
    "brow ridge": Bump(0.0050, (0.027, 0.025), (0.020, 0.007)),
    "glabella": Bump(0.0025, (0.0, 0.024), (0.010, 0.010)),
    "eye socket": Bump(-0.0100, (0.030, 0.005), (0.015, 0.010)),
    "cheekbone": Bump(0.0055, (0.043, -0.024), (0.018, 0.016)),
    "hollow cheek": Bump(-0.0040, (0.047, -0.060), (0.014, 0.018)),
    "nostril": Bump(0.0075, (0.0115, -0.0385), (0.0055, 0.0050)),
    "mouth": Bump(0.0060, (0.0, -0.064), (0.024, 0.018)),
    "upper lip": Bump(0.0042, (0.0, -0.0605), (0.017, 0.0032)),
    "lower lip": Bump(0.0052, (0.0, -0.0715), (0.015, 0.0040)),
    "corner of the mouth": Bump(-0.0025, (0.027, -0.0655), (0.005, 0.005)),
    "groove below the lip": Bump(-0.0040, (0.0, -0.0830), (0.017, 0.0055)),
    "chin": Bump(0.0105, (0.0, -0.0990), (0.018, 0.0120)),
    "temple": Bump(-0.0040, (0.066, 0.030), (0.012, 0.022)),
}
"""Displacements of the front of the skull, forward."""


@dataclass(frozen=True)
class Mesh:
    """A mesh of V vertices and F triangles with the places of its vertices in a texture.

    Attributes
    ----------
    places_m, normals : (V, 3) in the frame of the head while it does not turn.
    texels : (V, 2) column and row in the texture.
    follows : (V,) share in which a vertex moves with the head rather than with the trunk.
    jaw_m : (V, 3) displacement with an open mouth.
    hand : (V,) whether a vertex belongs to the hand, whose places are relative to its middle.
    triangles : (F, 3) vertices, anticlockwise as seen from outside.
    """

    places_m: Floats
    normals: Floats
    texels: Floats
    follows: Floats
    jaw_m: Floats
    hand: Flags
    triangles: Integers


class Part(NamedTuple):
    """A part of the mesh, a grid of N rows and M columns of vertices.

    Attributes
    ----------
    places_m : (N, M, 3) vertices.
    follows : (N, M) share in which they move with the head.
    columns, rows : (M,) and (N,) positions from 0 to 1 in the texture of the part.
    """

    places_m: Floats
    follows: Floats
    columns: Floats
    rows: Floats


def smooth(edge: float, width: float, values: Floats) -> Floats:
    """Return a step (...) from 0 below ``edge`` to 1 above it, over ``width``, without a kink."""
    share = np.clip((values - edge) / width + 0.5, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def longitude(columns: Floats) -> Floats:
    """Return the angle to the left in radians at positions 0 to 1 around the head; most belong to the face."""
    u = 2.0 * columns - 1.0
    return np.asarray(np.pi * (0.55 * u + 0.45 * u**3))


def latitude(rows: Floats) -> Floats:
    """Return the angle upward in radians at positions 0 to 1 from the lowest point of the head to the highest."""
    v = 2.0 * rows - 1.0
    return np.asarray(0.5 * np.pi * (0.7 * v + 0.3 * v**3))


def _row(height_m: float) -> float:
    """Return the position 0 to 1, from the lowest point of the head to the highest, at one height."""
    grid = np.linspace(0.0, 1.0, 2001)
    return float(np.interp(height_m, MIDDLE_M + HEIGHT_M * np.sin(latitude(grid)), grid))


def skull(columns: Floats, rows: Floats) -> Floats:
    """Return places (..., 3) on the head at positions (...) from 0 to 1 around it and from below to above."""
    theta, phi = longitude(columns), latitude(rows)
    y = MIDDLE_M + HEIGHT_M * np.sin(phi)
    level = np.cos(phi)
    jaw = smooth(0.062, 0.10, -y)
    wide = WIDTH_M * (1.0 - 0.30 * jaw) * level**0.70
    front = np.cos(theta) > 0.0
    deep = np.where(front, FRONT_M * level**0.38, BACK_M * (1.0 - 0.45 * jaw) * level**0.62)
    x = wide * np.sin(theta)
    z = deep * np.sign(np.cos(theta)) * np.abs(np.cos(theta)) ** np.where(front, 0.80, 1.0)
    facing = smooth(0.35, 0.5, np.cos(theta))
    z = z + facing * _relief(x, y)
    hair = 0.012 * smooth(0.012, 0.028, hair_depth(x, y, z))
    ear = _ear(y, z) * smooth(0.8, 0.3, np.abs(np.sin(theta)))
    outward = np.stack([np.sin(theta) * level, np.sin(phi), np.cos(theta) * level], axis=-1)
    place = np.stack([x + np.sign(x) * ear, y, z - 0.3 * ear], axis=-1)
    return np.asarray(place + hair[..., None] * outward)


def _relief(x: Floats, y: Floats) -> Floats:
    """Return the displacement of the face forward at places across and up, metres."""
    relief = sum((bump.at(x, y) for bump in FEATURES.values()), np.zeros_like(x))
    nose = np.interp(y, (-0.0480, -0.0420, -0.0340, 0.0100, 0.0260), (0.0, 0.0130, 0.0235, 0.0060, 0.0))
    slim = np.interp(y, (-0.0400, 0.0100), (0.0085, 0.0060))
    side, up = EYE_M
    ball = EYEBALL_M**2 - (np.abs(x) - side) ** 2 - (y - up) ** 2
    return np.asarray(relief + nose * np.exp(-0.5 * (x / slim) ** 2) + 0.45 * np.sqrt(np.maximum(ball, 0.0)))


def hair_depth(x: Floats, y: Floats, z: Floats) -> Floats:
    """Return how far inside of the hair the surface lies at places (...), metres; negative outside of it."""
    above = y - HAIRLINE_M + 12.0 * np.maximum(np.abs(x) - 0.035, 0.0) ** 2
    behind = np.minimum(-z - 0.034, y + 0.085)
    temple = np.minimum(y - 0.026 - 0.5 * np.maximum(z, 0.0), 0.030 - z)
    return np.maximum(above, np.maximum(behind, temple))


def _ear(y: Floats, z: Floats) -> Floats:
    """Return the displacement of the sides of the head outward that forms the ears."""
    away = np.hypot((z + 0.012) / 0.016, (y + 0.004) / 0.031)
    return np.asarray(0.015 * smooth(-1.0, 0.25, -away) * (0.75 + 0.25 * smooth(0.55, 0.4, away)))


def _head() -> Part:
    columns = np.linspace(0.0, 1.0, COLUMNS + 1)
    even = np.linspace(0.0, 1.0, ROWS + 1)
    slit = np.array([_row(MOUTH_M - SLIT_M), _row(MOUTH_M + SLIT_M)])
    apart = np.abs(even[:, None] - slit).min(axis=1) > 0.3 / ROWS
    rows = np.sort(np.append(even[apart], slit))
    places = skull(*np.meshgrid(columns, rows))
    return Part(places, np.ones(places.shape[:2]), columns, rows)


def _neck() -> Part:
    columns, rows = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 17)
    turn, up = np.meshgrid(2.0 * np.pi * columns - np.pi, rows)
    y = -0.215 + 0.155 * up
    radius = 0.052 + 0.022 * np.maximum(0.35 - up, 0.0) ** 2 / 0.1225 - 0.004 * np.sin(np.pi * up)
    throat = 0.006 * np.exp(-0.5 * ((turn / 0.25) ** 2 + ((y + 0.135) / 0.012) ** 2))
    places = np.stack([radius * np.sin(turn), y, -0.028 + (radius + throat) * np.cos(turn)], axis=-1)
    return Part(places, smooth(-0.125, 0.10, y), columns, rows)


def _shoulders() -> Part:
    columns, rows = np.linspace(0.0, 1.0, 49), np.linspace(0.0, 1.0, 25)
    turn, up = np.meshgrid(2.0 * np.pi * columns - np.pi, 0.5 * np.pi * rows)
    level = np.cos(up) ** 0.55
    x = 0.225 * level * np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** 0.9
    z = -0.035 + 0.105 * level * np.cos(turn)
    y = -0.400 + 0.240 * np.sin(up) ** 0.6 - 0.045 * np.abs(x / 0.225) ** 1.5
    return Part(np.stack([x, y, z], axis=-1), np.zeros(x.shape), columns, rows)


def _hand() -> Part:
    """Return a raised hand with the palm towards the face, whose fingers are ridges."""
    columns, rows = np.linspace(0.0, 1.0, 49), np.linspace(0.0, 1.0, 33)
    turn, up = np.meshgrid(2.0 * np.pi * columns - np.pi, np.pi * (rows - 0.5))
    level = np.cos(up) ** 0.4
    x = 0.043 * level * np.sin(turn)
    fingers = smooth(0.0, 0.02, 0.090 * np.sin(up)) * np.abs(np.sin(np.pi * (x / 0.0215)))
    y = 0.092 * np.sin(up) - 0.012 * smooth(0.02, 0.08, 0.092 * np.sin(up)) * (x / 0.043) ** 2
    z = (0.013 * level + 0.004 * fingers) * np.cos(turn)
    return Part(np.stack([x, y, z], axis=-1), np.zeros(x.shape), columns, rows)


PARTS = {"head": _head, "neck": _neck, "shoulders": _shoulders, "hand": _hand}
"""The parts of the mesh, in the order in which their textures lie above one another."""


def mesh(sizes: dict[str, tuple[int, int]]) -> Mesh:
    """Return the mesh of head, neck, shoulders and hand.

    Parameters
    ----------
    sizes : height and width in texels of the texture of each of ``PARTS``.
    """
    places, normals, texels, follows, triangles = [], [], [], [], []
    first, top = 0, 0
    for name, part in PARTS.items():
        made = part()
        height, width = sizes[name]
        n, m = made.places_m.shape[:2]
        cell = np.arange(n * m).reshape(n, m)
        low, right, up, both = cell[:-1, :-1], cell[:-1, 1:], cell[1:, :-1], cell[1:, 1:]
        corners = [np.stack([low, right, both], axis=-1), np.stack([low, both, up], axis=-1)]
        faces = np.concatenate([each.reshape(-1, 3) for each in corners])
        flat = made.places_m.reshape(-1, 3)
        column, row = np.meshgrid(made.columns * (width - 1), top + (1.0 - made.rows) * (height - 1))
        places.append(flat)
        normals.append(_normals(flat, faces))
        texels.append(np.column_stack([column.ravel(), row.ravel()]))
        follows.append(made.follows.ravel())
        triangles.append(faces + first)
        first, top = first + len(flat), top + height
    whole, faces = np.concatenate(places), np.concatenate(triangles)
    part_of = np.repeat(np.arange(len(places)), [len(part) for part in places])
    return Mesh(
        whole, np.concatenate(normals), np.concatenate(texels), np.concatenate(follows),
        _jaw(whole, part_of == 0), part_of == len(places) - 1, faces,
    )  # fmt: skip


def _normals(places_m: Floats, triangles: Integers) -> Floats:
    """Return the unit normal (V, 3) of each vertex: the mean of those of its triangles, weighted by their areas."""
    a, b, c = (places_m[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    total = np.zeros_like(places_m)
    for k in range(3):
        np.add.at(total, triangles[:, k], across)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def _jaw(places_m: Floats, moves: Flags) -> Floats:
    """Return the displacement (V, 3) of an open mouth: the lower lip and the chin turn about the axis of the jaw.

    Between the corners of the mouth, all that is below the line between the lips moves; beside them, the skin is
    stretched gradually.
    """
    x, y, z = places_m.T
    width = np.interp(np.abs(x), (0.010, 0.027, 0.06), (SLIT_M, 0.020, 0.060))
    share = moves * smooth(0.0, 1.0, (MOUTH_M - y) / width) * smooth(0.035, 0.05, z)
    angle = np.radians(JAW_DEG)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(angle), -np.sin(angle)], [0.0, np.sin(angle), np.cos(angle)]])
    away = places_m - JAW_M
    return np.asarray(share[:, None] * (away @ turn.T - away))
