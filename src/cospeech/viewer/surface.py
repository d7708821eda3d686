"""The surface of the standard body for the viewer, the same as in videos."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from cospeech.rendering import export

DETAIL = 1
"""Resolution of the mesh, that of the videos."""


def packed() -> dict[str, Any]:
    """Return the mesh of the standard body in its rest pose in base64, with linear colours of its vertices."""
    surface = export.surface(DETAIL)
    return {
        "position": _base64(surface.position.astype("<f4")),
        "normal": _base64(surface.normal.astype("<f4")),
        "joint": _base64(surface.joint.astype("<u2")),
        "weight": _base64(surface.weight.astype("<f4")),
        "triangle": _base64(surface.triangle.astype("<u4")),
        "colour": _base64(surface.colour.astype("<f4")),
    }


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
