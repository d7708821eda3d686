"""Synchronous reading of the films of one take, one image per camera at a time.

The planes Y, Cb and Cr of the decoder, the colour space of the thesis (Özkul 2012, 2.3), are used without conversion
or copy if the film is full-range 4:4:4. Other formats, which most cameras write, are converted to it. Only one set of
images is in memory at a time, whatever the length of the film.

Films are read as players show them: without the frames that the edit list of an MP4 file hides, and turned upright if
a phone wrote how it was held.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import av
import numpy as np
import pandas as pd

from cospeech.capture.tracking.interlacing import combed
from cospeech.data.arrays import Floats, Plane
from cospeech.errors import UserError
from cospeech.formats.films import opened
from cospeech.geometry.camera import Camera

Planes = tuple[Plane, Plane, Plane]
"""Y, Cb and Cr of one image, each (H, row length of the decoder); columns beyond the image width are padding."""

FULL = "yuvj444p"
"""FFmpeg's name for full-range Y, Cb, Cr (BT.601) at full chroma resolution."""

UNEVEN_FRAMES = 0.6
"""Largest deviation of a frame from a constant rate, in frames; beyond it, it is late or others were dropped."""

COMB_STEP, COMBED_FRAMES = 10, 2
"""Every how many frames an image is tested for combs, and in how many of them a film is interlaced."""

PROGRESSIVE = "convert every view with ffmpeg -vf bwdif (or, if no frame shows combed edges, with -vf setfield=prog)"
"""What to do with an interlaced film."""


@dataclass(frozen=True)
class Film:
    """Properties of the film of one view; frames before ``first`` are skipped and not counted in ``n_frames``.

    The images are turned counterclockwise by ``quarter_turns``; ``size_px`` is their size after it.
    """

    path: Path
    size_px: tuple[int, int]
    fps: float
    n_frames: int
    first: int = 0
    quarter_turns: int = 0

    def after(self, n_frames: int) -> Film:
        """Return the film without its first ``n_frames`` frames."""
        return replace(self, first=self.first + n_frames, n_frames=self.n_frames - n_frames)


def probe(path: str | Path, *, colour: bool = True) -> Film:
    """Return the properties of a film, read from its packets and its first frame.

    Parameters
    ----------
    colour : whether colour is needed, or luma is enough.

    Raises
    ------
    UserError : if the file is missing, is not a video, is truncated, lacks colour, is interlaced, lacks a frame, or
        has a variable frame rate.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such file; every camera of the rig needs one")
    try:
        with opened(path) as container:
            stream = container.streams.video[0]
            stream.thread_type = "NONE"
            size, fps = (stream.width, stream.height), float(stream.average_rate or 0)
            name, colours = stream.format.name, len(stream.format.components)
            shown: list[tuple[bool, float, float]] = []
            decoded: list[av.VideoFrame] = []
            for packet in container.demux():
                if packet.stream == stream and not decoded:
                    decoded += [frame for frame in packet.decode() if isinstance(frame, av.VideoFrame)]
                if packet.size and not packet.is_discard:
                    shown.append((packet.stream == stream, *_span_s(packet)))
            promised_s = ((container.start_time or 0) + (container.duration or 0)) / av.time_base
    except (av.FFmpegError, IndexError, TypeError, AttributeError) as error:
        raise UserError(f"{path}: not a video, or incomplete; convert it with ffmpeg, or copy it again") from error
    if not decoded:
        raise UserError(f"{path}: no frame can be decoded; convert it with ffmpeg, or film again")
    if colour and colours < 3:
        raise UserError(f"{path}: the film has no colour ({name}); film the markers in colour")
    if decoded[0].interlaced_frame:
        raise UserError(f"{path}: the film is interlaced, as it says itself; {PROGRESSIVE}")
    turned_deg = decoded[0].rotation
    if turned_deg % 90:
        raise UserError(f"{path}: flagged to be shown turned by {turned_deg} degrees; film upright")
    turns = turned_deg // 90 % 4
    starts_s = np.sort([start for is_picture, start, _ in shown if is_picture])
    if not fps and len(starts_s) > 1 and starts_s[-1] > starts_s[0]:  # some Matroska files do not state it
        fps = float((len(starts_s) - 1) / (starts_s[-1] - starts_s[0]))
    missing = (promised_s - max((end for *_, end in shown), default=0.0)) * fps
    if missing > 1.5:
        raise UserError(
            f"{path}: truncated: it has {len(starts_s)} of {len(starts_s) + missing:.0f} frames; copy it again, or "
            "cut the other views to the same length"
        )
    _check_times(starts_s, fps, path)
    return Film(path, size[::-1] if turns % 2 else size, fps, len(starts_s), quarter_turns=turns)


def _check_times(starts_s: Floats, fps: float, path: Path) -> None:
    """Raise UserError if the frames of a film, with start times (T,), do not follow each other at a constant rate."""
    gaps_s = np.diff(starts_s)
    steps = gaps_s / max(float(np.median(gaps_s)), 1e-9) if len(gaps_s) else gaps_s
    late = np.abs((starts_s - starts_s[:1]) * fps - np.arange(len(starts_s)))
    uneven = np.flatnonzero(np.abs(steps - 1.0) > UNEVEN_FRAMES)
    frame = int(uneven[0]) + 1 if len(uneven) else int(np.argmax(late)) if len(late) else 0
    if len(uneven) and (lost := round(steps[frame - 1]) - 1) > 0:
        raise UserError(
            f"{path}: {lost} frame{'s' * (lost > 1)} before frame {frame} (at {starts_s[frame]:.3f} s) "
            f"{'are' if lost > 1 else 'is'} missing; record the take again, or fill the gap with ffmpeg -fps_mode cfr"
        )
    crowded = np.flatnonzero(steps[:-1] + steps[1:] < 2.0 - UNEVEN_FRAMES)
    if len(crowded) and not len(uneven):
        extra = int(crowded[0]) + 1
        raise UserError(
            f"{path}: frame {extra} (at {starts_s[extra]:.3f} s) is one too many, between two others that are one "
            "frame apart; convert the film with ffmpeg -fps_mode cfr"
        )
    if len(uneven) or late.max(initial=0.0) > UNEVEN_FRAMES:
        raise UserError(
            f"{path}: frame {frame} (at {starts_s[frame]:.3f} s) deviates by {late[frame]:.1f} frames from a "
            f"constant {fps:g} frames/s; convert the film with ffmpeg -fps_mode cfr"
        )


def _span_s(packet: av.Packet) -> tuple[float, float]:
    """Return the start and end time of a packet in seconds."""
    start = (packet.dts if packet.pts is None else packet.pts) or 0
    return float(start * packet.time_base), float((start + (packet.duration or 0)) * packet.time_base)


def check(films: Sequence[Film], cameras: Sequence[Camera], most_frames_apart: int) -> int:
    """Check that the films fit the cameras and each other, and return the number of frames that they have in common.

    Parameters
    ----------
    films, cameras : one film per camera, in the same order.
    most_frames_apart : largest difference in length between two views, frames.

    Raises
    ------
    UserError : if their number, image size, frame rate or length does not match.
    """
    if len(films) != len(cameras):
        raise UserError(f"{len(films)} films for {len(cameras)} cameras; provide one film for each camera of the rig")
    for film, camera in zip(films, cameras, strict=True):
        if film.size_px != camera.size_px:
            turned = " (rotated by 90 degrees?)" if film.size_px == camera.size_px[::-1] else ""
            raise UserError(
                f"{film.path}: the image size is {film.size_px[0]}x{film.size_px[1]}, but camera {camera.name} was "
                f"calibrated at {camera.size_px[0]}x{camera.size_px[1]}{turned}; film and calibrate at the same size"
            )
    return common_length(films, most_frames_apart)


def match_cameras(films: Sequence[Film], cameras: Sequence[Camera]) -> list[Camera]:
    """Return the cameras in the order of their films, which are named after them.

    Raises
    ------
    UserError : if a camera has no film, or a film has no camera.
    """
    names, known = [film.path.stem for film in films], {camera.name: camera for camera in cameras}
    if sorted(names) != sorted(known):
        raise UserError(
            f"{films[0].path.parent}: films of {', '.join(names)} for a rig of {', '.join(known)}; provide one film "
            "for each camera of the rig, named after it"
        )
    return [known[name] for name in names]


def open_take(
    paths: Sequence[str | Path], table: pd.DataFrame | None, cameras: Sequence[Camera]
) -> tuple[list[Film], list[Camera]]:
    """Return the films of a take, trimmed to a common start by the table ``offsets``, and the camera of each film.

    Raises
    ------
    UserError : see ``probe`` and ``match_cameras``.
    """
    films = [probe(path) for path in paths]
    cameras = match_cameras(films, cameras)
    if table is not None:
        skipped = table.set_index("stream")["skipped_s"]
        films = [film.after(round(skipped[film.path.stem] * film.fps)) for film in films]
    return films, cameras


def common_length(films: Sequence[Film], most_frames_apart: int) -> int:
    """Return the number of frames that all films of a take have in common.

    Parameters
    ----------
    most_frames_apart : largest difference in length between two views, frames.

    Raises
    ------
    UserError : if their frame rate or length does not match.
    """
    for film in films:
        if abs(film.fps - films[0].fps) > 1e-3 * films[0].fps:
            raise UserError(
                f"{film.path}: {film.fps:g} frames/s, but {films[0].path.name} has {films[0].fps:g}; "
                "convert all views to the same frame rate"
            )
    shortest = min(film.n_frames for film in films)
    for film in films:
        if film.n_frames - shortest > most_frames_apart:
            raise UserError(
                f"{film.path}: {film.n_frames} frames, but the shortest view has {shortest}, a difference of more "
                f"than {most_frames_apart}; cut the views to the same start and end, or raise "
                "capture.track.most_frames_apart"
            )
    return shortest


def brightness(film: Film) -> Generator[Plane]:
    """Yield the luma (H, W) of each frame, whatever the pixel format.

    Raises
    ------
    UserError : if a frame cannot be decoded.
    """
    for frame in _decoded(film):
        with _reading(film):
            luma = np.asarray(frame.to_ndarray(format="gray"), dtype=np.uint8)
        yield np.rot90(luma, film.quarter_turns) if film.quarter_turns else luma


def _luma(frame: av.VideoFrame) -> Plane:
    """Return the luma of a frame as the decoder stores it, without conversion, if that has eight bits per pixel."""
    if not frame.format.is_planar or frame.format.components[0].bits != 8:
        return np.asarray(frame.to_ndarray(format="gray"), dtype=np.uint8)
    plane = frame.planes[0]
    return np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)[
        : frame.height, : frame.width
    ]


def _decoded(film: Film) -> Generator[av.VideoFrame]:
    n_combed = 0
    with _reading(film), opened(film.path) as container:
        container.streams.video[0].thread_type = "NONE"
        for number, frame in enumerate(islice(container.decode(video=0), film.first, None)):
            if number % COMB_STEP == 0:
                n_combed += combed(_luma(frame))
                if n_combed >= COMBED_FRAMES:
                    raise UserError(
                        f"{film.path}: the film is interlaced: the edges of what moves in frame "
                        f"{film.first + number} are combed; {PROGRESSIVE}"
                    )
            yield frame


@contextmanager
def _reading(film: Film) -> Iterator[None]:
    """Turn the error of a frame that cannot be decoded or converted into a UserError."""
    try:
        yield
    except (av.FFmpegError, OSError) as error:
        raise UserError(
            f"{film.path}: a frame cannot be decoded ({error}); convert the film with ffmpeg, or film again"
        ) from error


def planes(frame: av.VideoFrame, quarter_turns: int = 0) -> Planes:
    """Return the planes of a decoded frame, turned counterclockwise, valid until the next frame is read.

    Subsampled chroma (4:2:0) is first interpolated to full resolution, with the chroma siting of its standard; range
    and matrix are then converted to those of ``FULL``.
    """
    if frame.format.name != FULL:
        if not frame.format.name.startswith("yuvj"):
            frame = frame.reformat(format="yuv444p")
        frame = frame.reformat(format=FULL, dst_colorspace="ITU601", dst_color_range="JPEG")
    y, cb, cr = (
        np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)[: frame.height]
        for plane in frame.planes
    )
    if quarter_turns:
        y, cb, cr = (np.ascontiguousarray(np.rot90(plane[:, : frame.width], quarter_turns)) for plane in (y, cb, cr))
    return y, cb, cr


def read(films: Sequence[Film], n_frames: int) -> Iterator[list[Planes]]:
    """Yield the images of all films, one frame after another, for ``n_frames`` frames.

    Raises
    ------
    UserError : if a film ends early or a frame cannot be decoded.
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
                    raise UserError(
                        f"{film.path}: ends after {frame} of {n_frames} frames; convert it with ffmpeg, or film again"
                    )
                with _reading(film):
                    pictures.append(planes(picture, film.quarter_turns))
            yield pictures
