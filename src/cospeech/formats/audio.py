"""Speech in any format that FFmpeg decodes (wav, flac, mp3, m4a, ogg, the sound of a video) as mono sound at 16 kHz.

It is decoded, mixed down and resampled piece by piece, so that hours fit into memory; see ``sound.mixed``.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import av
import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import sound

INTEGERS = {"u1": 128.0, "i2": 32768.0, "i4": 2147483648.0}
"""Value of full scale by the type of the decoded samples; floating-point samples have 1."""

LOCAL = {"protocol_whitelist": "file"}
"""Options of FFmpeg: a playlist must not make it fetch anything. ``file:`` allows for colons in names."""

EXACT = ("aiff", "au", "flac", "mov")
"""Containers that state the length of their sound; others let FFmpeg estimate it."""

SHORT_S = 0.25
"""By how much sound may be shorter than its container states, in seconds: encoders pad and cut both ends."""


def samples(given: str | Path | Floats, channel: int | None = None) -> Floats:
    """Return the samples (n,) of a file, or those that are given; see ``read``."""
    return given if isinstance(given, np.ndarray) else read(given, channel).samples


def read(path: str | Path, channel: int | None = None) -> sound.Sound:
    """Read the first audio stream of a file.

    Parameters
    ----------
    path : a sound file, or a video with sound.
    channel : the channel to take, counted from 1; None mixes all channels down to one.

    Raises
    ------
    UserError : if the file is missing, empty, truncated, too long or silent, if it contains no sound that can be
        decoded, if it contains NaN, if it has no such channel, or if its channels contain different speech and none
        is chosen.
    """
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path}: is a folder; name a sound file")
    if not path.exists():
        raise UserError(f"{path}: no such file; correct the path")
    if path.stat().st_size == 0:
        raise UserError(f"{path}: is empty; copy it again")
    try:
        with av.open(f"file:{path}", options=LOCAL) as container:
            if not container.streams.audio:
                raise UserError(f"{path}: contains no sound; name a file with speech")
            if container.format.name != "wav":
                return _read_stream(container, path, channel)
            sound.check_whole(path)
            if not container.streams.audio[0].codec_context.name.startswith("pcm"):
                return _read_stream(container, path, channel)
        return sound.read(path, channel=channel)  # FFmpeg takes big-endian samples for little-endian ones
    except (av.FFmpegError, OSError, ValueError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:80]
        raise UserError(f"{path}: cannot be decoded as sound ({reason}); convert it to wav") from error


def _read_stream(container: av.container.InputContainer, path: Path, channel: int | None) -> sound.Sound:
    stream = container.streams.audio[0]
    frames = container.decode(stream)
    first = next(frames, None)  # only decoded frames show the rate and channels of some AAC streams
    if first is None:
        raise UserError(f"{path}: contains no sound; copy it again")
    rate, n_channels = first.sample_rate, len(first.layout.channels)
    pieces = _pieces(chain([first], frames), path, rate, n_channels)
    read = sound.mixed(path, pieces, rate, n_channels, channel)
    announced_s = float(stream.duration * stream.time_base) if stream.duration and stream.time_base else 0.0
    if container.format.name.split(",")[0] in EXACT and read.duration_s < announced_s - SHORT_S:
        raise UserError(
            f"{path}: announces {announced_s:.3f} s of sound and contains {read.duration_s:.3f} s; copy it again"
        )
    return read


def _pieces(frames: Iterator[av.AudioFrame], path: Path, rate: int, n_channels: int) -> Iterator[Floats]:
    """Yield the samples of decoded frames, (n, C) each, full scale 1."""
    for frame in frames:
        if (frame.sample_rate, len(frame.layout.channels)) != (rate, n_channels):
            raise UserError(
                f"{path}: changes from {n_channels} channel(s) at {rate} Hz to {len(frame.layout.channels)} at "
                f"{frame.sample_rate} Hz at {frame.time or 0.0:.3f} s; convert it to wav"
            )
        values = frame.to_ndarray()
        channels = values.T if frame.format.is_planar else values.reshape(-1, n_channels)
        kind = channels.dtype.str[1:]
        samples = channels.astype(float)
        if kind == "u1":
            samples -= INTEGERS[kind]
        yield samples / INTEGERS.get(kind, 1.0)
