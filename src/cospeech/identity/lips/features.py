"""From the film of a talking face to coefficients of the lip region, frame by frame (Sargin 2006, 2.1.2)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers, Plane
from cospeech.data.segments import frame_times
from cospeech.errors import UserError
from cospeech.formats import films
from cospeech.identity.lips import alignment, mouth
from cospeech.identity.lips import alignment_kernels as kernels
from cospeech.identity.lips.interpolation import COEFFICIENTS, COLUMNS
from cospeech.identity.lips.mouth import Face

WIDTH, HEIGHT = 128, 80
"""Size of the lip region in pixels."""
FACE_PX = 170.0
"""Width of a face whose lips fill the region."""
MOST_LOST = 0.5
"""Share of the frames in which the alignment may fail."""
ROUNDING_S = 0.002
"""Largest deviation of times that are evenly spaced, as containers round them to milliseconds."""


class Shot(NamedTuple):
    """A frame: the time of its centre in seconds, and its luminance (H, W)."""

    time_s: float
    picture: Plane


def measure(clip: str, film: str | Path, fps: float, centre: tuple[float, float] | None = None) -> pd.DataFrame:
    """Return the lip features of a film as a table (schema ``lips``).

    Parameters
    ----------
    clip : name of the clip in the table.
    film : the film.
    fps : its frame rate.
    centre : x and y of the middle of the mouth in the first frame, in pixels; by default, it is looked for.

    Raises
    ------
    UserError
        If the film cannot be read or has no frames, if there is no mouth in the first frame, if the lip region leaves
        the picture, or if the face is lost in most frames.
    """
    shown = shots(film, fps)
    first = next(shown, None)
    if first is None:
        raise UserError(f"{film}: has no frames; copy it again")
    face = mouth.find(first.picture, str(film)) if centre is None else mouth.stated(*centre)
    times_s: list[float] = []

    def pictures() -> Iterator[Plane]:
        for shot in chain([first], shown):
            times_s.append(shot.time_s)
            yield shot.picture

    features, statuses = follow(pictures(), face, str(film))
    table = pd.DataFrame(features, columns=COLUMNS)
    table.insert(0, "clip", clip)
    table.insert(1, "frame", np.arange(len(features)))
    table.insert(2, "time_s", evened(np.array(times_s), fps))
    return table.assign(status=statuses)


def shots(film: str | Path, fps: float) -> Iterator[Shot]:
    """Yield the frames of a film, upright, at the times from the start of its sound, or of the film if it has none.

    Raises
    ------
    UserError : if the film cannot be read.
    """
    try:
        with films.opened(film) as container:
            stream = container.streams.video[0]
            stream.thread_type = "NONE"
            heard = container.streams.audio[0] if container.streams.audio else stream
            start_s = float((heard.start_time or 0) * (heard.time_base or 0))
            for number, frame in enumerate(container.decode(stream)):
                begins_s = number / fps if frame.time is None else frame.time - start_s
                picture = np.asarray(frame.to_ndarray(format="gray"), dtype=np.uint8)
                yield Shot(begins_s + 0.5 / fps, np.rot90(picture, frame.rotation // 90 % 4))
    except (av.FFmpegError, IndexError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{film}: cannot be read as a film ({reason}); convert it to mp4") from error


def evened(times_s: Floats, fps: float) -> Floats:
    """Return the times (T,) of frames without the rounding of their container, if they are evenly spaced."""
    even_s = frame_times(len(times_s), fps)
    return even_s if np.abs(times_s - even_s).max() <= ROUNDING_S else np.maximum(times_s, 0.0)


def follow(pictures: Iterator[Plane], face: Face, where: str) -> tuple[Floats, list[str]]:
    """Return the lip features (T, 50) of pictures (H, W), the first of which shows ``face``, and the status of each.

    Large faces are scaled down first, so that the region has no finer detail than its pixels.

    Raises
    ------
    UserError : if the lip region leaves the picture, or the face is lost in most frames.
    """
    factor = min(1.0, FACE_PX / face.width)
    face, shown = face.scaled(factor), reduced(pictures, factor) if factor < 1.0 else pictures
    grid = region_grid(face)
    first, last = None, alignment.STILL
    features, statuses = [], []
    for number, picture in enumerate(shown):
        if first is None:
            first = alignment.reference(picture, face)
        else:
            aligned = alignment.align(first, picture, last)
            statuses.append("held" if aligned.lost(face) else "aligned")
            last = last if aligned.lost(face) else aligned
        features.append(coefficients(lip_region(picture, alignment.moved(first, last, grid), where, number)))
    statuses.insert(0, "aligned")
    if statuses.count("held") > MOST_LOST * len(statuses):
        raise UserError(
            f"{where}: the face is lost in {statuses.count('held')} of {len(statuses)} frames, first in frame "
            f"{statuses.index('held')}; cut the film to where the same face is seen from the front"
        )
    return np.array(features), statuses


def reduced(pictures: Iterator[Plane], factor: float) -> Iterator[Plane]:
    """Yield pictures (H, W) at ``factor`` of their size."""
    for picture in pictures:
        small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        yield np.asarray(small, dtype=np.uint8)


def region_grid(face: Face) -> Floats:
    """Return the places (80, 128, 2) of the pixels of the lip region in the first frame, x and y."""
    step = face.width / FACE_PX
    across, down = np.meshgrid(np.arange(WIDTH) - (WIDTH - 1) / 2, np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    return np.stack([face.mouth_x + step * across, face.mouth_y + step * down], axis=-1)


def lip_region(picture: Plane, places: Floats, where: str, number: int) -> Floats:
    """Return the luminance (80, 128) of a picture (H, W) at ``places`` (80, 128, 2).

    Raises
    ------
    UserError : if some of them are outside the picture; it names the film ``where`` and the frame ``number``.
    """
    region = np.empty((HEIGHT, WIDTH))
    across, down = (np.ascontiguousarray(places[..., axis]) for axis in (0, 1))
    if not kernels.region(picture.astype(np.float32), across, down, region):
        raise UserError(
            f"{where}: the mouth is partly outside the picture in frame {number}; cut the film to where it is inside"
        )
    return region


def zigzag(n: int) -> Integers:
    """Return the first ``n`` places (n, 2), row and column, of a matrix in zig-zag order, as in JPEG."""
    size = int(np.ceil(np.sqrt(2.0 * n)))
    places = [
        (row, diagonal - row)
        for diagonal in range(size)
        for row in (range(diagonal + 1) if diagonal % 2 else range(diagonal, -1, -1))
    ]
    return np.array(places[:n])


def cosines(n: int, size: int) -> Floats:
    """Return the first ``n`` rows of the orthonormal discrete cosine transform of ``size`` values, (n, size)."""
    rows = np.cos(np.pi / size * np.outer(np.arange(n), np.arange(size) + 0.5)) * np.sqrt(2.0 / size)
    rows[0] = np.sqrt(1.0 / size)
    return rows


ZIGZAG = zigzag(COEFFICIENTS)
DOWN, ACROSS = cosines(int(ZIGZAG.max()) + 1, HEIGHT), cosines(int(ZIGZAG.max()) + 1, WIDTH)


def coefficients(region: Floats) -> Floats:
    """Return the first 50 coefficients, in zig-zag order, of the discrete cosine transform of a region (80, 128)."""
    return np.asarray((DOWN @ region @ ACROSS.T)[ZIGZAG[:, 0], ZIGZAG[:, 1]])
