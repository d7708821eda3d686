"""Colour unmixing: the fraction of a marker's colour in a pixel in Y, Cb, Cr, separated from skin (Özkul 2012, 2.3).

A pixel at the edge of a disc mixes the disc with its surroundings. The scene consists of dark suit, skin, white, and
red or green. The fractions of white, skin and red (or green) in a pixel are the solution of a linear system in its
luma and two chroma values, whatever the illumination. Red and green lie on opposite sides of skin in the chroma
plane, which decides between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.motion.markers import COLOURS

SKIN = (226, 190, 164)
"""Red, green and blue of skin, used until the actor's own is estimated."""

SKIN_TURN_DEG = 20.0
"""Largest angle in the chroma plane between the actor's skin and ``SKIN``."""

FEWEST_SKIN_PIXELS = 50


class Unmixer(NamedTuple):
    """Unmixing of one colour.

    Attributes
    ----------
    across : (2,) the chroma axis on which skin is 0.
    share : (2, 3) the weights of Y, Cb - 128 and Cr - 128 that give the fraction of the colour, where the coordinate
        on that axis is negative (towards green) and where it is positive (towards red).
    """

    across: Floats
    share: Floats


def chroma(rgb: npt.ArrayLike) -> Floats:
    """Return full-range Y, Cb - 128, Cr - 128 (..., 3) of red, green, blue (..., 3) (JFIF 1.02)."""
    matrix = np.array(
        [[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]],
    )
    return np.asarray(rgb, dtype=float) @ matrix.T


def unmixers(skin: Floats) -> dict[str, Unmixer]:
    """Return the unmixer of each marker colour, given the colour of the skin (3,) as Y, Cb - 128, Cr - 128."""
    white = chroma(COLOURS["white"]) * [1.0, 0.0, 0.0]  # neutral, so that it lies on neither side
    red, green = chroma(COLOURS["red"]), chroma(COLOURS["green"])
    across = np.array([-skin[2], skin[1]])
    across *= np.sign(across @ red[1:]) / np.linalg.norm(across)
    to_green = np.linalg.inv(np.column_stack([white, skin, green]))
    to_red = np.linalg.inv(np.column_stack([white, skin, red]))
    none = np.zeros(3)
    return {
        "white": Unmixer(across, np.stack([to_green[0], to_red[0]])),
        "red": Unmixer(across, np.stack([none, to_red[2]])),
        "green": Unmixer(across, np.stack([to_green[2], none])),
    }


def estimate_skin(pictures: list[Planes], widths: list[int]) -> Floats:
    """Return the colour of the actor's skin (3,) as Y, Cb - 128, Cr - 128, or of ``SKIN`` if the images show none.

    The estimate is the median of the pixels whose chroma is close to that of ``SKIN``.
    """
    expected = chroma(SKIN)
    found = []
    for planes, width in zip(pictures, widths, strict=True):
        y, cb, cr = (plane[::2, :width:2].ravel().astype(float) for plane in planes)
        pixels = np.column_stack([y, cb - 128.0, cr - 128.0])
        length = np.hypot(pixels[:, 1], pixels[:, 2])
        along = pixels[:, 1:] @ expected[1:] / (np.linalg.norm(expected[1:]) * np.maximum(length, 1e-9))
        ratio = length / np.maximum(y, 1.0)
        usual = np.linalg.norm(expected[1:]) / expected[0]
        near = (along > np.cos(np.radians(SKIN_TURN_DEG))) & (ratio > 0.5 * usual) & (ratio < 3.5 * usual) & (y > 60)
        found.append(pixels[near])
    seen = np.concatenate(found)
    return expected if len(seen) < FEWEST_SKIN_PIXELS else np.median(seen, axis=0)
