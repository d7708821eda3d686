"""The compiled part of filming a head: a rasteriser of textured triangles with a depth buffer.

Geometry is in the frame of the camera, metres. The places of a triangle in the texture and its light are interpolated
linearly in the image, and the texture bilinearly. A single thread renders, in single precision and without
``fastmath`` (see ``paint``), so that every run gives the same image.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Integers, Singles
from cospeech.studio.paint import Single, compiled

ZERO, ONE, NEUTRAL = np.float32(0.0), np.float32(1.0), np.float32(128.0)


@compiled
def pose(
    places: Singles, normals: Singles, follows: Singles, jaw: Singles, opening: Single, turn: Singles, shift: Singles,
    sun: Singles, ambient: Single, out: Singles,
) -> None:  # fmt: skip
    """Fill ``out`` (V, 4) with the vertices of a mesh in one pose of the head, and their light.

    Parameters
    ----------
    places, normals, follows, jaw : the mesh (see ``mannequin.Mesh``).
    opening : how far the mouth is open, 0 to 1.
    turn, shift : (3, 3) rotation and (3,) displacement of the head, in its own frame.
    sun : (3,) direction to the light, of unit length.
    ambient : share of light that comes from everywhere.
    """
    for v in range(len(places)):
        x = places[v, 0] + opening * jaw[v, 0]
        y = places[v, 1] + opening * jaw[v, 1]
        z = places[v, 2] + opening * jaw[v, 2]
        share = follows[v]
        lit = ZERO
        for k in range(3):
            moved = turn[k, 0] * x + turn[k, 1] * y + turn[k, 2] * z + shift[k]
            still = places[v, k]
            out[v, k] = share * moved + (ONE - share) * still
            normal = turn[k, 0] * normals[v, 0] + turn[k, 1] * normals[v, 1] + turn[k, 2] * normals[v, 2]
            lit += (share * normal + (ONE - share) * normals[v, k]) * sun[k]
        # Light wraps around the head, as that of a large lamp does.
        wrapped = max(lit * np.float32(0.75) + np.float32(0.25), ZERO)
        out[v, 3] = ambient + (ONE - ambient) * wrapped


@compiled
def draw(
    seen: Singles, texels: Singles, triangles: Integers, texture: Singles, focal: Singles, centre: Singles,
    rotation: Singles, origin: Singles, picture: Singles, depth: Singles,
) -> None:  # fmt: skip
    """Draw a mesh into ``picture`` (3, H, W) and ``depth`` (H, W), which holds 1 / z and starts at 0.

    Parameters
    ----------
    seen : (V, 4) vertices in the world and their light, from ``pose``.
    texels : (V, 2) columns and rows in ``texture``.
    triangles : (F, 3) vertices.
    texture : (Ht, Wt, 3) Y, Cb, Cr in full light.
    focal, centre : (2,) fx, fy and cx, cy of the camera.
    rotation, origin : (3, 3) and (3,) from the world to the camera.
    """
    height, width = depth.shape
    flat = np.empty((len(seen), 3), dtype=np.float32)
    for v in range(len(seen)):
        x, y, z = seen[v, 0], seen[v, 1], seen[v, 2]
        ahead = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + origin[2]
        across = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + origin[0]
        below = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + origin[1]
        flat[v, 0] = focal[0] * across / ahead + centre[0]
        flat[v, 1] = focal[1] * below / ahead + centre[1]
        flat[v, 2] = ONE / ahead
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, bx, by, cx, cy = flat[a, 0], flat[a, 1], flat[b, 0], flat[b, 1], flat[c, 0], flat[c, 1]
        area = (cx - ax) * (by - ay) - (bx - ax) * (cy - ay)  # y points down: positive if seen from outside
        if area <= np.float32(1e-6) or min(flat[a, 2], flat[b, 2], flat[c, 2]) <= ZERO:
            continue
        left = max(0, int(np.ceil(min(ax, bx, cx))))
        right = min(width - 1, int(np.floor(max(ax, bx, cx))))
        top = max(0, int(np.ceil(min(ay, by, cy))))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy))))
        # Weights of b and c, which are 1 at these vertices and 0 at the others, as linear functions of the pixel.
        b_x, b_y, c_x, c_y = (ay - cy) / area, (cx - ax) / area, (by - ay) / area, (ax - bx) / area
        near_b, near_c = flat[b, 2] - flat[a, 2], flat[c, 2] - flat[a, 2]
        for row in range(top, bottom + 1):
            down = np.float32(row) - ay
            for column in range(left, right + 1):
                across = np.float32(column) - ax
                wb, wc = b_x * across + b_y * down, c_x * across + c_y * down
                if wb < ZERO or wc < ZERO or wb + wc > ONE:
                    continue
                near = flat[a, 2] + wb * near_b + wc * near_c
                if near <= depth[row, column]:
                    continue
                depth[row, column] = near
                wa = ONE - wb - wc
                u = wa * texels[a, 0] + wb * texels[b, 0] + wc * texels[c, 0]
                v = wa * texels[a, 1] + wb * texels[b, 1] + wc * texels[c, 1]
                light = wa * seen[a, 3] + wb * seen[b, 3] + wc * seen[c, 3]
                _paint(texture, u, v, light, picture, row, column)


@compiled
def _paint(texture: Singles, u: Single, v: Single, light: Single, picture: Singles, row: int, column: int) -> None:
    """Set one pixel to the texture at column ``u`` and row ``v``, in the given light."""
    i, j = min(int(v), len(texture) - 2), min(int(u), texture.shape[1] - 2)
    down, across = v - np.float32(i), u - np.float32(j)
    for k in range(3):
        above = texture[i, j, k] + across * (texture[i, j + 1, k] - texture[i, j, k])
        below = texture[i + 1, j, k] + across * (texture[i + 1, j + 1, k] - texture[i + 1, j, k])
        dark = ZERO if k == 0 else NEUTRAL
        picture[k, row, column] = dark + (above + down * (below - above) - dark) * light
