"""Frames of a video as RGB images for display. Measurements read the planes of the video directly."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.container import InputContainer
from av.video.reformatter import VideoReformatter

from cospeech.errors import UserError
from cospeech.formats.canvas import Image


def opened(path: str | Path) -> InputContainer:
    """Open a film, whatever the encoding of the texts in it."""
    older: Any = {"metadata_errors": "replace"}  # newer versions of PyAV do so by themselves, and lack the option
    return av.open(str(path), **(older if int(av.__version__.partition(".")[0]) < 19 else {}))


def pictures(path: str | Path, height_px: int | None = None) -> Iterator[Image]:
    """Yield the frames (H, W, 3) of a video one after another, scaled to ``height_px`` if it is given.

    Raises
    ------
    UserError : if the video cannot be read.
    """
    try:
        with opened(path) as container:
            stream = container.streams.video[0]
            stream.thread_type = "NONE"
            reformatter = VideoReformatter()
            for frame in container.decode(stream):
                yield _rgb(frame, height_px, reformatter)
    except (av.FFmpegError, IndexError) as error:
        raise _unreadable(path, error) from error


def stills(path: str | Path, frames: Collection[int], height_px: int | None = None) -> dict[int, Image]:
    """Return selected frames (H, W, 3) of a video by their number.

    Raises
    ------
    UserError : if the video cannot be read, or has fewer frames.
    """
    try:
        with opened(path) as container:
            stream = container.streams.video[0]
            if stream.codec_context.codec.intra_only:  # frames are independent: decode only these
                packets = (packet for packet in container.demux(stream) if packet.size and not packet.is_discard)
                chosen = ((number, packet.decode()[0]) for number, packet in enumerate(packets) if number in frames)
            else:
                shown = enumerate(islice(container.decode(stream), max(frames, default=-1) + 1))
                chosen = ((number, frame) for number, frame in shown if number in frames)
            reformatter = VideoReformatter()
            found = {number: _rgb(frame, height_px, reformatter) for number, frame in chosen}
    except (av.FFmpegError, IndexError) as error:
        raise _unreadable(path, error) from error
    missing = sorted(set(frames) - set(found))
    if missing:
        raise UserError(f"{path}: ends before frame {missing[0]}; if the run wrote it, delete it and run again")
    return found


def _rgb(frame: av.VideoFrame, height_px: int | None, reformatter: VideoReformatter) -> Image:
    """Return one frame as RGB, turned upright as its metadata says.

    Share ``reformatter`` within a video, as setting it up costs as much as using it.
    """
    quarter_turns = frame.rotation // 90 % 4
    size = (frame.width, frame.height)
    scale = height_px / size[1 - quarter_turns % 2] if height_px else 1.0
    width, height = (round(side * scale) for side in size)
    scaled = reformatter.reformat(frame, width, height, "rgb24", interpolation="FAST_BILINEAR")
    image = np.asarray(scaled.to_ndarray(), dtype=np.uint8)
    return np.ascontiguousarray(np.rot90(image, quarter_turns)) if quarter_turns else image


def _unreadable(path: str | Path, error: Exception) -> UserError:
    return UserError(f"{path}: cannot be read as a video ({error}); if the run wrote it, delete it and run again")
