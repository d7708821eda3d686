"""The images of one frame of a film of a head."""

from __future__ import annotations

from typing import NamedTuple

from cospeech.data.arrays import Plane

Planes = tuple[Plane, Plane, Plane]
"""Y, Cb and Cr of one image, each (H, W)."""


class Frame(NamedTuple):
    """One frame: its number, the planes of the left image, and the luma (H, W) of the right one if there is one."""

    number: int
    left: Planes
    right: Plane | None
