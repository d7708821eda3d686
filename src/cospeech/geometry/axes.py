"""Axes of files that other programs wrote, and the rotation from them to the axes of the world."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

DIRECTIONS = {f"{sign}{axis}": number * np.eye(3)["xyz".index(axis)] for sign, number in (("", 1.0), ("-", -1.0))
              for axis in "xyz"}  # fmt: skip
"""Unit vectors of a file's axes by name."""


def world_rotation(up: str, facing: str, section: str) -> Floats:
    """Return the rotation (3, 3) from a file's axes to ours: x to the actor's left, y up, z in the facing direction.

    Parameters
    ----------
    up, facing : the axis of the file that points up, and the one in which the actor faces: x, y, z, -x, -y or -z.
    section : the section of the configuration that declares them, for error messages.

    Raises
    ------
    UserError : if a name is not an axis, or both lie along the same axis.
    """
    for name in (up, facing):
        if name not in DIRECTIONS:
            raise UserError(
                f"{section}: '{name}' is not an axis; set up and facing to one of {', '.join(DIRECTIONS)}"
            )
    left = np.cross(DIRECTIONS[up], DIRECTIONS[facing])
    if not left.any():
        raise UserError(f"{section}: up is '{up}' and facing is '{facing}'; they must lie along different axes")
    return np.stack([left, DIRECTIONS[up], DIRECTIONS[facing]])
