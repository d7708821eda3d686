"""Surfaces of bodies for the viewer: that of the standard body, the same as in videos, and those of other files."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.formats.glb_mesh import Mesh, unit_frame
from cospeech.motion.body import STANDARD
from cospeech.rendering import export

DETAIL = 1
"""Resolution of the mesh of the standard body, that of the videos."""


def standard() -> Mesh:
    """Return the mesh of the standard body."""
    surface = export.surface(DETAIL)
    position, undo = unit_frame(surface.position)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(STANDARD.joints), 1))
    bind = np.tile(np.eye(4), (len(STANDARD.joints), 1, 1))
    bind[:, :3, 3] = -STANDARD.world(np.zeros((1, 3)), still)[1][0]
    joint = np.arange(len(STANDARD.joints))
    return Mesh(
        position, surface.normal, surface.colour, surface.joint, surface.weight, surface.triangle, joint, bind @ undo
    )


def packed(mesh: Mesh) -> dict[str, Any]:
    """Return a mesh as numbers and base64; fractions are whole numbers of 8 or 16 bits."""
    return {
        "position": _fractions(mesh.position, "<i2"),
        "normal": _fractions(mesh.normal, "<i2"),
        "colour": _fractions(mesh.colour, "<u2"),
        "slot": _base64(mesh.slot.astype("<u2")),
        "weight": _fractions(mesh.weight, "<u2"),
        "triangle": _base64(mesh.triangle.astype("<u4")),
        "joint": mesh.joint.tolist(),
        "bind": np.round(mesh.bind[:, :3], 9).reshape(len(mesh.bind), -1).tolist(),
    }


def _fractions(values: Floats, kind: str) -> str:
    """Return values, from -1 or 0 to 1, as base64 of whole numbers."""
    most = np.iinfo(kind).max
    return _base64(np.round(np.clip(values, np.iinfo(kind).min / most, 1.0) * most).astype(kind))


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
