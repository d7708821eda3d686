"""The drawn body in the form in which it leaves the program."""

from __future__ import annotations

import numpy as np

from cospeech.formats.glb_writer import Surface
from cospeech.rendering import body, figure

DETAIL = 2
"""Resolution of the mesh: finer than in videos, as other programs show it at any size."""


def surface(detail: int = DETAIL) -> Surface:
    """Return the surface of the standard body in its rest pose, as triangles with a colour per vertex."""
    mesh = body.mesh(detail)
    material = np.zeros(len(mesh.position), dtype=np.uint8)
    material[mesh.face] = mesh.material[:, None]  # parts of different materials share no vertex
    colours = np.array([figure.COLOURS[name] for name in body.MATERIALS], dtype=float) / 255
    weight = np.pad(np.stack([mesh.weight, 1 - mesh.weight], axis=1), ((0, 0), (0, 2)))
    joint = np.where(weight > 0, np.pad(mesh.joint, ((0, 0), (0, 2))), 0)  # glTF wants 0 for joints without weight
    return Surface(
        position=mesh.position.astype(float),
        normal=mesh.normal.astype(float),
        joint=joint.astype(np.uint16),
        weight=weight,
        triangle=np.concatenate([mesh.face[:, [0, 1, 2]], mesh.face[:, [0, 2, 3]]]).astype(np.uint32),
        colour=(colours**2.2)[material],
    )
