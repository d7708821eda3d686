"""Detection of interlaced images, whose odd and even lines show two moments.

The edges of what moves are combed there: along a column, the luma alternates from line to line. Textures and noise
alternate along the rows as well, combs do not.
"""

from __future__ import annotations

from cospeech.data.arrays import Plane
from cospeech.kernels.jit import njit

CONTRAST = 12
"""Smallest difference in luma between two lines of a comb."""

SHARE, FEWEST = 1e-4, 5
"""Number of combed pixels from which an image is interlaced: this share of the image, and at least this many."""

RATIO = 4
"""How many times more pixels must alternate along the columns than along the rows."""


def combed(luma: Plane) -> bool:
    """Return whether an image (H, W) is interlaced."""
    along_columns = _alternating(luma)
    return along_columns >= max(FEWEST, SHARE * luma.size) and along_columns > RATIO * _alternating(luma.T)


@njit
def _alternating(luma: Plane) -> int:
    """Return at how many pixels of every other column four alternating differences above ``CONTRAST`` start."""
    count = 0
    for y in range(luma.shape[0] - 4):
        for x in range(0, luma.shape[1], 2):
            first = int(luma[y + 1, x]) - int(luma[y, x])
            sign = 1 if first > 0 else -1
            if (
                sign * first > CONTRAST
                and sign * (int(luma[y + 1, x]) - int(luma[y + 2, x])) > CONTRAST
                and sign * (int(luma[y + 3, x]) - int(luma[y + 2, x])) > CONTRAST
                and sign * (int(luma[y + 3, x]) - int(luma[y + 4, x])) > CONTRAST
            ):
                count += 1
    return count
