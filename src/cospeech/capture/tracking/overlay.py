"""Films overlaid with the tracked markers: rings whose colour shows the status of each position."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from PIL import Image as Pillow

from cospeech.capture.tracking.footage import Film
from cospeech.capture.tracking.quality_sheet import nearest_known
from cospeech.data import trajectories
from cospeech.data.arrays import Floats
from cospeech.formats import canvas, films
from cospeech.formats.canvas import Colour, Image, Opacity
from cospeech.geometry.camera import Camera, project
from cospeech.motion.markers import NAMES

COLOURS: dict[str, Colour] = {
    "seen": (64, 196, 255),
    "predicted": (255, 176, 0),
    "corrected": (220, 110, 255),
    "lost": (255, 70, 60),
}
"""Colour of a marker's ring by its status in the view; a lost marker is drawn at its last known position."""

GROUND, PALE = (24, 26, 30), (205, 209, 214)

TILE_PX, MARGIN = 320, 0.08
"""Height of a tile, and the margin around the markers relative to their extent."""
COLUMNS = 3

CROP_PX = 200
CROP_SHARE = 0.115
"""Side of a crop, in output pixels and as a fraction of the width of the film."""


@functools.cache
def ring(radius: float, width: float) -> Opacity:
    """Return the opacity of a ring of ``radius`` and line ``width`` in pixels, over its bounding square."""
    half = int(np.ceil(radius + width))
    down, across = np.mgrid[-half : half + 1, -half : half + 1]
    off = np.abs(np.hypot(down, across) - radius)
    return np.clip(width / 2 + 0.5 - off, 0.0, 1.0).astype(np.float32)


@functools.cache
def cross(size: int) -> Opacity:
    """Return the opacity of a cross whose arms are ``size`` pixels long."""
    plate = np.zeros((2 * size + 1, 2 * size + 1), dtype=np.float32)
    plate[size] = plate[:, size] = 1.0
    return plate


def stamp(image: Image, place_px: Floats, shape: Opacity, colour: Colour) -> None:
    """Draw a square ``shape`` of odd side on an image in place, centred at x and y (2,), unless they are NaN."""
    if np.isfinite(place_px).all():
        half = shape.shape[0] // 2
        canvas.lay(image, round(float(place_px[1])) - half, round(float(place_px[0])) - half, colour, shape)


def as_arrays(views: pd.DataFrame, cameras: Sequence[Camera]) -> tuple[Floats, npt.NDArray[np.object_]]:
    """Return positions (T, C, M, 2) and status (T, C, M); a lost marker has its nearest known position in time."""
    names = [camera.name for camera in cameras]
    n_frames = int(views["frame"].max()) + 1
    order = pd.MultiIndex.from_product([range(n_frames), names, NAMES], names=["frame", "camera", "marker"])
    held = nearest_known(views).set_index(["frame", "camera", "marker"]).reindex(order)
    shape = (n_frames, len(names), len(NAMES))
    places = held[["x_px", "y_px"]].to_numpy(dtype=float).reshape(*shape, 2)
    return places, held["status"].to_numpy(dtype=object).reshape(shape)


def mosaic(
    takes: Sequence[Film], cameras: Sequence[Camera], views: pd.DataFrame, fps: float, title: str
) -> Iterator[Image]:
    """Yield the frames of all films side by side with their markers, and a legend in the last tile.

    Each tile is cropped to the region that the markers occupy over the whole take; all views have the same scale.

    Parameters
    ----------
    takes : the film of each camera.
    views : the table ``markers_2d``.
    title : the line above the time in the legend.
    """
    places, status = as_arrays(views, cameras)
    low, high = np.nanmin(places, axis=(0, 2)), np.nanmax(places, axis=(0, 2))
    room = (high - low).max(axis=0) * (1 + 2 * MARGIN)
    scale = TILE_PX / room[1]
    width = 2 * round(scale * room[0] / 2)
    corners = np.maximum(scale * ((low + high) / 2 - room / 2), 0).astype(int)
    places = (places + 0.5) * scale - 0.5 - corners[:, None]
    rows = -(-(len(cameras) + 1) // COLUMNS)
    image = np.empty((rows * TILE_PX, COLUMNS * width, 3), dtype=np.uint8)
    scaled = [
        itertools.islice(films.pictures(take.path, round(scale * camera.size_px[1])), take.first, None)
        for take, camera in zip(takes, cameras, strict=True)
    ]
    shape = ring(7.0, 1.6)
    for frame, pictures in enumerate(itertools.islice(zip(*scaled, strict=False), len(places))):
        image[:] = GROUND
        for view, (picture, (left, top)) in enumerate(zip(pictures, corners, strict=True)):
            tile = _tile(image, view, width)
            part = picture[top : top + TILE_PX, left : left + width]
            tile[: part.shape[0], : part.shape[1]] = part
            for place, how in zip(places[frame, view], status[frame, view], strict=True):
                stamp(tile, place, shape, COLOURS[how])
            canvas.write(tile, cameras[view].name, 8, 10, 13, PALE, bold=True)
        legend = _tile(image, len(cameras), width)
        canvas.write(legend, title, 24, 24, 15, PALE, bold=True)
        canvas.write(legend, f"{(frame + 0.5) / fps:.2f} s, frame {frame}", 50, 24, 13, PALE)
        for line, (how, colour) in enumerate(COLOURS.items()):
            stamp(legend, np.array([32.0, 100.0 + 26 * line]), shape, colour)
            canvas.write(legend, f"{how}: {int((status[frame] == how).sum())}", 91 + 26 * line, 50, 13, PALE)
        yield image


def _tile(image: Image, number: int, width: int) -> Image:
    row, column = divmod(number, COLUMNS)
    return image[row * TILE_PX : (row + 1) * TILE_PX, column * width : (column + 1) * width]


def moments(
    table: pd.DataFrame,
    takes: Sequence[Film],
    cameras: Sequence[Camera],
    views: pd.DataFrame,
    world: pd.DataFrame,
) -> list[Image]:
    """Return one image per moment: crops around its marker in every view, from left to right.

    A thick ring marks the detected or predicted position of the marker, and a cross the projection of its smoothed 3D
    position; the other markers have thin rings.

    Parameters
    ----------
    table : schema ``worst_moments``.
    takes : the film of each camera.
    views, world : the tables ``markers_2d`` and ``markers_3d``.
    """
    places, status = as_arrays(views, cameras)
    points = world.set_index(["frame", "marker"])[trajectories.AXES]
    shots = [films.stills(take.path, set(table["frame"] + take.first)) for take in takes]
    drawn = []
    for _, moment in table.drop_duplicates("moment").iterrows():
        frame, marker = moment["frame"], NAMES.index(moment["marker"])
        point = points.loc[(frame, moment["marker"])].to_numpy(dtype=float)
        crops = []
        for view, camera in enumerate(cameras):
            known = places[frame, view], status[frame, view]
            crops.append(_crop(shots[view][frame + takes[view].first], *known, marker, project(camera, point)))
            canvas.write(crops[-1], f"{camera.name} {status[frame, view, marker]}", 6, 8, 12, PALE, bold=True)
        drawn.append(np.hstack(crops))
    return drawn


def _crop(picture: Image, places: Floats, status: npt.NDArray[np.object_], marker: int, projected: Floats) -> Image:
    """Return a crop around a marker in one view; ``projected`` (2,) is the projection of its 3D position."""
    if not np.isfinite(places[marker]).all():
        return np.full((CROP_PX, CROP_PX, 3), GROUND, dtype=np.uint8)
    side = round(CROP_SHARE * picture.shape[1])
    left, top = corner = np.rint(places[marker]).astype(int) - side // 2
    near = np.full((side, side, 3), GROUND, dtype=np.uint8)
    canvas.lay(near, -top, -left, picture, np.ones(picture.shape[:2], dtype=np.float32))
    places, projected = ((at - corner + 0.5) * CROP_PX / side - 0.5 for at in (places, projected))
    plate = np.array(Pillow.fromarray(near).resize((CROP_PX, CROP_PX), Pillow.Resampling.BICUBIC))
    for index, (place, how) in enumerate(zip(places, status, strict=True)):
        stamp(plate, place, ring(17.0, 3.0) if index == marker else ring(15.0, 1.0), COLOURS[how])
    stamp(plate, projected, cross(6), (255, 255, 255))
    plate[:, -2:] = 255
    return plate
