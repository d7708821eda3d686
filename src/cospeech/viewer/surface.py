"""The surface of the standard body for the viewer: the mesh of the videos, as triangles."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from cospeech.rendering import body, figure

DETAIL = 1
"""Resolution of the mesh, that of the videos."""


def triangles(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the two triangles (2 F, 3) of each quadrilateral (F, 4)."""
    return np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def packed() -> dict[str, Any]:
    """Return the mesh of the standard body in its rest pose, with the colours (0 to 255) of its vertices."""
    mesh = body.mesh(DETAIL)
    material = np.zeros(len(mesh.position), dtype=np.uint8)
    material[mesh.face] = mesh.material[:, None]  # parts of different materials share no vertex
    colours = np.array([figure.COLOURS[name] for name in body.MATERIALS], dtype=np.uint8)
    return {
        "position": _base64(mesh.position.astype("<f4")),
        "normal": _base64(mesh.normal.astype("<f4")),
        "joint": _base64(mesh.joint.astype("<u2")),
        "weight": _base64(mesh.weight.astype("<f4")),
        "triangle": _base64(triangles(mesh.face).astype("<u4")),
        "colour": _base64(colours[material]),
    }


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
