"""From the film of a talking face to coefficients of the lip region, frame by frame (Sargin 2006, 2.1.2)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers, Plane, Singles
from cospeech.data.segments import frame_times
from cospeech.errors import UserError
from cospeech.formats import films
from cospeech.identity.lips import alignment, mouth
from cospeech.identity.lips import alignment_kernels as kernels
from cospeech.identity.lips.interpolation import COEFFICIENTS, COLUMNS
from cospeech.identity.lips.mouth import Face

WIDTH, HEIGHT = 128, 80
"""Size of the lip region in pixels."""
FACE_PX = 230.0
"""Width of a face whose lips fill the region. A larger region would show what is behind the chin and stays there."""
MARGIN = 16
"""Pixels around the region within which its middle is moved to the middle of what moves."""
WATCHED = 200
"""Number of frames in which it is looked for what moves, the first ones of the film."""
MOST_LOST = 0.5
"""Share of the frames in which the alignment may fail."""
ROUNDING_S = 0.002
"""Largest deviation of times that are evenly spaced, as containers round them to milliseconds."""


class Shot(NamedTuple):
    """A frame: the time of its centre in seconds, and its luminance (H, W)."""

    time_s: float
    picture: Plane


class Seen(NamedTuple):
    """The lip region with its margin in a frame, (112, 160), NaN outside the picture, and whether it is aligned."""

    region: Singles
    aligned: bool


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
    face = mouth.find(first.picture, str(film), centre)
    times_s: list[float] = []

    def pictures() -> Iterator[Plane]:
        for shot in chain([first], shown):
            times_s.append(shot.time_s)
            yield shot.picture

    features, statuses = follow(pictures(), face, str(film), centred=centre is None)
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


def follow(pictures: Iterator[Plane], face: Face, where: str, centred: bool = True) -> tuple[Floats, list[str]]:
    """Return the lip features (T, 50) of pictures (H, W), the first of which shows ``face``, and the status of each.

    Large faces are scaled down first, so that the region has no finer detail than its pixels.

    Parameters
    ----------
    where : the film, for messages.
    centred : whether the region is centred on what moves (``mouth.moving``); if not, on the mouth of ``face``.

    Raises
    ------
    UserError : if the lip region leaves the picture, or the face is lost in most frames.
    """
    factor = min(1.0, FACE_PX / face.width)
    shown = aligned_regions(reduced(pictures, factor) if factor < 1.0 else pictures, face.scaled(factor))
    begun = list(islice(shown, WATCHED))
    right, down = mouth.moving(np.array([seen.region for seen in begun]), MARGIN) if centred else (0.0, 0.0)
    rows, columns = shifted_cosines(HEIGHT, MARGIN + down), shifted_cosines(WIDTH, MARGIN + right)
    used = np.ix_((rows != 0.0).any(axis=0), (columns != 0.0).any(axis=0))
    features, statuses = [], []
    for number, seen in enumerate(chain(begun, shown)):
        if np.isnan(seen.region[used]).any():
            raise UserError(
                f"{where}: the mouth is partly outside the picture in frame {number}; cut the film to where it is "
                "inside"
            )
        features.append(zigzagged(rows @ np.nan_to_num(seen.region) @ columns.T))
        statuses.append("aligned" if seen.aligned else "held")
    if statuses.count("held") > MOST_LOST * len(statuses):
        raise UserError(
            f"{where}: the face is lost in {statuses.count('held')} of {len(statuses)} frames, first in frame "
            f"{statuses.index('held')}; cut the film to where the same face is seen from the front"
        )
    return np.array(features), statuses


def aligned_regions(pictures: Iterator[Plane], face: Face) -> Iterator[Seen]:
    """Yield the aligned lip region and its margin in pictures (H, W); ``face`` is that in the first picture."""
    grid = region_grid(face, MARGIN)
    first, last = None, alignment.STILL
    for picture in pictures:
        lost = False
        if first is None:
            first = alignment.reference(picture, face)
        else:
            aligned = alignment.align(first, picture, last)
            lost = aligned.lost(face)
            last = last if lost else aligned
        yield Seen(lip_region(picture, alignment.moved(first, last, grid)), not lost)


def reduced(pictures: Iterator[Plane], factor: float) -> Iterator[Plane]:
    """Yield pictures (H, W) at ``factor`` of their size."""
    for picture in pictures:
        small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        yield np.asarray(small, dtype=np.uint8)


def region_grid(face: Face, margin: int = 0) -> Floats:
    """Return the places (80, 128, 2) of the pixels of the lip region in the first frame, x and y, and of a margin."""
    step = face.width / FACE_PX
    across, down = np.meshgrid(
        np.arange(-margin, WIDTH + margin) - (WIDTH - 1) / 2, np.arange(-margin, HEIGHT + margin) - (HEIGHT - 1) / 2
    )
    return np.stack([face.mouth_x + step * across, face.mouth_y + step * down], axis=-1)


def lip_region(picture: Plane, places: Floats) -> Singles:
    """Return the luminance (H, W) of a picture at ``places`` (H, W, 2); NaN where they are outside the picture."""
    region = np.empty(places.shape[:2], dtype=np.float32)
    across, down = (np.ascontiguousarray(places[..., axis]) for axis in (0, 1))
    kernels.region(picture.astype(np.float32), across, down, region)
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
N_COSINES = int(ZIGZAG.max()) + 1


def shifted_cosines(size: int, start: float) -> Floats:
    """Return ``cosines`` of ``size`` values that start between two of ``size`` + 2 ``MARGIN`` values.

    Parameters
    ----------
    size : number of values that are transformed.
    start : where they start, from 0 to 2 ``MARGIN``. Between two values, they are interpolated.

    Returns
    -------
    (n, size + 2 MARGIN) to multiply all values with.
    """
    first, rest = int(start), start - int(start)
    rows, found = cosines(N_COSINES, size), np.zeros((N_COSINES, size + 2 * MARGIN))
    found[:, first : first + size] = (1.0 - rest) * rows
    if rest:
        found[:, first + 1 : first + 1 + size] += rest * rows
    return found


def zigzagged(transform: Floats) -> Floats:
    """Return the first 50 coefficients, in zig-zag order, of a discrete cosine transform."""
    return np.asarray(transform[ZIGZAG[:, 0], ZIGZAG[:, 1]])
