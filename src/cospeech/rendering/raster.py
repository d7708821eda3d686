"""Compiled rasteriser: skin and project the mesh, fill its faces and composite them onto the image.

Four samples per pixel give smooth outlines, a depth buffer per sample resolves occlusion, and ambient occlusion
darkens surfaces just behind an edge. A single thread and float32 arithmetic give the same image in every run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Image, Singles
from cospeech.kernels.jit import njit


@njit
def shade_floor(image: Image, box: npt.NDArray[np.int64], ellipses: Singles) -> None:
    """Darken soft ellipses of ``image`` (H, W, 3) inside ``box`` (left, top, right, bottom).

    ``ellipses`` (n, 5): centre x and y, half width and half height in pixels, strength in [0, 1].
    """
    for k in range(len(ellipses)):
        x, y, width, height, strength = ellipses[k]
        for row in range(max(box[1], int(y - height)), min(box[3], int(y + height) + 2)):
            down = (row + np.float32(0.5) - y) / height
            for column in range(max(box[0], int(x - width)), min(box[2], int(x + width) + 2)):
                across = (column + np.float32(0.5) - x) / width
                inside = np.float32(1.0) - across * across - down * down
                if inside > 0:
                    keep = np.float32(1.0) - strength * inside * inside
                    for c in range(3):
                        image[row, column, c] = np.uint8(image[row, column, c] * keep + np.float32(0.5))


@njit
def draw_body(
    image: Image,
    box: npt.NDArray[np.int64],
    position: Singles,
    normal: Singles,
    joint: npt.NDArray[np.int32],
    weight: Singles,
    face: npt.NDArray[np.int32],
    material: npt.NDArray[np.uint8],
    rotation: Singles,
    shift: Singles,
    lens: Singles,
    colours: Singles,
) -> None:
    """Draw one body into ``box`` (left, top, right, bottom) of ``image`` (H, W, 3).

    Parameters
    ----------
    position, normal, joint, weight, face, material : the fields of ``body.Mesh``.
    rotation, shift : (J, 3, 3) and (J, 3) transform of each joint from the rest pose to the camera's axes (right, up,
        toward the camera), with the camera's target as origin.
    lens : (4,) distance of the camera from its target in metres, focal length in pixels, pixel coordinates of the
        target.
    colours : (256 * materials, 3) colour of each material at each brightness.
    """
    left, top, right, bottom = box
    points, brightness = _project(position, normal, joint, weight, rotation, shift, lens)
    x0, y0, x1, y1 = right, bottom, left, top
    for v in range(len(points)):
        x, y = int(np.floor(points[v, 0])), int(np.floor(points[v, 1]))
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x + 1), max(y1, y + 1)
    x0, y0, x1, y1 = max(x0, left), max(y0, top), min(x1, right), min(y1, bottom)
    if x0 >= x1 or y0 >= y1:
        return
    for v in range(len(points)):
        points[v, 0] = (points[v, 0] - np.float32(x0)) * np.float32(2.0)
        points[v, 1] = (points[v, 1] - np.float32(y0)) * np.float32(2.0)
    inverse_depth = np.zeros((2 * (y1 - y0), 2 * (x1 - x0)), dtype=np.float32)
    tone = np.zeros((2 * (y1 - y0), 2 * (x1 - x0)), dtype=np.uint16)
    _fill(points, brightness, face, material, inverse_depth, tone)
    _composite(image, y0, x0, inverse_depth, tone, colours, lens)


@njit
def _project(
    position: Singles,
    normal: Singles,
    joint: npt.NDArray[np.int32],
    weight: Singles,
    rotation: Singles,
    shift: Singles,
    lens: Singles,
) -> tuple[Singles, Singles]:
    """Return pixel x, y and inverse depth of each vertex (V, 3), and its brightness (V,) in [0, 255]."""
    points = np.empty((len(position), 3), dtype=np.float32)
    brightness = np.empty(len(position), dtype=np.float32)
    one = np.float32(1.0)
    no_shift = np.zeros(3, dtype=np.float32)
    for v in range(len(position)):
        first, second = joint[v]
        w = weight[v]
        x, y, z = _transform(rotation[first], shift[first], position[v])
        right, up, toward = _transform(rotation[first], no_shift, normal[v])
        if w < one:
            x2, y2, z2 = _transform(rotation[second], shift[second], position[v])
            right2, up2, toward2 = _transform(rotation[second], no_shift, normal[v])
            x, y, z = w * x + (one - w) * x2, w * y + (one - w) * y2, w * z + (one - w) * z2
            right, up = w * right + (one - w) * right2, w * up + (one - w) * up2
            toward = w * toward + (one - w) * toward2
        near = one / (lens[0] - z)
        points[v, 0] = lens[2] + lens[1] * x * near
        points[v, 1] = lens[3] - lens[1] * y * near
        points[v, 2] = near
        brightness[v] = _brightness(right, up, toward)
    return points, brightness


@njit
def _transform(rotation: Singles, shift: Singles, vector: Singles) -> tuple[np.float32, np.float32, np.float32]:
    """Return ``rotation @ vector + shift`` without allocating an array."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + shift[0],
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + shift[1],
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + shift[2],
    )


@njit
def _brightness(right: np.float32, up: np.float32, toward: np.float32) -> np.float32:
    """Return the brightness of a surface in [0, 250], given its normal in the camera's axes.

    The light comes from a large soft lamp at the upper left, the sky and the bright floor. A rim light brightens
    surfaces that face away from the camera.
    """
    none, all_ = np.float32(0.0), np.float32(1.0)
    lamp = np.float32(-0.46) * right + np.float32(0.62) * up + np.float32(0.64) * toward
    soft: np.float32 = max(none, (lamp + np.float32(0.35)) / np.float32(1.35))
    sky: np.float32 = max(none, up)
    floor: np.float32 = max(none, -up)
    away: np.float32 = all_ - max(none, toward)
    rim: np.float32 = away * away * away * max(none, right)
    bright = np.float32(40.0) + np.float32(158.0) * soft + np.float32(26.0) * (sky + rim) + np.float32(18.0) * floor
    return min(np.float32(250.0), bright)


@njit(error_model="numpy")
def _fill(
    points: Singles,
    brightness: Singles,
    face: npt.NDArray[np.int32],
    material: npt.NDArray[np.uint8],
    inverse_depth: Singles,
    tone: npt.NDArray[np.uint16],
) -> None:
    """Fill the faces that point toward the camera into the sample buffers, keeping the nearest.

    The four edges of a face define where each row of samples begins and ends, and the inverse depth and brightness at
    both ends; they are interpolated linearly in between.
    """
    height, width = inverse_depth.shape
    half, slack = np.float32(0.5), np.float32(0.001)  # slack: rounding must not open gaps between faces
    begin = np.empty((height, 3), dtype=np.float32)
    end = np.empty((height, 3), dtype=np.float32)
    for f in range(len(face)):
        a, b, c, d = face[f, 0], face[f, 1], face[f, 2], face[f, 3]
        area = (points[c, 0] - points[a, 0]) * (points[d, 1] - points[b, 1])
        area -= (points[d, 0] - points[b, 0]) * (points[c, 1] - points[a, 1])
        if area >= 0:  # faces away: y points down in pixels, so a counter-clockwise face has a negative area
            continue
        top = min(min(points[a, 1], points[b, 1]), min(points[c, 1], points[d, 1]))
        low = max(max(points[a, 1], points[b, 1]), max(points[c, 1], points[d, 1]))
        first, last = max(0, int(np.ceil(top - half))), min(height - 1, int(np.floor(low - half)))
        if first > last:
            continue
        for y in range(first, last + 1):
            begin[y, 0] = np.float32(width)
            end[y, 0] = np.float32(-1.0)
        for k in range(4):
            _extend_rows(points, brightness, face[f, k], face[f, (k + 1) & 3], begin, end)
        base = np.float32(256 * np.int64(material[f]))
        for y in range(first, last + 1):
            x = begin[y, 0]
            room = max(end[y, 0] - x, half)
            step_near = (end[y, 1] - begin[y, 1]) / room
            step_bright = (end[y, 2] - begin[y, 2]) / room
            start = max(0, int(np.ceil(x - half - slack)))
            stop = min(width - 1, int(np.floor(end[y, 0] - half + slack)))
            ahead = np.float32(start) + half - x
            near = begin[y, 1] + ahead * step_near
            bright = begin[y, 2] + ahead * step_bright
            for column in range(start, stop + 1):
                if near > inverse_depth[y, column]:
                    inverse_depth[y, column] = near
                    tone[y, column] = np.uint16(base + bright)
                near += step_near
                bright += step_bright


@njit(error_model="numpy")
def _extend_rows(points: Singles, brightness: Singles, a: int, b: int, begin: Singles, end: Singles) -> None:
    """Extend ``begin`` and ``end`` (x, inverse depth and brightness of each row) to include the edge from a to b."""
    half = np.float32(0.5)
    if points[a, 1] > points[b, 1]:
        a, b = b, a
    first = max(0, int(np.ceil(points[a, 1] - half)))
    last = min(len(begin) - 1, int(np.floor(points[b, 1] - half)))
    if first > last:
        return
    per_row = np.float32(1.0) / max(points[b, 1] - points[a, 1], np.float32(1e-6))
    step_x = (points[b, 0] - points[a, 0]) * per_row
    step_near = (points[b, 2] - points[a, 2]) * per_row
    step_bright = (brightness[b] - brightness[a]) * per_row
    down = np.float32(first) + half - points[a, 1]
    x = points[a, 0] + down * step_x
    near = points[a, 2] + down * step_near
    bright = brightness[a] + down * step_bright
    for y in range(first, last + 1):
        if x < begin[y, 0]:
            begin[y, 0], begin[y, 1], begin[y, 2] = x, near, bright
        if x > end[y, 0]:
            end[y, 0], end[y, 1], end[y, 2] = x, near, bright
        x += step_x
        near += step_near
        bright += step_bright


@njit(error_model="numpy")
def _composite(
    image: Image,
    top: int,
    left: int,
    inverse_depth: Singles,
    tone: npt.NDArray[np.uint16],
    colours: Singles,
    lens: Singles,
) -> None:
    """Composite the samples onto the image, four per pixel, darkened by ambient occlusion."""
    height, width = inverse_depth.shape
    blocked, front = _occlusion(inverse_depth, max(1, int(lens[1] / lens[0] * np.float32(0.011) + np.float32(0.5))))
    quarter, half, none = np.float32(0.25), np.float32(0.5), np.float32(0.0)
    for y in range(0, height, 2):
        for x in range(0, width, 2):
            a, b = inverse_depth[y, x], inverse_depth[y, x + 1]
            c, d = inverse_depth[y + 1, x], inverse_depth[y + 1, x + 1]
            near = max(max(a, b), max(c, d))
            if near == none:
                continue
            row, column = top + (y >> 1), left + (x >> 1)
            keep = quarter - np.float32(0.1) * _interpolate_occlusion(blocked, front, y, x, near)
            # The background shows through samples that the body does not cover.
            tone_a, tone_b = tone[y, x], tone[y, x + 1]
            tone_c, tone_d = tone[y + 1, x], tone[y + 1, x + 1]
            on_a, on_b = (keep if a > none else none), (keep if b > none else none)
            on_c, on_d = (keep if c > none else none), (keep if d > none else none)
            paper = quarter * ((a == none) + (b == none) + (c == none) + (d == none))
            for k in range(3):
                mixed = on_a * colours[tone_a, k] + on_b * colours[tone_b, k] + on_c * colours[tone_c, k]
                mixed += on_d * colours[tone_d, k] + np.float32(paper) * image[row, column, k]
                image[row, column, k] = np.uint8(mixed + half)


@njit(error_model="numpy")
def _occlusion(inverse_depth: Singles, step: int) -> tuple[Singles, Singles]:
    """Return the share of light blocked by surfaces just in front, and the inverse depth to which it applies.

    Both are computed per block of 4 x 4 samples and padded with a row and a column of zeros. Each block is compared
    with 16 positions around it, ``step`` blocks apart. The effect fades out at distances of 15 to 30 cm.
    """
    height, width = inverse_depth.shape[0] // 4, inverse_depth.shape[1] // 4
    none, all_ = np.float32(0.0), np.float32(1.0)
    front = np.zeros((height + 1, width + 1), dtype=np.float32)
    for y in range(height):
        for x in range(width):
            front[y, x] = inverse_depth[4 * y + 2, 4 * x + 2]
    blocked = np.zeros((height + 1, width + 1), dtype=np.float32)
    for y in range(height):
        for x in range(width):
            near = front[y, x]
            if near == none:
                continue
            metres = all_ / (near * near)  # converts a difference in inverse depth to metres
            total = none
            for j in range(-3, 4, 2):
                for i in range(-3, 4, 2):
                    row, column = y + j * step, x + i * step
                    if 0 <= row < height and 0 <= column < width:
                        ahead = (front[row, column] - near) * metres
                        if ahead > np.float32(0.01):
                            close = min(all_, (ahead - np.float32(0.01)) * np.float32(25.0))
                            total += close * max(none, min(all_, np.float32(2.0) - ahead * np.float32(6.6666667)))
            blocked[y, x] = total * np.float32(0.0625)
    return blocked, front


@njit(error_model="numpy")
def _interpolate_occlusion(blocked: Singles, front: Singles, y: int, x: int, near: np.float32) -> np.float32:
    """Interpolate ``blocked`` at a pixel (its upper left sample) between the adjacent blocks of similar depth."""
    row, column = max(0, (y - 1) >> 2), max(0, (x - 1) >> 2)
    a, b = blocked[row, column], blocked[row, column + 1]
    c, d = blocked[row + 1, column], blocked[row + 1, column + 1]
    all_, none = np.float32(1.0), np.float32(0.0)
    if a + b + c + d == none:
        return none
    down = np.float32(y - 1 - 4 * row) * np.float32(0.25)
    right = np.float32(x - 1 - 4 * column) * np.float32(0.25)
    apart = np.float32(20.0) / (near * near)  # a block more than 5 cm in front or behind has no weight
    share_a = (all_ - down) * (all_ - right) * max(none, all_ - apart * abs(front[row, column] - near))
    share_b = (all_ - down) * right * max(none, all_ - apart * abs(front[row, column + 1] - near))
    share_c = down * (all_ - right) * max(none, all_ - apart * abs(front[row + 1, column] - near))
    share_d = down * right * max(none, all_ - apart * abs(front[row + 1, column + 1] - near))
    total = share_a + share_b + share_c + share_d
    return (share_a * a + share_b * b + share_c * c + share_d * d) / max(total, np.float32(1e-3))
