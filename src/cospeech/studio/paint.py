"""The compiled part of filming: rays against capsules, the nearest wins; sixteen rays a pixel around markers.

Everything stands in the axes of the camera, metres. Plain arithmetic on one thread: the same picture on every run.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

Singles = npt.NDArray[np.float32]
Planes = npt.NDArray[np.uint8]
Integers = npt.NDArray[np.int64]

SAMPLES = 4
"""Rays along either side of a pixel around markers."""
AMBIENT = 0.72
"""Share of light from all sides: the studio is lit diffusely (2.4 of the thesis)."""


@numba.njit(cache=True)
def strike(x: float, y: float, a: Singles, b: Singles, radius: float) -> tuple[float, float]:
    """Return depth z and the cosine towards the camera where ray (x, y, 1) meets the capsule a-b; infinite if not."""
    square = x * x + y * y + 1.0
    bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length2 = bx * bx + by * by + bz * bz
    baba_ray = bx * x + by * y + bz
    near, nx, ny, nz = np.inf, 0.0, 0.0, 0.0
    if length2 > 1e-12:
        # |(d t - a) - ((d t - a).b / b.b) b| = r
        ab = a[0] * bx + a[1] * by + a[2] * bz
        ad = a[0] * x + a[1] * y + a[2]
        aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
        p = square - baba_ray * baba_ray / length2
        q = ad - ab * baba_ray / length2
        root = q * q - p * (aa - ab * ab / length2 - radius * radius)
        if root >= 0.0 and p > 1e-12:
            t = (q - np.sqrt(root)) / p
            share = (t * baba_ray - ab) / length2
            if t > 0.0 and 0.0 <= share <= 1.0:
                near = t
                nx = x * t - a[0] - share * bx
                ny = y * t - a[1] - share * by
                nz = t - a[2] - share * bz
    for end in range(2):
        c = a if end == 0 else b
        q = c[0] * x + c[1] * y + c[2]
        root = q * q - square * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2] - radius * radius)
        if root >= 0.0:
            t = (q - np.sqrt(root)) / square
            if 0.0 < t < near:
                near, nx, ny, nz = t, x * t - c[0], y * t - c[1], t - c[2]
    if near == np.inf:
        return near, 0.0
    return near, -(nx * x + ny * y + nz) / (radius * np.sqrt(square))


@numba.njit(cache=True)
def draw(
    picture: Singles,
    depth: Singles,
    sight: Singles,
    ends: Singles,
    radii: Singles,
    boxes: Integers,
    paint: Singles,
    n_limbs: int,
) -> npt.NDArray[np.float64]:
    """Draw limbs, then markers, onto ``picture`` (3, H, W); return the pixels of each marker that are seen (m,).

    Parameters
    ----------
    depth : (H, W) working space.
    sight : (H, W, 2) slopes of the ray of each pixel.
    ends, radii : (n, 2, 3), (n,) capsules, limbs first; a marker's two ends are one.
    boxes : (n, 4) left, top, right, bottom (excluded) pixels that each may cover.
    paint : (n, 3) Y, Cb, Cr in full light.
    """
    n = len(radii)
    light = np.float32(1.0)
    for k in range(n_limbs):
        for row in range(boxes[k, 1], boxes[k, 3]):
            depth[row, boxes[k, 0] : boxes[k, 2]] = np.inf
    for k in range(n_limbs):
        for row in range(boxes[k, 1], boxes[k, 3]):
            for column in range(boxes[k, 0], boxes[k, 2]):
                z, cosine = strike(sight[row, column, 0], sight[row, column, 1], ends[k, 0], ends[k, 1], radii[k])
                if z < depth[row, column]:
                    depth[row, column] = z
                    light = np.float32(AMBIENT + (1.0 - AMBIENT) * cosine)
                    picture[0, row, column] = paint[k, 0] * light
                    picture[1, row, column] = 128 + (paint[k, 1] - 128) * light
                    picture[2, row, column] = 128 + (paint[k, 2] - 128) * light
    seen = np.zeros(n - n_limbs)
    near = np.empty(n, dtype=np.int64)
    for k in range(n_limbs, n):
        left, top, right, bottom = boxes[k]
        count = 0
        for j in range(n):
            apart = boxes[j, 0] >= right or boxes[j, 2] <= left or boxes[j, 1] >= bottom or boxes[j, 3] <= top
            if not apart:
                near[count] = j
                count += 1
        for row in range(top, bottom):
            for column in range(left, right):
                _fine(picture, sight, ends, radii, paint, n_limbs, near[:count], row, column, k, seen)
    return seen


@numba.njit(cache=True)
def _fine(
    picture: Singles,
    sight: Singles,
    ends: Singles,
    radii: Singles,
    paint: Singles,
    n_limbs: int,
    near: Integers,
    row: int,
    column: int,
    marker: int,
    seen: npt.NDArray[np.float64],
) -> None:
    """Lay one marker over one pixel by sixteen rays, in the share of them that meet it first."""
    height, width = sight.shape[:2]
    right = sight[row, min(column + 1, width - 1)] - sight[row, max(column - 1, 0)]
    down = sight[min(row + 1, height - 1), column] - sight[max(row - 1, 0), column]
    hits, brightness = 0, 0.0
    for i in range(SAMPLES * SAMPLES):
        u = ((i % SAMPLES + 0.5) / SAMPLES - 0.5) / 2.0
        v = ((i // SAMPLES + 0.5) / SAMPLES - 0.5) / 2.0
        x = sight[row, column, 0] + u * right[0] + v * down[0]
        y = sight[row, column, 1] + u * right[1] + v * down[1]
        z, cosine = strike(x, y, ends[marker, 0], ends[marker, 1], radii[marker])
        first = z < np.inf
        for j in near:
            if first and j != marker and strike(x, y, ends[j, 0], ends[j, 1], radii[j])[0] < z:
                first = False
        if first:
            hits += 1
            brightness += AMBIENT + (1.0 - AMBIENT) * cosine
    if hits == 0:
        return
    share = hits / (SAMPLES * SAMPLES)
    seen[marker - n_limbs] += share
    light = brightness / hits
    picture[0, row, column] += share * (paint[marker, 0] * light - picture[0, row, column])
    for c in range(1, 3):
        picture[c, row, column] += share * (128 + (paint[marker, c] - 128) * light - picture[c, row, column])


@numba.njit(cache=True)
def expose(picture: Singles, planes: Planes, noise: Singles, box: Integers, at: int) -> None:
    """Blur ``picture`` (3, H, W) by 1 2 1 inside ``box``, add ``noise`` from ``at`` on, round to bytes."""
    height, width = picture.shape[1:]
    for c in range(3):
        for row in range(height):
            start = (at + (c * height + row) * 7919) % (len(noise) - width)
            inner = max(box[1], 1) <= row < min(box[3], height - 1)
            for column in range(width):
                if inner and max(box[0], 1) <= column < min(box[2], width - 1):
                    value = np.float32(0.0)
                    for i in range(-1, 2):
                        value += (2 - abs(i)) * (
                            picture[c, row + i, column - 1]
                            + 2 * picture[c, row + i, column]
                            + picture[c, row + i, column + 1]
                        )
                    value /= np.float32(16.0)
                else:
                    value = picture[c, row, column]
                value += noise[start + column] + np.float32(0.5)
                planes[c, row, column] = np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)))
