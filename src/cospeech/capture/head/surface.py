"""The visible surface of the face in the reference frame, and the picture of it from another pose.

A grid of pixels with known depth is a mesh of triangles in space. Moved by a pose and projected, it says where every
pixel of the reference image goes: the reference, warped, against which optical flow has little left to find.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import Pose
from cospeech.data.arrays import Flags, Floats, Plane, Singles
from cospeech.kernels.jit import njit

SMOOTHED_CELLS, EXTENDED_CELLS = 1.2, 3.0
"""Standard deviations of the Gaussian windows in which planes are fitted to the depths, in cells of the grid."""

SUPPORT = 0.25
"""Share of the weight of such a window that must lie on known depths."""

DEVIATION = 3.0
"""A depth that differs by more than this many median deviations from the median of its neighbours is left out."""

OCCLUDED_M = 0.006
"""Depth by which a point must lie behind the surface to count as hidden."""

OBLIQUE = 0.3
"""Cosine between the line of sight and the normal of the surface below which a point is seen too obliquely."""


@dataclass(frozen=True)
class Surface:
    """A grid (rows, columns) of pixels of the reference image and the points of the face seen there.

    Attributes
    ----------
    columns, rows : the x (columns,) and y (rows,) of the grid, in pixels, evenly spaced.
    points_m : (rows, columns, 3); NaN where the depth is not known.
    """

    columns: Floats
    rows: Floats
    points_m: Floats

    def at(self, pixels: Floats) -> Floats:
        """Return the points (n, 3) seen at pixels (n, 2), interpolated; NaN beyond the known surface."""
        found: Floats = _interpolate(self.points_m, *self._cells(pixels))
        return found

    def normals(self, pixels: Floats) -> Floats:
        """Return the unit normals (n, 3), towards the camera, of the surface seen at pixels (n, 2)."""
        right, below = 0.5 * (self.columns[1] - self.columns[0]) * np.eye(2)
        across = self.at(pixels + right) - self.at(pixels - right)
        down = self.at(pixels + below) - self.at(pixels - below)
        normal = np.cross(down, across)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def _cells(self, pixels: Floats) -> tuple[Floats, Floats]:
        step = self.columns[1] - self.columns[0]
        return (pixels[:, 0] - self.columns[0]) / step, (pixels[:, 1] - self.rows[0]) / step


class Warped(NamedTuple):
    """The reference image as the camera would see it from another pose.

    Attributes
    ----------
    picture : (H, W) the picture of a window of the image, 128 where the surface is not seen.
    depths : (H, W) its depths in metres, infinite there.
    corner : x and y of the window's first pixel in the image.
    """

    picture: Plane
    depths: Singles
    corner: tuple[int, int]


def from_depths(
    optics: Optics, columns: Floats, rows: Floats, depths_m: Floats, *, extended: bool = False
) -> Surface:
    """Return the surface of measured depths (rows, columns), NaN where there is none, without outliers and smoothed.

    The depth of a cell is that of a plane fitted to its neighbours, if enough of them were measured. An ``extended``
    surface continues beyond them, by planes fitted to wider windows.
    """
    known = np.isfinite(depths_m)
    filled = np.where(known, depths_m, np.nanmedian(depths_m)).astype(np.float32)
    for _ in range(2):
        typical = cv2.medianBlur(filled, 5)
        off = np.abs(depths_m - typical)
        known = np.isfinite(depths_m) & (off <= DEVIATION * np.nanmedian(off) + 1e-4)
        filled = np.where(known, depths_m, typical).astype(np.float32)
    smoothed = _local_planes(depths_m, known, SMOOTHED_CELLS)
    if extended:
        smoothed = np.where(np.isnan(smoothed), _local_planes(depths_m, known, EXTENDED_CELLS), smoothed)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1)
    return Surface(columns, rows, optics.points(pixels, smoothed))


def _local_planes(depths_m: Floats, known: Flags, sd_cells: float) -> Floats:
    """Return at each cell the value of the plane fitted to the known depths around it, NaN where they do not suffice.

    A weighted mean instead of a plane would flatten the rim, where all neighbours lie on one side.
    """
    rows, columns = np.indices(depths_m.shape).astype(float)
    weight = known.astype(float)
    value = np.where(known, depths_m, 0.0)

    def blurred(image: Floats) -> Floats:
        return np.asarray(cv2.GaussianBlur(image, (0, 0), sd_cells, borderType=cv2.BORDER_CONSTANT))

    sums = {
        name: blurred(weight * factor)
        for name, factor in {
            "1": np.ones_like(rows), "r": rows, "c": columns, "rr": rows * rows, "rc": rows * columns,
            "cc": columns * columns, "z": value, "rz": rows * value, "cz": columns * value,
        }.items()
    }  # fmt: skip
    total = sums["1"]
    enough = total > (SUPPORT if sd_cells == SMOOTHED_CELLS else 0.4 * SUPPORT)
    safe = np.where(enough, total, 1.0)
    mean = {name: part / safe for name, part in sums.items()}
    rr = mean["rr"] - mean["r"] ** 2 + 1e-3
    cc = mean["cc"] - mean["c"] ** 2 + 1e-3
    rc = mean["rc"] - mean["r"] * mean["c"]
    rz = mean["rz"] - mean["r"] * mean["z"]
    cz = mean["cz"] - mean["c"] * mean["z"]
    determinant = rr * cc - rc * rc
    slope_r, slope_c = (cc * rz - rc * cz) / determinant, (rr * cz - rc * rz) / determinant
    fitted = mean["z"] + slope_r * (rows - mean["r"]) + slope_c * (columns - mean["c"])
    return np.where(enough, fitted, np.nan)


def warp(reference: Plane, surface: Surface, optics: Optics, pose: Pose, margin: int) -> Warped | None:
    """Return the reference image as seen from another pose, in a window ``margin`` pixels larger than the surface.

    The result is None if no part of the surface would be in the image.
    """
    moved = pose.points(surface.points_m)
    pixels = optics.pixels(moved)
    if not np.isfinite(pixels).any():
        return None
    width, height = optics.size_px
    left, top = (max(0, int(np.floor(np.nanmin(pixels[..., axis]))) - margin) for axis in (0, 1))
    right = min(width, int(np.ceil(np.nanmax(pixels[..., 0]))) + margin + 1)
    bottom = min(height, int(np.ceil(np.nanmax(pixels[..., 1]))) + margin + 1)
    if right - left < 2 * margin or bottom - top < 2 * margin:
        return None
    picture = np.full((bottom - top, right - left), 128, dtype=np.uint8)
    depths = np.full(picture.shape, np.inf, dtype=np.float32)
    _draw(reference, surface.columns, surface.rows, pixels - [left, top], -moved[..., 2], picture, depths)
    return Warped(picture, depths, (left, top))


def visible(warped: Warped, optics: Optics, moved_m: Floats, normals: Floats) -> Flags:
    """Return which points (n, 3) of the moved surface, with its normals (n, 3) there, the camera sees."""
    pixels = optics.pixels(moved_m) - warped.corner
    height, width = warped.depths.shape
    inside = (pixels >= 0).all(axis=1) & (pixels[:, 0] <= width - 1) & (pixels[:, 1] <= height - 1)
    places = np.where(inside[:, None], np.round(pixels), 0.0).astype(int)
    nearest = warped.depths[places[:, 1], places[:, 0]]
    sight = -moved_m / np.linalg.norm(moved_m, axis=1, keepdims=True)
    facing = np.einsum("ni,ni->n", sight, normals)
    seen: Flags = inside & np.isfinite(nearest) & (-moved_m[:, 2] <= nearest + OCCLUDED_M) & (facing > OBLIQUE)
    return seen


@njit
def _interpolate(grid: Floats, columns: Floats, rows: Floats) -> Floats:
    """Return the values (n, 3) of a grid (H, W, 3) between its cells, NaN outside it or where a cell is NaN."""
    height, width = grid.shape[:2]
    values = np.full((len(columns), 3), np.nan)
    for n in range(len(columns)):
        j, i = int(np.floor(columns[n])), int(np.floor(rows[n]))
        if 0 <= i < height - 1 and 0 <= j < width - 1:
            right, down = columns[n] - j, rows[n] - i
            for axis in range(3):
                upper = (1.0 - right) * grid[i, j, axis] + right * grid[i, j + 1, axis]
                lower = (1.0 - right) * grid[i + 1, j, axis] + right * grid[i + 1, j + 1, axis]
                values[n, axis] = (1.0 - down) * upper + down * lower
    return values


@njit
def _draw(
    source: Plane, columns: Floats, rows: Floats, pixels: Floats, depths: Floats, picture: Plane, nearest: Singles
) -> None:
    """Draw the triangles of the grid, which carry the image ``source``, with a depth buffer."""
    n_rows, n_columns = depths.shape
    corners = np.empty((3, 5))  # x, y, depth, x and y in the source
    for i in range(n_rows - 1):
        for j in range(n_columns - 1):
            for half in range(2):
                for corner in range(3):
                    m = i + (corner == 1 if half == 0 else corner != 0)
                    n = j + (corner == 2 if half == 0 else corner != 1)
                    corners[corner, 0], corners[corner, 1] = pixels[m, n]
                    corners[corner, 2] = depths[m, n]
                    corners[corner, 3], corners[corner, 4] = columns[n], rows[m]
                if np.isfinite(corners[:, 0].sum() + corners[:, 2].sum()):
                    _triangle(source, corners, picture, nearest)


@njit
def _triangle(source: Plane, corners: Floats, picture: Plane, nearest: Singles) -> None:
    height, width = picture.shape
    x0, y0, x1, y1 = corners[0, 0], corners[0, 1], corners[1, 0], corners[1, 1]
    x2, y2 = corners[2, 0], corners[2, 1]
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if area >= 0.0:  # seen from behind
        return
    left, right = max(0, int(np.ceil(min(x0, x1, x2)))), min(width - 1, int(np.floor(max(x0, x1, x2))))
    top, bottom = max(0, int(np.ceil(min(y0, y1, y2)))), min(height - 1, int(np.floor(max(y0, y1, y2))))
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            b = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
            c = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
            a = 1.0 - b - c
            if a < -1e-9 or b < -1e-9 or c < -1e-9:
                continue
            depth = a * corners[0, 2] + b * corners[1, 2] + c * corners[2, 2]
            if depth >= nearest[y, x]:
                continue
            u = a * corners[0, 3] + b * corners[1, 3] + c * corners[2, 3]
            v = a * corners[0, 4] + b * corners[1, 4] + c * corners[2, 4]
            j, i = int(u), int(v)
            if 0 <= j < source.shape[1] - 1 and 0 <= i < source.shape[0] - 1:
                p, q = u - j, v - i
                upper = (1.0 - p) * source[i, j] + p * source[i, j + 1]
                lower = (1.0 - p) * source[i + 1, j] + p * source[i + 1, j + 1]
                picture[y, x] = np.uint8((1.0 - q) * upper + q * lower + 0.5)
                nearest[y, x] = depth
