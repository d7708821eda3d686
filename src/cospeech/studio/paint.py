"""The compiled part of filming: ray casting of capsules, with sixteen rays per pixel around markers.

All geometry is in camera coordinates, metres. Rows of pixels use branch-free single-precision arithmetic, which the
compiler vectorises. A single thread renders, so that every run gives the same image.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats, Integers, Singles
from cospeech.kernels.jit import njit

Single = np.float32
Solid = tuple[Single, ...]
Planes = npt.NDArray[np.uint8]
Shorts = npt.NDArray[np.int16]
Grain = npt.NDArray[np.int8]

SAMPLES = 4
"""Number of rays per pixel and axis around markers."""
AMBIENT = np.float32(0.72)
"""Fraction of ambient light: the studio is lit diffusely (Özkul 2012, 2.4)."""
BITS = 4
STEPS = 1 << BITS
"""Intensity steps per unit of a byte before noise is added; equal to the sum of the weights of the blur."""

ZERO, ONE, NEUTRAL, FAR = np.float32(0.0), np.float32(1.0), np.float32(128.0), np.float32(np.inf)

compiled = njit(error_model="numpy")
"""Division by zero yields infinity or NaN, which never compares as a hit.

Arithmetic is as written, without ``fastmath``: with it, the last bit of a depth depends on the bytecode, which
differs between versions of Python, and on whether a pixel is in a vector or in the remainder of its row.
"""


def solids(ends: Floats, radii: Floats) -> Singles:
    """Return capsules with ``ends`` (..., n, 2, 3) and ``radii`` (n,) as rows (..., n, 15) for ``intersect``.

    Each row holds the first end a, the unit vector u to the second, their distance, the radius, a.u, the component of
    a perpendicular to u, and u x a. A ball is a capsule of length 0.
    """
    a, b = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
    length = np.linalg.norm(b, axis=-1, keepdims=True)
    u = b / np.where(length > 0.0, length, 1.0)
    along = np.sum(a * u, axis=-1, keepdims=True)
    radius = np.broadcast_to(radii[:, None], length.shape)
    return np.concatenate([a, u, length, radius, along, a - along * u, np.cross(u, a)], axis=-1).astype(np.float32)


@compiled
def intersect(x: Single, y: Single, solid: Solid) -> tuple[Single, Single]:
    """Return depth z and cosine of incidence where the ray d = (x, y, 1) enters a solid; infinite depth for a miss.

    ``solid`` is a row of ``solids`` as from ``unpack``. The distance of the ray from the axis is (u x a).d / |d x u|.
    It enters through the cylinder if it hits it between the ends, and otherwise through the ball at the closer end.
    """
    ax, ay, az, ux, uy, uz, length, radius, along, qx, qy, qz, mx, my, mz = solid
    dd = x * x + y * y + ONE
    nx, ny, nz = y * uz - uy, ux - x * uz, x * uy - y * ux
    p = nx * nx + ny * ny + nz * nz
    miss = mx * x + my * y + mz
    root = p * radius * radius - miss * miss
    t = (qx * x + qy * y + qz - np.sqrt(max(root, ZERO))) / p
    share = t * (ux * x + uy * y + uz) - along
    between = (share >= ZERO) & (share <= length)
    end = length if share > length else ZERO
    cx, cy, cz = ax + end * ux, ay + end * uy, az + end * uz
    ox, oy, oz = cy - y * cz, x * cz - cx, y * cx - x * cy
    ball = dd * radius * radius - (ox * ox + oy * oy + oz * oz)
    round_t = (cx * x + cy * y + cz - np.sqrt(max(ball, ZERO))) / dd
    hit = (root >= ZERO) & (between | (ball >= ZERO))
    z = t if between else round_t
    cosine = np.sqrt(max(root if between else ball, ZERO) / dd) / radius
    return (z if hit else FAR), cosine


@compiled
def unpack(solid: Singles, k: int) -> Solid:
    """Return row ``k`` of ``solids`` as a tuple for ``intersect``, which keeps the values in registers."""
    return (
        solid[k, 0], solid[k, 1], solid[k, 2], solid[k, 3], solid[k, 4], solid[k, 5], solid[k, 6], solid[k, 7],
        solid[k, 8], solid[k, 9], solid[k, 10], solid[k, 11], solid[k, 12], solid[k, 13], solid[k, 14],
    )  # fmt: skip


@compiled
def span(pixels: Floats, reach: float, row: int, width: int) -> tuple[int, int]:
    """Return the columns, the last exclusive, of one row that a solid may cover.

    Its outline lies within ``reach`` of the segment between its two ends at ``pixels`` (2, 2).
    """
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


@compiled
def draw(
    picture: Singles, depth: Singles, room: Singles, slopes: Singles, solid: Singles, pixels: Floats, reach: Floats,
    paint: Singles, n_limbs: int, box: Integers,
) -> Floats:  # fmt: skip
    """Draw limbs, then markers, into ``box`` of ``picture``; return the number of visible pixels of each marker (m,).

    Parameters
    ----------
    picture, depth : (3, H, W) and (H, W) buffers, redrawn within ``box``.
    room : (3, H, W) background.
    slopes : (2, H, W) slopes of the ray through each pixel.
    solid : (n, 15) rows of ``solids``, limbs first.
    pixels, reach : (n, 2, 2) projected ends; (n,) largest distance of the outline from the line between them, pixels.
    paint : (n, 3) Y, Cb, Cr in full light.
    n_limbs : number of limbs.
    box : left, top, right, bottom (the last two exclusive) of the region that may be covered.
    """
    height, width = depth.shape
    for row in range(box[1], box[3]):
        depth[row, box[0] : box[2]] = FAR
        for c in range(3):
            _copy(room[c, row, box[0] : box[2]], picture[c, row, box[0] : box[2]])
    near, light = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    rays = np.empty((4, SAMPLES * SAMPLES), dtype=np.float32)
    for k in range(n_limbs):
        limb = unpack(solid, k)
        top, bottom = _rows(pixels[k], reach[k], height)
        for row in range(top, bottom):
            left, right = span(pixels[k], reach[k], row, width)
            _intersect_row(slopes[0, row, left:right], slopes[1, row, left:right], limb, near, light)
            for c in range(3):
                full, none = paint[k, c], (ZERO if c == 0 else NEUTRAL)
                _paint_row(picture[c, row, left:right], depth[row, left:right], near, light, full - none, none)
            _update_depth(depth[row, left:right], near)
    seen = np.zeros(len(solid) - n_limbs)
    others = np.empty(len(solid), dtype=np.int64)
    for k in range(n_limbs, len(solid)):
        top, bottom = _rows(pixels[k], reach[k], height)
        count = _neighbours(pixels, reach, k, others)
        ball = unpack(solid, k)
        for row in range(top, bottom):
            left, right = span(pixels[k], reach[k], row, width)
            if right - left < 2:
                continue
            x = slopes[0, row, left:right]
            _distance_row(x, slopes[1, row, left:right], ball, near)
            pixel = ball[2] * (x[-1] - x[0]) / np.float32(len(x) - 1)  # at the marker's depth, metres
            for column in range(left, right):
                away = near[column - left]
                if away < pixel:
                    inside = away < -pixel
                    seen[k - n_limbs] += _supersample(
                        picture, depth, slopes, solid, paint[k], n_limbs, others[:count], row, column, k, inside, rays
                    )
    return seen


@compiled
def _copy(plane: Singles, out: Singles) -> None:
    for column in range(len(out)):
        out[column] = plane[column]


@compiled
def _intersect_row(x: Singles, y: Singles, limb: Solid, near: Singles, light: Singles) -> None:
    for column in range(len(x)):
        z, cosine = intersect(x[column], y[column], limb)
        near[column], light[column] = z, AMBIENT + (ONE - AMBIENT) * cosine


@compiled
def _distance_row(x: Singles, y: Singles, ball: Solid, away: Singles) -> None:
    """Fill ``away`` with the distance of each ray from the surface of a ball, negative if it enters, metres."""
    for column in range(len(x)):
        u, v = x[column], y[column]
        ox, oy, oz = ball[1] - v * ball[2], u * ball[2] - ball[0], v * ball[0] - u * ball[1]
        away[column] = np.sqrt((ox * ox + oy * oy + oz * oz) / (u * u + v * v + ONE)) - ball[7]


@compiled
def _paint_row(plane: Singles, depth: Singles, near: Singles, light: Singles, full: Single, none: Single) -> None:
    for column in range(len(plane)):
        lit = none + full * light[column]
        plane[column] = lit if near[column] < depth[column] else plane[column]


@compiled
def _update_depth(depth: Singles, near: Singles) -> None:
    for column in range(len(depth)):
        depth[column] = min(depth[column], near[column])


@compiled
def _rows(pixels: Floats, reach: float, height: int) -> tuple[int, int]:
    low, high = min(pixels[0, 1], pixels[1, 1]) - reach, max(pixels[0, 1], pixels[1, 1]) + reach
    return max(0, int(np.floor(low))), min(height, int(np.ceil(high)) + 1)


@compiled
def _neighbours(pixels: Floats, reach: Floats, marker: int, others: Integers) -> int:
    """Fill ``others`` with the other solids that may overlap a marker in the image, and return how many there are."""
    count = 0
    for j in range(len(reach)):
        gap = reach[j] + reach[marker]
        apart = False
        for axis in range(2):
            at = pixels[marker, 0, axis]
            apart |= at < min(pixels[j, 0, axis], pixels[j, 1, axis]) - gap
            apart |= at > max(pixels[j, 0, axis], pixels[j, 1, axis]) + gap
        if not apart and j != marker:
            others[count] = j
            count += 1
    return count


@compiled
def _supersample(
    picture: Singles, depth: Singles, slopes: Singles, solid: Singles, paint: Singles, n_limbs: int,
    others: Integers, row: int, column: int, marker: int, inside: bool, rays: Singles,
) -> float:  # fmt: skip
    """Draw one marker in one pixel with sixteen rays; return the fraction of rays that hit it first.

    ``rays`` (4, 16) is a work buffer: slopes x and y, depth and shading of the marker.
    """
    height, width = depth.shape
    ball = unpack(solid, marker)
    before, after = max(column - 1, 0), min(column + 1, width - 1)
    above, below = max(row - 1, 0), min(row + 1, height - 1)
    # Depth of limbs within a pixel: a marker behind all of them is hidden, and one in front of all of them can only
    # be hidden by other markers.
    nearest, farthest = FAR, ZERO
    for i in range(above, below + 1):
        for j in range(before, after + 1):
            nearest, farthest = min(nearest, depth[i, j]), max(farthest, depth[i, j])
    if farthest < ball[2] - ball[7]:
        return 0.0
    x, y = slopes[0, row, column], slopes[1, row, column]
    if inside and nearest > ball[2]:  # one ray is enough, and only another marker can hide this one
        z, light = intersect(x, y, ball)
        for j in others:
            if j >= n_limbs and intersect(x, y, unpack(solid, j))[0] <= z:
                return 0.0
        share, brightness = ONE, AMBIENT + (ONE - AMBIENT) * light
    else:
        dx, dy = slopes[0, row, after] - slopes[0, row, before], slopes[1, row, after] - slopes[1, row, before]
        ex, ey = (
            slopes[0, below, column] - slopes[0, above, column],
            slopes[1, below, column] - slopes[1, above, column],
        )
        for i in range(SAMPLES * SAMPLES):
            u = np.float32(((i % SAMPLES + 0.5) / SAMPLES - 0.5) / 2.0)
            v = np.float32(((i // SAMPLES + 0.5) / SAMPLES - 0.5) / 2.0)
            rays[0, i], rays[1, i] = x + u * dx + v * ex, y + u * dy + v * ey
            z, light = intersect(rays[0, i], rays[1, i], ball)
            rays[2, i], rays[3, i] = z, AMBIENT + (ONE - AMBIENT) * light
        for j in others:
            if j >= n_limbs or nearest < ball[2]:
                other = unpack(solid, j)
                for i in range(SAMPLES * SAMPLES):
                    z, _ = intersect(rays[0, i], rays[1, i], other)
                    rays[2, i] = FAR if z <= rays[2, i] else rays[2, i]
        share, brightness = ZERO, ZERO
        for i in range(SAMPLES * SAMPLES):
            hit = rays[2, i] < FAR
            share += ONE if hit else ZERO
            brightness += rays[3, i] if hit else ZERO
        if share == ZERO:
            return 0.0
        share, brightness = share / np.float32(SAMPLES * SAMPLES), brightness / share
    for c in range(3):
        none = ZERO if c == 0 else NEUTRAL
        picture[c, row, column] += share * (none + (paint[c] - none) * brightness - picture[c, row, column])
    return float(share)


@compiled
def add_grain(room: Shorts, grain: Grain, at: int, planes: Planes) -> None:
    """Fill ``planes`` (3, H, W) with ``room`` (3, H, W), in steps of 1 / ``STEPS``, plus ``grain`` from ``at`` on.

    ``room`` must leave enough headroom for the strongest grain, as the sum is not clipped.
    """
    height, width = room.shape[1:]
    for c in range(3):
        for row in range(height):
            _add(room[c, row], _grain(grain, at, c * height + row, width), planes[c, row])


@compiled
def _add(shown: Shorts, grain: Grain, out: Planes) -> None:
    for column in range(len(out)):  # 32-bit integers and a shift instead of a division, so that the loop vectorises
        light = np.int32(shown[column]) + np.int32(grain[column]) + np.int32(STEPS // 2)
        out[column] = np.uint8(light >> np.int32(BITS))


@compiled
def _grain(grain: Grain, at: int, row: int, width: int) -> Grain:
    """Return the noise of a row, taken from a different part of the table than that of its neighbours."""
    first = (at + row * 7919) % (len(grain) - width)
    return grain[first : first + width]


@compiled
def expose(picture: Singles, grain: Grain, at: int, box: Integers, planes: Planes) -> None:
    """Fill ``box`` of ``planes`` with ``picture`` (3, H, W), blurred by 1-2-1, plus ``grain`` from ``at`` on."""
    height, width = picture.shape[1:]
    left, top, right, bottom = box
    n = right - left
    line = np.empty(n + 2, dtype=np.float32)
    for c in range(3):
        for row in range(top, bottom):
            above, below = picture[c, max(row - 1, top)], picture[c, min(row + 1, bottom - 1)]
            _weigh(above[left:right], picture[c, row, left:right], below[left:right], line[1 : n + 1])
            line[0], line[n + 1] = line[1], line[n]
            speckle = _grain(grain, at, c * height + row, width)[left:right]
            _round(line[:n], line[1 : n + 1], line[2:], speckle, planes[c, row, left:right])


@compiled
def _weigh(above: Singles, middle: Singles, below: Singles, line: Singles) -> None:
    for column in range(len(above)):
        line[column] = above[column] + middle[column] + middle[column] + below[column]


@compiled
def _round(before: Singles, middle: Singles, after: Singles, grain: Grain, out: Planes) -> None:
    most = np.float32(255.0)
    for column in range(len(out)):
        value = before[column] + middle[column] + middle[column] + after[column] + np.float32(grain[column])
        value = value / np.float32(STEPS) + np.float32(0.5)
        out[column] = np.uint8(np.int32(min(max(value, ZERO), most)))
