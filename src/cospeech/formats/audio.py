"""Speech in any format that FFmpeg decodes (wav, flac, mp3, m4a, ogg, the sound of a video) as mono sound at 16 kHz.

The samples are rounded to 16 bits as in the wav files of a corpus, so that a sound file gives the same samples here
and as the sound of a record. It is decoded, mixed down and resampled piece by piece, so that hours fit into memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import soxr

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.sound import FULL_SCALE, RATE_HZ, RATES_HZ, SILENT, Sound, to_16_bit

INTEGERS = {"u1": 128.0, "i2": 32768.0, "i4": 2147483648.0}
"""Value of full scale by the type of the decoded samples; floating-point samples have 1."""

LOCAL = {"protocol_whitelist": "file"}
"""Options of FFmpeg: a playlist must not make it fetch anything. ``file:`` allows for colons in names."""

PIECE = 65536
"""Number of samples that are resampled at once, at least: frames are short, and each call costs."""


def read(path: str | Path, channel: int | None = None) -> Sound:
    """Read the first audio stream of a file.

    Parameters
    ----------
    path : a sound file, or a video with sound.
    channel : the channel to take, counted from 1; None mixes all channels down to one.

    Raises
    ------
    UserError : if the file is missing, empty or silent, contains no sound that can be decoded, contains NaN, or has
        no such channel.
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
        notes.append(
            f"{n_channels} channels mixed down to one" if channel is None else f"only channel {channel} used"
        )
    pieces = _mono(container, stream, path, channel)
    if rate != RATE_HZ:
        lost = f" (nothing above {rate // 2} Hz)" if rate < RATE_HZ else ""
        notes.append(f"resampled from {rate} Hz to {RATE_HZ} Hz{lost}")
        pieces = _resampled(pieces, rate)
    n_clipped, rounded = 0, []
    for piece in pieces:
        n_clipped += int((np.abs(piece) > 1).sum())
        rounded.append(to_16_bit(piece))
    if not any(map(len, rounded)):
        raise UserError(f"{path}: contains no sound; copy it again")
    samples = np.concatenate(rounded) / FULL_SCALE
    if max(samples.max(), -samples.min()) <= SILENT:
        raise UserError(f"{path}: is silent; check the recording")
    if n_clipped:
        notes.append(f"{n_clipped} samples clipped at full scale")
    return Sound(samples, float(rate), notes)


def _mono(
    container: av.container.InputContainer, stream: av.AudioStream, path: Path, channel: int | None
) -> Iterator[Floats]:
    """Yield the samples of a stream in pieces, (n,) each, full scale 1."""
    waiting: list[Floats] = []
    n_waiting = 0
    for frame in container.decode(stream):
        values = frame.to_ndarray()
        n_channels = len(frame.layout.channels)
        planes = values if frame.format.is_planar else values.reshape(-1, n_channels).T
        if channel is not None and channel > n_channels:
            raise UserError(f"{path}: has only {n_channels} channel(s) from {frame.time:.3f} s on; convert it to wav")
        kind = planes.dtype.str[1:]
        samples = planes.astype(float)
        if kind == "u1":
            samples -= INTEGERS[kind]
        samples /= INTEGERS.get(kind, 1.0)
        mono = samples.mean(axis=0) if channel is None else samples[channel - 1]
        if not np.isfinite(mono).all():
            at = (frame.time or 0.0) + int(np.flatnonzero(~np.isfinite(mono))[0]) / frame.sample_rate
            raise UserError(f"{path}: contains NaN or infinity at {at:.3f} s; export it again")
        waiting.append(mono)
        n_waiting += len(mono)
        if n_waiting >= PIECE:
            yield np.concatenate(waiting)
            waiting, n_waiting = [], 0
    if waiting:
        yield np.concatenate(waiting)


def _resampled(pieces: Iterator[Floats], rate: int) -> Iterator[Floats]:
    """Yield the pieces at ``RATE_HZ``, with the same samples as if they were resampled in one piece."""
    resampler = soxr.ResampleStream(rate, RATE_HZ, 1, dtype="float64", quality="VHQ")
    for piece in pieces:
        yield resampler.resample_chunk(piece)
    yield resampler.resample_chunk(np.empty(0), last=True)
