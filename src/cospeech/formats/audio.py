"""Speech of any format that PyAV decodes (wav, flac, mp3, m4a, ogg, the sound of a video) as mono sound at 16 kHz.

The sound is decoded, mixed down and resampled piece by piece, so that hours of it fit into memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import soxr

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.sound import RATE_HZ, RATES_HZ, SILENT, Sound

FULL_SCALE = {"u1": 128.0, "i2": 32768.0, "i4": 2147483648.0}
"""Value of full scale by the kind of sample; floating samples have 1."""


def read(path: str | Path, channel: int | None = None) -> Sound:
    """Read the first audio stream of a file.

    Parameters
    ----------
    channel : the channel to take, counted from 1; None mixes all channels down to one.

    Raises
    ------
    UserError : where the file is missing, empty, silent, holds no sound that can be decoded, holds NaN, or has no
        such channel.
    """
    path = Path(path)
    if not path.exists():
        raise UserError(f"{path}: no such file; correct the path")
    if path.is_dir():
        raise UserError(f"{path}: is a folder; name a sound file")
    if path.stat().st_size == 0:
        raise UserError(f"{path}: is empty; copy it again")
    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                raise UserError(f"{path}: contains no sound; name a file with speech")
            return _read_stream(container, path, channel)
    except (av.FFmpegError, OSError, ValueError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:80]
        raise UserError(f"{path}: cannot be decoded as sound ({reason}); convert it to wav") from error


def _read_stream(container: av.container.InputContainer, path: Path, channel: int | None) -> Sound:
    stream = container.streams.audio[0]
    rate, n_channels = stream.codec_context.sample_rate, stream.codec_context.channels
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise UserError(f"{path}: has a sampling rate of {rate} Hz, which no recording of speech has; check the file")
    if channel is not None and not 1 <= channel <= n_channels:
        raise UserError(f"{path}: has {n_channels} channel(s), so there is no channel {channel}")
    notes = []
    if n_channels > 1:
        notes.append(f"{n_channels} channels mixed down to one" if channel is None else f"channel {channel} taken")
    pieces = _mono(container, stream, path, channel)
    if rate != RATE_HZ:
        lost = f" (nothing above {rate // 2} Hz)" if rate < RATE_HZ else ""
        notes.append(f"resampled from {rate} Hz to {RATE_HZ} Hz{lost}")
        pieces = _resampled(pieces, rate)
    parts = list(pieces)
    samples = np.concatenate(parts) if parts else np.empty(0)
    if len(samples) == 0:
        raise UserError(f"{path}: contains no sound; copy it again")
    if np.abs(samples).max() <= SILENT:
        raise UserError(f"{path}: is silent; check the recording")
    over = int((np.abs(samples) > 1).sum())
    if over:
        notes.append(f"{over} samples clipped at full scale")
        samples = np.clip(samples, -1.0, 1.0)
    return Sound(samples, float(rate), notes)


def _mono(
    container: av.container.InputContainer, stream: av.AudioStream, path: Path, channel: int | None
) -> Iterator[Floats]:
    """Yield the decoded frames of a stream, (n,) each, full scale 1."""
    n_channels = stream.codec_context.channels
    for frame in container.decode(stream):
        values = frame.to_ndarray()
        planes = values if frame.format.is_planar else values.reshape(-1, n_channels).T
        kind = planes.dtype.str[1:]
        samples = planes.astype(float)
        if kind == "u1":
            samples -= 128.0
        samples /= FULL_SCALE.get(kind, 1.0)
        mono = samples.mean(axis=0) if channel is None else samples[channel - 1]
        if not np.isfinite(mono).all():
            raise UserError(f"{path}: holds NaN or infinite samples at {frame.time or 0.0:.3f} s; export it again")
        yield mono


def _resampled(pieces: Iterator[Floats], rate: int) -> Iterator[Floats]:
    resampler = soxr.ResampleStream(rate, RATE_HZ, 1, dtype="float64", quality="VHQ")
    for piece in pieces:
        yield resampler.resample_chunk(piece)
    yield resampler.resample_chunk(np.empty(0), last=True)
