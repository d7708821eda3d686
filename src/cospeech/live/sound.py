"""Where sound comes from: samples on a pipe, a file in real time, or a microphone."""

from __future__ import annotations

import os
import queue
import select
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import audio, sound

ENCODINGS = {
    "u8": ("u1", 128.0),
    "s16le": ("<i2", 32768.0),
    "s16be": (">i2", 32768.0),
    "s32le": ("<i4", 2147483648.0),
    "s32be": (">i4", 2147483648.0),
    "f32le": ("<f4", 1.0),
    "f32be": (">f4", 1.0),
    "f64le": ("<f8", 1.0),
    "f64be": (">f8", 1.0),
}
"""Sample formats, with the names that FFmpeg gives them: the type of a sample, and the value of full scale."""

READ_BYTES = 65536
"""Largest number of bytes that are read at once: the size of a pipe."""

BLOCK_S = 0.01
"""Length of the blocks in which a file or a microphone delivers sound, in seconds."""

QUEUE_S = 10.0
"""Length of the sound that a microphone may be ahead of the engine, in seconds."""


class Source(Protocol):
    """A stream of mono sound.

    Attributes
    ----------
    rate_hz : sampling rate in Hz.
    in_real_time : whether its sound has to be delayed until it would have been spoken.
    n_lost : number of blocks that were dropped because they were not read in time.
    begun_s : time on the clock ``time.perf_counter`` at which its sound began; None if it begins when it is read.
    """

    rate_hz: int
    in_real_time: bool
    n_lost: int
    begun_s: float | None

    def read(self, wait_s: float) -> Floats | None:
        """Return the next samples (n,), full scale 1; none if none arrives within ``wait_s``, and None at the end."""

    def close(self) -> None:
        """Release the source."""


class Pcm(NamedTuple):
    """How samples on a pipe are to be read: sampling rate in Hz, format (see ``ENCODINGS``), number of channels."""

    rate_hz: int = sound.RATE_HZ
    encoding: str = "s16le"
    n_channels: int = 1


def parse_pcm(text: str) -> Pcm:
    """Return the format that ``RATE[:FORMAT[:CHANNELS]]`` describes, such as ``48000:f32le:2``.

    Raises
    ------
    UserError : if it is not such a description.
    """
    rate, *rest = text.split(":")
    encoding, channels = (*rest, *Pcm()[1 + len(rest) :])[:2] if len(rest) < 2 else rest[:2]
    low, high = sound.RATES_HZ
    if not (rate.isascii() and rate.isdecimal() and low <= int(rate) <= high):
        raise UserError(f"'{text}': '{rate}' is not a sampling rate from {low} to {high} Hz; write 16000:s16le")
    if encoding not in ENCODINGS:
        raise UserError(f"'{text}': unknown format '{encoding}'; known are {', '.join(ENCODINGS)}")
    n_channels = str(channels)
    if len(rest) > 2 or not (n_channels.isascii() and n_channels.isdecimal()):
        raise UserError(f"'{text}' is not RATE:FORMAT:CHANNELS; write 16000:s16le, or 48000:f32le:2 for two channels")
    if not 1 <= int(n_channels) <= sound.MOST_CHANNELS:
        raise UserError(f"'{text}': {n_channels} channels; from 1 to {sound.MOST_CHANNELS} can be read")
    return Pcm(int(rate), encoding, int(n_channels))


class Pipe:
    """Samples that another program writes to a pipe.

    Parameters
    ----------
    descriptor : file descriptor to read from.
    pcm : format of the samples.
    channel : the channel to take, counted from 1; None mixes all channels down to one.
    begun_s : see ``Source``. A program that records has been writing to the pipe since then.

    Raises
    ------
    UserError : if there is no such channel.
    """

    in_real_time = False
    n_lost = 0

    def __init__(self, descriptor: int, pcm: Pcm, channel: int | None = None, begun_s: float | None = None) -> None:
        if channel is not None and channel > pcm.n_channels:
            raise UserError(f"--channel {channel}: the sound has {pcm.n_channels} channel(s); name one of them")
        self.rate_hz, self.begun_s = pcm.rate_hz, begun_s
        self._descriptor, self._channel, self._n_channels = descriptor, channel, pcm.n_channels
        kind, self._full_scale = ENCODINGS[pcm.encoding]
        self._type: np.dtype[Any] = np.dtype(kind)
        self._rest = b""

    def read(self, wait_s: float) -> Floats | None:
        """Return the next samples; see ``Source``. A sample that is cut by the end of the stream is left out."""
        if not select.select([self._descriptor], [], [], wait_s)[0]:
            return np.empty(0)
        received = os.read(self._descriptor, READ_BYTES)
        if not received:
            return None
        data = self._rest + received
        whole = len(data) - len(data) % (self._type.itemsize * self._n_channels)
        self._rest = data[whole:]
        return self._mono(np.frombuffer(data[:whole], self._type))

    def _mono(self, values: npt.NDArray[Any]) -> Floats:
        with np.errstate(invalid="ignore"):  # some of the many bit patterns of NaN raise a warning
            samples = values.astype(float)
        if self._type.kind == "u":
            samples -= self._full_scale
        samples /= self._full_scale
        if self._n_channels == 1:
            return samples
        channels = samples.reshape(-1, self._n_channels)
        return np.asarray(channels.mean(axis=1) if self._channel is None else channels[:, self._channel - 1])

    def close(self) -> None:
        """Leave the pipe to whoever opened it."""


class File:
    """A sound file, or the sound of a video, as if it were spoken now. It has the samples of ``formats.audio``.

    Parameters
    ----------
    path : the file, in any format that FFmpeg decodes.
    channel : the channel to take, counted from 1; None mixes all channels down to one.

    Raises
    ------
    UserError : as ``formats.audio.read``.

    Attributes
    ----------
    notes : how the sound was converted.
    """

    rate_hz = sound.RATE_HZ
    in_real_time = True
    n_lost = 0
    begun_s: float | None = None

    def __init__(self, path: str | Path, channel: int | None = None) -> None:
        read = audio.read(path, channel)
        self.notes = read.notes
        self._samples = read.samples
        self._place = 0

    def read(self, wait_s: float) -> Floats | None:
        """Return the next block; see ``Source``."""
        block = self._samples[self._place : self._place + round(BLOCK_S * self.rate_hz)]
        self._place += len(block)
        return block if len(block) else None

    def close(self) -> None:
        """Forget the samples."""
        self._samples = np.empty(0)


class Microphone:
    """The microphone of this machine, by way of PortAudio.

    Parameters
    ----------
    device : number or name of the device; None is the default one.

    Raises
    ------
    UserError : if the package sounddevice is not installed, or there is no such device.
    """

    rate_hz = sound.RATE_HZ
    in_real_time = False
    begun_s: float | None = None

    def __init__(self, device: str | None = None) -> None:
        try:
            import sounddevice
        except (ImportError, OSError) as error:  # OSError: the PortAudio library is missing
            raise UserError(
                f"the microphone needs the package sounddevice and PortAudio ({error}); "
                "pip install 'cospeech[microphone]', or pipe the sound to --pcm"
            ) from error
        self.n_lost = 0
        self._started = False
        self._blocks: queue.Queue[Floats] = queue.Queue(round(QUEUE_S / BLOCK_S))
        try:
            self._stream = sounddevice.InputStream(
                samplerate=self.rate_hz,
                blocksize=round(BLOCK_S * self.rate_hz),
                device=int(device) if device is not None and device.isdecimal() else device,
                channels=1,
                dtype="float32",
                callback=self._take,
            )
        except (sounddevice.PortAudioError, ValueError) as error:
            reason = " ".join(str(error).split())
            raise UserError(
                f"microphone: cannot be opened ({reason}); 'python -m sounddevice' lists the devices"
            ) from error

    def _take(self, block: npt.NDArray[np.float32], n_frames: int, times: Any, status: Any) -> None:
        """Queue a block (n, 1); called by PortAudio."""
        try:
            self._blocks.put_nowait(block[:, 0].astype(float))
        except queue.Full:
            self.n_lost += 1

    def read(self, wait_s: float) -> Floats | None:
        """Return the next block; see ``Source``. The first call starts to listen."""
        if not self._started:
            self._stream.start()
            self._started = True
        try:
            return self._blocks.get(timeout=wait_s)
        except queue.Empty:
            return np.empty(0)

    def close(self) -> None:
        """Close the device."""
        self._stream.close()
