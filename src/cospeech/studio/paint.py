"""The compiled part of filming: rays against capsules, the nearest wins; sixteen rays a pixel around markers.

Everything stands in the axes of the camera, metres. Plain arithmetic on one thread: the same picture on every run.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Planes = npt.NDArray[np.uint8]
Integers = npt.NDArray[np.int64]

SAMPLES = 4
"""Rays along either side of a pixel around markers."""
AMBIENT = 0.72
"""Share of light from all sides: the studio is lit diffusely (2.4 of the thesis)."""


def solids(ends: Floats, radii: Floats) -> Floats:
    """Return what ``strike`` asks of capsules with ``ends`` (n, 2, 3) and ``radii`` (n,), as rows (n, 10).

    Their first end a, the way b to the second, the radius, and a.a, b.b, a.b; a ball is a capsule of length 0.
    """
    a, b = ends[:, 0], ends[:, 1] - ends[:, 0]
    products = [np.einsum("ni,ni->n", one, other) for one, other in ((a, a), (b, b), (a, b))]
    return np.column_stack([a, b, radii, *products])


@numba.njit(cache=True)
def strike(x: float, y: float, solid: Floats) -> tuple[float, float]:
    """Return depth z, and the cosine towards the camera, where ray (x, y, 1) enters a solid; infinite if it misses.

    The ray enters through the cylinder where it meets it between the ends, and else through the ball at the end
    that it passes: |t d - a - s b| = r with s clipped to [0, 1].
    """
    ax, ay, az, bx, by, bz, radius, aa, bb, ab = solid
    dd = x * x + y * y + 1.0
    ad = ax * x + ay * y + az
    share = 0.0
    if bb > 1e-12:
        bd = bx * x + by * y + bz
        p = dd - bd * bd / bb
        q = ad - ab * bd / bb
        root = q * q - p * (aa - ab * ab / bb - radius * radius)
        if root < 0.0:
            return np.inf, 0.0
        if p > 1e-12:
            t = (q - np.sqrt(root)) / p
            share = (t * bd - ab) / bb
            if 0.0 <= share <= 1.0:
                return t, _facing(x, y, t, dd, ax + share * bx, ay + share * by, az + share * bz, radius)
        share = 1.0 if share > 1.0 else 0.0
    cx, cy, cz = ax + share * bx, ay + share * by, az + share * bz
    q = cx * x + cy * y + cz
    root = q * q - dd * (cx * cx + cy * cy + cz * cz - radius * radius)
    if root < 0.0:
        return np.inf, 0.0
    t = (q - np.sqrt(root)) / dd
    return t, _facing(x, y, t, dd, cx, cy, cz, radius)


@numba.njit(cache=True)
def _facing(x: float, y: float, t: float, dd: float, cx: float, cy: float, cz: float, radius: float) -> float:
    """Return the cosine between the ray, turned round, and the surface at depth t around the centre c."""
    return -((x * t - cx) * x + (y * t - cy) * y + t - cz) / (radius * np.sqrt(dd))


@numba.njit(cache=True)
def span(pixels: Floats, reach: float, row: int, width: int) -> tuple[int, int]:
    """Return the columns, the last excluded, that a bar of half-width ``reach`` from one of ``pixels`` to the other
    may cover in a row."""
    x0, y0 = pixels[0]
    x1, y1 = pixels[1]
    low, high = 0.0, 1.0
    if abs(y1 - y0) > 1e-9:
        enter, leave = (row - reach - y0) / (y1 - y0), (row + reach - y0) / (y1 - y0)
        low, high = max(low, min(enter, leave)), min(high, max(enter, leave))
    if low > high:
        return 0, 0
    one, other = x0 + low * (x1 - x0), x0 + high * (x1 - x0)
    first, last = min(one, other) - reach, max(one, other) + reach
    return max(0, int(np.floor(first))), min(width, int(np.ceil(last)) + 1)


@numba.njit(cache=True)
def draw(
    picture: Singles,
    depth: Singles,
    sight: Singles,
    solid: Floats,
    pixels: Floats,
    reach: Floats,
    paint: Singles,
    n_limbs: int,
    box: Integers,
) -> Floats:
    """Draw limbs, then markers, onto ``picture`` (3, H, W); return the pixels of each marker that are seen (m,).

    Parameters
    ----------
    depth : (H, W) working space.
    sight : (H, W, 2) slopes of the ray of each pixel.
    solid : (n, 10) rows of ``solids``, limbs first.
    pixels, reach : (n, 2, 2), (n,) where the ends are seen, and how far from them a solid may be seen, pixels.
    paint : (n, 3) Y, Cb, Cr in full light.
    box : left, top, right, bottom, the last two excluded, of all that may be covered.
    """
    height, width = depth.shape
    depth[box[1] : box[3], box[0] : box[2]] = np.inf
    for k in range(n_limbs):
        top, bottom = _rows(pixels[k], reach[k], height)
        for row in range(top, bottom):
            left, right = span(pixels[k], reach[k], row, width)
            for column in range(left, right):
                z, cosine = strike(sight[row, column, 0], sight[row, column, 1], solid[k])
                if z < depth[row, column]:
                    depth[row, column] = z
                    light = np.float32(AMBIENT + (1.0 - AMBIENT) * cosine)
                    picture[0, row, column] = paint[k, 0] * light
                    picture[1, row, column] = 128 + (paint[k, 1] - 128) * light
                    picture[2, row, column] = 128 + (paint[k, 2] - 128) * light
    seen = np.zeros(len(solid) - n_limbs)
    near = np.empty(len(solid), dtype=np.int64)
    for k in range(n_limbs, len(solid)):
        top, bottom = _rows(pixels[k], reach[k], height)
        count = _neighbours(pixels, reach, k, near)
        for row in range(top, bottom):
            left, right = span(pixels[k], reach[k], row, width)
            for column in range(left, right):
                _fine(picture, depth, sight, solid, paint, n_limbs, near[:count], row, column, k, seen)
    return seen


@numba.njit(cache=True)
def _rows(pixels: Floats, reach: float, height: int) -> tuple[int, int]:
    low, high = min(pixels[0, 1], pixels[1, 1]) - reach, max(pixels[0, 1], pixels[1, 1]) + reach
    return max(0, int(np.floor(low))), min(height, int(np.ceil(high)) + 1)


@numba.njit(cache=True)
def _neighbours(pixels: Floats, reach: Floats, marker: int, near: Integers) -> int:
    """Put into ``near`` the other solids that may be seen where a marker is, and return how many."""
    count = 0
    for j in range(len(reach)):
        gap = reach[j] + reach[marker]
        apart = False
        for axis in range(2):
            at = pixels[marker, 0, axis]
            apart |= at < min(pixels[j, 0, axis], pixels[j, 1, axis]) - gap
            apart |= at > max(pixels[j, 0, axis], pixels[j, 1, axis]) + gap
        if not apart and j != marker:
            near[count] = j
            count += 1
    return count


@numba.njit(cache=True)
def _fine(
    picture: Singles,
    depth: Singles,
    sight: Singles,
    solid: Floats,
    paint: Singles,
    n_limbs: int,
    near: Integers,
    row: int,
    column: int,
    marker: int,
    seen: Floats,
) -> None:
    """Lay one marker over one pixel by sixteen rays, in the share of them that meet it first."""
    height, width = sight.shape[:2]
    right = sight[row, min(column + 1, width - 1)] - sight[row, max(column - 1, 0)]
    down = sight[min(row + 1, height - 1), column] - sight[max(row - 1, 0), column]
    x, y = sight[row, column]
    ball = solid[marker]
    away = _clearance(x, y, ball)
    pixel = ball[2] * max(abs(right[0]), abs(down[1])) / 2.0  # at the marker's depth, metres
    if away > pixel:
        return
    # Limbs within a pixel: where none reaches as near as the marker, only other markers can hide it.
    around = depth[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    limbs_from = around.min()
    side = 1 if away < -pixel and limbs_from > ball[2] else SAMPLES  # well inside, one ray tells as much as sixteen
    hits, brightness = 0, 0.0
    for i in range(side * side):
        u = ((i % side + 0.5) / side - 0.5) / 2.0
        v = ((i // side + 0.5) / side - 0.5) / 2.0
        z, cosine = strike(x + u * right[0] + v * down[0], y + u * right[1] + v * down[1], ball)
        first = z < np.inf
        for j in near:
            if first and (j >= n_limbs or limbs_from < z):
                first = strike(x + u * right[0] + v * down[0], y + u * right[1] + v * down[1], solid[j])[0] > z
        if first:
            hits += 1
            brightness += AMBIENT + (1.0 - AMBIENT) * cosine
    if hits == 0:
        return
    share = hits / (side * side)
    seen[marker - n_limbs] += share
    light = brightness / hits
    picture[0, row, column] += share * (paint[marker, 0] * light - picture[0, row, column])
    for c in range(1, 3):
        picture[c, row, column] += share * (128 + (paint[marker, c] - 128) * light - picture[c, row, column])


@numba.njit(cache=True)
def _clearance(x: float, y: float, ball: Floats) -> float:
    """Return how far from the surface of a ball the ray (x, y, 1) passes, negative if it enters, metres."""
    dd = x * x + y * y + 1.0
    along = (ball[0] * x + ball[1] * y + ball[2]) / dd
    px, py, pz = ball[0] - along * x, ball[1] - along * y, ball[2] - along
    return np.sqrt(px * px + py * py + pz * pz) - ball[6]


@numba.njit(cache=True)
def expose(picture: Singles, planes: Planes, noise: Singles, box: Integers, at: int) -> None:
    """Blur ``picture`` (3, H, W) by 1 2 1 inside ``box``, add ``noise`` from ``at`` on, round to bytes."""
    height, width = picture.shape[1:]
    left, right = max(box[0], 1), min(box[2], width - 1)
    line = np.empty(width, dtype=np.float32)
    for c in range(3):
        for row in range(height):
            grain = noise[(at + (c * height + row) * 7919) % (len(noise) - width) :]
            plane, out = picture[c, row], planes[c, row]
            if max(box[1], 1) <= row < min(box[3], height - 1):
                above, below = picture[c, row - 1], picture[c, row + 1]
                for column in range(left - 1, right + 1):
                    line[column] = above[column] + 2 * plane[column] + below[column]
                _round(plane, grain, out, 0, left)
                for column in range(left, right):
                    value = (line[column - 1] + 2 * line[column] + line[column + 1]) / np.float32(16.0)
                    out[column] = _byte(value + grain[column])
                _round(plane, grain, out, right, width)
            else:
                _round(plane, grain, out, 0, width)


@numba.njit(cache=True)
def _round(plane: Singles, grain: Singles, out: Planes, left: int, right: int) -> None:
    for column in range(left, right):
        out[column] = _byte(plane[column] + grain[column])


@numba.njit(cache=True)
def _byte(value: float) -> np.uint8:
    return np.uint8(np.int32(min(max(value + np.float32(0.5), np.float32(0.0)), np.float32(255.0))))
