"""The films of one take, read in step, one set of pictures after another.

The decoder's own planes are used as they are: Y, Cb, Cr, the colours that the thesis tracks in (Özkul 2012, 2.3), so
that nothing is converted or copied where the film is 4:4:4 in full range. Others, as most cameras write them, are
brought to it. One set of pictures is in memory at a time, whatever the length of the film.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import av
import numpy as np
import pandas as pd

from cospeech.data.arrays import Plane
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera

Planes = tuple[Plane, Plane, Plane]
"""Y, Cb and Cr of one picture, each (H, width of the decoder's rows); what lies right of W is no picture."""

FULL = "yuvj444p"
"""Y, Cb and Cr of every pixel in full range (BT.601), by its name in FFmpeg."""

UNEVEN_FRAMES = 0.6
"""A picture that comes farther from its place in an even rate, in frames, is late, or one before it was dropped."""


@dataclass(frozen=True)
class Film:
    """What the file of one view says of itself; pictures before ``first`` are passed over and not counted."""

    path: Path
    size_px: tuple[int, int]
    fps: float
    n_frames: int
    first: int = 0

    def after(self, n_frames: int) -> Film:
        """Return the film without its first ``n_frames`` pictures."""
        return replace(self, first=self.first + n_frames, n_frames=self.n_frames - n_frames)


def examine(path: str | Path, *, colour: bool = True) -> Film:
    """Return what a film says of itself, from its packets, without decoding a picture.

    Parameters
    ----------
    colour : whether the colour of every pixel is needed, or brightness is enough.

    Raises
    ------
    UserError : where the file is missing, is no film, is cut short, has no colour, or an uneven frame rate.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such film; every camera of the rig must have one")
    try:
        with av.open(path) as container:
            stream = container.streams.video[0]
            size, fps = (stream.width, stream.height), float(stream.average_rate or 0)
            name, colours = stream.format.name, len(stream.format.components)
            spans_s = [(packet.stream == stream, *_span_s(packet)) for packet in container.demux() if packet.size]
            promised_s = ((container.start_time or 0) + (container.duration or 0)) / av.time_base
    except (av.FFmpegError, IndexError, TypeError, AttributeError) as error:
        raise UserError(f"{path}: no film, or its head is damaged; record or copy it again") from error
    if colour and colours < 3:
        raise UserError(f"{path}: its pictures have no colour ({name}); film the markers in colour")
    starts_s = np.sort([start for is_picture, start, _ in spans_s if is_picture])
    missing = (promised_s - max((end for *_, end in spans_s), default=0.0)) * fps
    if missing > 1.5:
        raise UserError(
            f"{path}: cut short: {len(starts_s)} of {len(starts_s) + missing:.0f} frames are there; copy it again, "
            "or cut the other views"
        )
    late = np.abs((starts_s - starts_s[:1]) * fps - np.arange(len(starts_s)))
    if late.max(initial=0.0) > UNEVEN_FRAMES:
        raise UserError(
            f"{path}: frame {int(np.argmax(late))} is {late.max():.1f} frames off an even {fps:g} frames/s: the rate "
            "varies, or frames were dropped; convert it with ffmpeg -fps_mode cfr"
        )
    return Film(path, size, fps, len(starts_s))


def _span_s(packet: av.Packet) -> tuple[float, float]:
    """Return when what a packet holds starts and ends, in seconds."""
    start = (packet.dts if packet.pts is None else packet.pts) or 0
    return float(start * packet.time_base), float((start + (packet.duration or 0)) * packet.time_base)


def check(films: Sequence[Film], cameras: Sequence[Camera], most_frames_apart: int) -> int:
    """Return the number of frames that all films have, after holding them against the cameras and each other.

    Parameters
    ----------
    films, cameras : one film for each camera, in the same order.
    most_frames_apart : how many frames the views may differ in length.

    Raises
    ------
    UserError : where their number, size, frame rate or length does not fit.
    """
    if len(films) != len(cameras):
        raise UserError(f"{len(films)} films for {len(cameras)} cameras; give one film for each camera of the rig")
    for film, camera in zip(films, cameras, strict=True):
        if film.size_px != camera.size_px:
            turned = ", it seems turned" if film.size_px == camera.size_px[::-1] else ""
            raise UserError(
                f"{film.path}: pictures are {film.size_px[0]}x{film.size_px[1]}, camera {camera.name} was calibrated "
                f"at {camera.size_px[0]}x{camera.size_px[1]}{turned}; film and calibrate at one size"
            )
    return in_step(films, most_frames_apart)


def in_order(films: Sequence[Film], cameras: Sequence[Camera]) -> list[Camera]:
    """Return the cameras in the order of their films, which are named like them.

    Raises
    ------
    UserError : where a camera has no film, or a film no camera.
    """
    names, known = [film.path.stem for film in films], {camera.name: camera for camera in cameras}
    if sorted(names) != sorted(known):
        raise UserError(
            f"{films[0].path.parent}: films of {', '.join(names)} for a rig of {', '.join(known)}; give one film, "
            "named like it, for each camera of the rig"
        )
    return [known[name] for name in names]


def of_take(
    paths: Sequence[str | Path], table: pd.DataFrame | None, cameras: Sequence[Camera]
) -> tuple[list[Film], list[Camera]]:
    """Return the films of a take without what they skip by the table ``offsets``, and the camera of each.

    Raises
    ------
    UserError : see ``examine`` and ``in_order``.
    """
    films = [examine(path) for path in paths]
    cameras = in_order(films, cameras)
    if table is not None:
        skipped = table.set_index("stream")["skipped_s"]
        films = [film.after(round(skipped[film.path.stem] * film.fps)) for film in films]
    return films, cameras


def in_step(films: Sequence[Film], most_frames_apart: int) -> int:
    """Return the number of frames that all films of a take have.

    Parameters
    ----------
    most_frames_apart : how many frames the views may differ in length.

    Raises
    ------
    UserError : where their frame rate or length does not fit.
    """
    for film in films:
        if abs(film.fps - films[0].fps) > 1e-3 * films[0].fps:
            raise UserError(
                f"{film.path}: {film.fps:g} frames/s, but {films[0].path.name} has {films[0].fps:g}; "
                "bring all views to one rate"
            )
    shortest = min(film.n_frames for film in films)
    for film in films:
        if film.n_frames - shortest > most_frames_apart:
            raise UserError(
                f"{film.path}: {film.n_frames} frames, the shortest view has {shortest}: more than "
                f"{most_frames_apart} apart; cut the views to one start and end, or raise the limit"
            )
    return shortest


def brightness(film: Film) -> Generator[Plane]:
    """Yield the brightness (H, W) of each picture, whatever its colours.

    Raises
    ------
    UserError : where a picture cannot be decoded.
    """
    for frame in _decoded(film):
        yield np.asarray(frame.to_ndarray(format="gray"), dtype=np.uint8)


def _decoded(film: Film) -> Generator[av.VideoFrame]:
    try:
        with av.open(film.path) as container:
            container.streams.video[0].thread_type = "NONE"
            for frame in islice(container.decode(video=0), film.first, None):
                if frame.rotation:
                    raise UserError(
                        f"{film.path}: is to be shown turned by {frame.rotation} degrees; turn its pictures "
                        "themselves, as ffmpeg does when it converts, or film upright"
                    )
                yield frame
    except av.FFmpegError as error:
        raise UserError(f"{film.path}: a picture is damaged ({error}); copy the film again") from error


def planes(frame: av.VideoFrame) -> Planes:
    """Return the planes of a decoded picture, valid until the next picture is read.

    Where colour has fewer pixels than brightness (4:2:0), it is first brought to the same number, as its standard
    places it; then range and matrix are changed to those of ``FULL``.
    """
    if frame.format.name != FULL:
        if not frame.format.name.startswith("yuvj"):
            frame = frame.reformat(format="yuv444p")
        frame = frame.reformat(format=FULL, dst_colorspace="ITU601", dst_color_range="JPEG")
    y, cb, cr = (
        np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)[: frame.height]
        for plane in frame.planes
    )
    return y, cb, cr


def read(films: Sequence[Film], n_frames: int) -> Iterator[list[Planes]]:
    """Yield the pictures of all films in step, for ``n_frames`` frames.

    Raises
    ------
    UserError : where a film ends early or a picture cannot be decoded.
    """
    with ExitStack() as stack:
        views = [_decoded(film) for film in films]
        for view in views:
            stack.callback(view.close)
        for frame in range(n_frames):
            pictures = []
            for film, view in zip(films, views, strict=True):
                picture = next(view, None)
                if picture is None:
                    raise UserError(f"{film.path}: ends at frame {frame} of {n_frames}; copy the film again")
                pictures.append(planes(picture))
            yield pictures
