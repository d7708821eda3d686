"""Wav files: sound of any rate and number of channels is read as mono at 16 kHz, excerpts without the rest."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import soundfile
import soxr

from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError

RATE_HZ = 16000
"""Sampling rate of all sound inside the project."""

RATES_HZ = (4000, 768000)
"""Range of the sampling rates of recorded speech."""

FULL_SCALE = 32768.0
"""Value of full scale in 16 bits."""

SILENT = 2 / FULL_SCALE
"""Peak, relative to full scale, up to which a sound may be rounding noise of 16 bits."""

WAV = ("WAV", "WAVEX", "RF64")


class Sound(NamedTuple):
    """Mono sound at ``RATE_HZ``, the original rate, and notes on how it was converted."""

    samples: Floats
    delivered_hz: float
    notes: list[str]

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return len(self.samples) / RATE_HZ


def read(path: str | Path, start_s: float = 0.0, end_s: float | None = None) -> Sound:
    """Read a wav file, or its excerpt from ``start_s`` to ``end_s``, as mono at ``RATE_HZ``.

    Raises
    ------
    UserError : if the file is missing, empty, truncated, silent or not a wav file, if it contains NaN, or if the
        excerpt is not in it.
    """
    _check_whole(Path(path))
    try:
        with soundfile.SoundFile(path) as file:
            if file.format not in WAV:
                raise UserError(f"{path}: holds {file.format}, not wav; convert it to wav")
            rate, length = file.samplerate, file.frames
            if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
                raise UserError(f"{path}: {rate} Hz is not a sampling rate of recorded speech; check the file")
            first, last = _excerpt(path, start_s, end_s, rate, length)
            file.seek(first)
            channels = file.read(last - first, dtype="float64", always_2d=True)
    except (soundfile.SoundFileError, OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:100]
        raise UserError(f"{path}: cannot be read as wav ({reason}); copy or convert it again") from error
    if len(channels) < last - first:
        raise UserError(f"{path}: ends after {(first + len(channels)) / rate:.3f} s; it is truncated: copy it again")
    if not np.isfinite(channels).all():
        at = (first + int(np.flatnonzero(~np.isfinite(channels).all(axis=1))[0])) / rate
        raise UserError(f"{path}: holds NaN at {at:.3f} s; export it again")
    return _as_ours(channels, rate, path)


def _check_whole(path: Path) -> None:
    """Raise UserError unless the file is RIFF wav and as long as its header says, which libsndfile ignores."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(12)
            if size == 0:
                raise UserError(f"{path}: is empty; copy it again")
            if head[:4] not in (b"RIFF", b"RF64") or head[8:12] != b"WAVE":
                raise UserError(f"{path}: is not a wav file, despite its name; convert it to wav")
            while len(chunk := file.read(8)) == 8:
                name, length = struct.unpack("<4sI", chunk)
                held = size - file.tell()
                if name == b"data":
                    if length != 0xFFFFFFFF and length > held:
                        raise UserError(f"{path}: announces {length} bytes of sound and holds {held}; copy it again")
                    return
                file.seek(length + length % 2, 1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    raise UserError(f"{path}: holds no sound; it is truncated: copy it again")


def _excerpt(path: str | Path, start_s: float, end_s: float | None, rate: int, length: int) -> tuple[int, int]:
    first = round(start_s * rate)
    last = length if end_s is None else round(end_s * rate)
    if length == 0:
        raise UserError(f"{path}: holds no sound; name another file, or leave the record out")
    if last > length or first >= last:
        raise UserError(
            f"{path}: lasts {length / rate:.3f} s, and has no excerpt from {start_s} s to {end_s or 'its end'}; "
            "correct start_s and end_s"
        )
    return first, last


def _as_ours(channels: Floats, rate: int, path: str | Path) -> Sound:
    notes = []
    samples = channels.mean(axis=1)
    if channels.shape[1] > 1:
        notes.append(f"{channels.shape[1]} channels mixed down to one")
    if np.abs(samples).max() <= SILENT:
        raise UserError(f"{path}: is silent in this record; check the recording, or leave the record out")
    if rate != RATE_HZ:
        samples = soxr.resample(samples, rate, RATE_HZ, quality="VHQ")
        lost = f" (nothing above {rate // 2} Hz)" if rate < RATE_HZ else ""
        notes.append(f"resampled from {rate} Hz to {RATE_HZ} Hz{lost}")
    over = int((np.abs(samples) > 1).sum())
    if over:
        notes.append(f"{over} samples clipped at full scale")
        samples = np.clip(samples, -1.0, 1.0)
    return Sound(samples, float(rate), notes)


def to_16_bit(samples: Floats) -> npt.NDArray[np.int16]:
    """Return samples rounded to 16 bits; those of a 16-bit file are returned unchanged."""
    return np.clip(np.round(samples * FULL_SCALE), -FULL_SCALE, FULL_SCALE - 1).astype(np.int16)


def write(samples: Floats, path: str | Path) -> None:
    """Write mono sound at ``RATE_HZ`` as a 16-bit wav file; a floating-point one would contain the date."""
    encoded = io.BytesIO()  # libsndfile does not say why writing failed, such as a full disk
    # Rounded here, because libsndfile writes full scale as 32767 and reads it as 32768.
    soundfile.write(encoded, to_16_bit(samples), RATE_HZ, subtype="PCM_16", format="WAV")
    with tables.replacing(path) as temporary:
        temporary.write_bytes(encoded.getbuffer())
