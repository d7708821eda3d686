"""Sub-pixel detection of the red spot of a laser pointer.

The spot is the strongest compact red light: a bright core that is redder than its surroundings. Bloom is removed by
subtracting the level around the core. Reflections are weaker or more diffuse than the spot. If two lights could be
the spot, none is returned: a missing detection is better than a wrong one.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats, Plane
from cospeech.kernels.jit import njit

LEAST_RED = 20.0
"""Minimum Cr of the core above the neutral value 128; nothing in a darkened room reaches it."""
LEAST_LIGHT = 90.0
"""Minimum sum of Y and twice the redness at the core; weak reflections stay below it."""
RIVAL = 0.7
"""A second light of more than this fraction of the strongest makes the image ambiguous."""
CORE = 0.004
"""Radius of the averaged core, in image widths; at least three pixels."""
APART = 4.0
"""Distance beyond which a light counts as a separate one, in core radii."""
WIDEST = 0.8
"""Ratio of mean to peak brightness above which the core is a lit surface and not a spot."""


@njit
def _light(y: Plane, cr: Plane, row: int, column: int) -> float:
    """Return brightness plus twice the redness, averaged over the 3 x 3 pixels around one pixel."""
    total = 0.0
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            total += y[i, j] + 2.0 * max(float(cr[i, j]) - 128.0, 0.0)
    return total / 9.0


@njit
def _find(y: Plane, cr: Plane, width: int, radius: int, least_red: float) -> tuple[float, float, float, float, float]:
    """Return column and row of the spot, its light, that of its strongest rival, and the flatness of its core."""
    height = y.shape[0]
    best, rival, at_row, at_column = 0.0, 0.0, -1, -1
    red = 128.0 + least_red
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            if cr[row, column] >= red:
                light = _light(y, cr, row, column)
                if light > best:
                    best, at_row, at_column = light, row, column
    if at_row < 0:
        return np.nan, np.nan, 0.0, 0.0, 0.0
    apart = (APART * radius) ** 2
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            if cr[row, column] >= red and (row - at_row) ** 2 + (column - at_column) ** 2 > apart:
                rival = max(rival, _light(y, cr, row, column))
    x, y_centre = float(at_column), float(at_row)
    flat = 0.0
    for _ in range(3):  # recentre the window on the centroid, which a fixed window would bias to whole pixels
        ring, n_ring = 0.0, 0
        for row in range(max(int(y_centre) - 2 * radius, 0), min(int(y_centre) + 2 * radius + 2, height)):
            for column in range(max(int(x) - 2 * radius, 0), min(int(x) + 2 * radius + 2, width)):
                square = (row - y_centre) ** 2 + (column - x) ** 2
                if radius**2 < square <= (2 * radius) ** 2:
                    ring += y[row, column]
                    n_ring += 1
        level = ring / max(n_ring, 1)
        total, total_x, total_y, peak, n_core = 0.0, 0.0, 0.0, 0.0, 0
        for row in range(max(int(y_centre) - radius, 0), min(int(y_centre) + radius + 2, height)):
            for column in range(max(int(x) - radius, 0), min(int(x) + radius + 2, width)):
                square = (row - y_centre) ** 2 + (column - x) ** 2
                if square > (radius + 0.5) ** 2:
                    continue
                share = min(1.0, radius + 0.5 - np.sqrt(square))
                weight = share * max(y[row, column] - level, 0.0)
                total += weight
                total_x += weight * column
                total_y += weight * row
                peak = max(peak, y[row, column] - level)
                n_core += 1
        if total <= 0.0:
            return np.nan, np.nan, best, rival, 1.0
        x, y_centre = total_x / total, total_y / total
        flat = total / (peak * n_core)
    return x, y_centre, best, rival, flat


def find(y: Plane, cr: Plane, width: int | None = None) -> tuple[float, float]:
    """Return x and y of the spot in pixels, NaN if there is no spot or more than one candidate.

    Parameters
    ----------
    y, cr : full-range planes (H, W or wider).
    width : width of the image, if the planes are padded.
    """
    width = y.shape[1] if width is None else width
    radius = max(3, round(CORE * width))
    x, row, light, rival, flat = _find(y, cr, width, radius, LEAST_RED)
    if light < LEAST_LIGHT or rival > RIVAL * light or flat > WIDEST:
        return np.nan, np.nan
    return x, row


def detections(camera: str, pictures: Iterable[tuple[Plane, Plane, Plane]], width: int) -> pd.DataFrame:
    """Return the spots detected in one film as rows of the table ``laser`` (camera, frame, x_px, y_px)."""
    found = np.array([find(y, cr, width) for y, _, cr in pictures]).reshape(-1, 2)
    seen = np.flatnonzero(~np.isnan(found[:, 0]))
    return pd.DataFrame({"camera": camera, "frame": seen, "x_px": found[seen, 0], "y_px": found[seen, 1]})


def observations(table: pd.DataFrame, names: list[str]) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return pixels (C, N, 2) for the cameras ``names``, NaN where not detected, and the N frames with detections."""
    frames, columns = np.unique(table["frame"].to_numpy(), return_inverse=True)
    rows = pd.Index(names).get_indexer(pd.Index(table["camera"]))
    pixels = np.full((len(names), len(frames), 2), np.nan)
    pixels[rows[rows >= 0], columns[rows >= 0]] = table[["x_px", "y_px"]].to_numpy()[rows >= 0]
    return pixels, frames.astype(np.int64)
