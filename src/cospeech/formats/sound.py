"""Speech as mono sound at 16 kHz, and its wav files; an excerpt is read without the rest of the file.

Samples from any source pass through ``mixed``, which takes one channel or mixes all of them down, resamples piece by
piece, and rounds to 16 bits as in the wav files of a corpus. A sound file therefore gives the same samples as the
sound of a record.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
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

LONGEST_S = 4 * 3600
"""Longest sound that is read, in seconds: in memory it takes 2 GB, and 3 GB while it is read."""

MOST_CHANNELS = 64
"""Largest number of channels that is read; a damaged header may announce 65,535."""

FULL_SCALE = 32768.0
"""Value of full scale in 16 bits."""

SILENT = 2 / FULL_SCALE
"""Peak, relative to full scale, up to which a sound may be rounding noise of 16 bits."""

LOUDEST = 16.0
"""Peak, relative to full scale, above which floating-point samples have another full scale, such as 32768."""

FEW_CLIPPED = 10
"""Number of samples at full scale that a recording normalised to its peak may have."""

OFFSET = 0.005
"""Constant offset, relative to full scale, from which on it is noted."""

LEVEL_S = 0.1
"""Period over which the levels of channels are compared, about half a syllable."""

SPEECH_DB = 10.0
"""Least difference between the loud and the soft moments of speech, in decibels."""

ACTIVE_DB = 20.0
"""How far below its loud moments a channel may be and still be active, in decibels."""

INAUDIBLE_DB = 30.0
"""How far below the loudest channel a channel is too soft to matter, in decibels."""

DIFFERENT_DB = 8.0
"""Standard deviation of the difference in level, in decibels, above which two channels hold different speech.

Measured on studio and LibriVox speech: at most 6.3 for two microphones in front of one speaker, at different
distances in a room, with noise, or with different frequency responses; at least 8.9 for two speakers who talk at the
same time, and 11 for two who take turns with 12 dB of crosstalk.
"""

PIECE = 65536
"""Number of samples per channel that are processed at once, at least: each call costs."""

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


def read(
    path: str | Path,
    start_s: float = 0.0,
    end_s: float | None = None,
    channel: int | None = None,
    mix_different: bool = False,
) -> Sound:
    """Read a wav file, or its excerpt from ``start_s`` to ``end_s``, as mono at ``RATE_HZ``.

    Parameters
    ----------
    path : a wav file of any sample format, rate and number of channels.
    start_s, end_s : excerpt, in seconds; by default the whole file.
    channel : the channel to take, counted from 1; None mixes all channels down to one.
    mix_different : whether channels with different speech are mixed down, with a note, or refused.

    Raises
    ------
    UserError : if the file is missing, empty, truncated, too long, silent or not a wav file, if it contains NaN, if
        the excerpt or the channel is not in it, or if its channels cannot be mixed down and none is chosen.
    """
    check_whole(Path(path))
    try:
        with soundfile.SoundFile(path) as file:
            if file.format not in WAV:
                raise UserError(f"{path}: contains {file.format}, not wav; convert it to wav")
            rate = file.samplerate
            first, last = _excerpt(path, start_s, end_s, rate, file.frames)
            file.seek(first)
            return mixed(
                path, _pieces(file, path, first, last), rate, file.channels, channel, first / rate, mix_different
            )
    except (soundfile.SoundFileError, OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:100]
        raise UserError(f"{path}: cannot be read as wav ({reason}); copy or convert it again") from error


def check_whole(path: Path) -> None:
    """Raise UserError unless the file is RIFF wav and as long as its header says, which decoders ignore."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(12)
            if size == 0:
                raise UserError(f"{path}: is empty; copy it again")
            if head[:4] not in (b"RIFF", b"RIFX", b"RF64") or head[8:12] != b"WAVE":
                raise UserError(f"{path}: is not a wav file, despite its name; convert it to wav")
            order = ">" if head[:4] == b"RIFX" else "<"
            long_length = None
            while len(chunk := file.read(8)) == 8:
                name, length = struct.unpack(f"{order}4sI", chunk)
                held = size - file.tell()
                if name == b"ds64" and length >= 24 and len(sizes := file.read(24)) == 24:
                    long_length = int(struct.unpack("<8xQ8x", sizes)[0])
                    length -= len(sizes)
                if name == b"data":
                    if length == 0xFFFFFFFF:  # RF64, or written to a pipe
                        length = held if long_length is None else long_length
                    if length == 0 < held:
                        raise UserError(
                            f"{path}: announces no sound and holds {held} bytes, since its recording was "
                            "interrupted; repair it with an audio editor"
                        )
                    if length > held:
                        raise UserError(f"{path}: announces {length} bytes of sound and holds {held}; copy it again")
                    return
                file.seek(length + length % 2, 1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    raise UserError(f"{path}: contains no sound, since it is truncated; copy it again")


def _excerpt(path: str | Path, start_s: float, end_s: float | None, rate: int, length: int) -> tuple[int, int]:
    first = round(start_s * rate)
    last = length if end_s is None else round(end_s * rate)
    if length == 0:
        raise UserError(f"{path}: contains no sound; name another file")
    if last > length or first >= last:
        raise UserError(
            f"{path}: lasts {length / rate:.3f} s, and has no excerpt from {start_s} s to {end_s or 'its end'}; "
            "correct start_s and end_s"
        )
    return first, last


def _pieces(file: soundfile.SoundFile, path: str | Path, first: int, last: int) -> Iterator[Floats]:
    """Yield the samples [first, last) of a file in pieces, (n, C) each."""
    place = first
    while place < last:
        piece = file.read(min(PIECE, last - place), dtype="float64", always_2d=True)
        if not len(piece):
            raise UserError(f"{path}: ends after {place / file.samplerate:.3f} s; it is truncated: copy it again")
        yield piece
        place += len(piece)


def mixed(
    path: str | Path,
    pieces: Iterator[Floats],
    rate: int,
    n_channels: int,
    channel: int | None = None,
    start_s: float = 0.0,
    mix_different: bool = False,
) -> Sound:
    """Mix channels down to one, or take one of them, and resample it to ``RATE_HZ``.

    Parameters
    ----------
    path : of the file, for messages.
    pieces : the samples in succession, (n, C) each, full scale 1.
    rate : sampling rate in Hz.
    n_channels : number of channels C.
    channel : the channel to take, counted from 1; None mixes all channels down to one.
    start_s : time of the first sample in the file, for messages.
    mix_different : as in ``read``.

    Raises
    ------
    UserError : if there is no such channel, if the sound is empty, silent or too long, if it contains NaN, or if the
        channels cannot be mixed down and none is chosen.
    """
    _check_header(path, rate, n_channels, channel)
    resampler = soxr.ResampleStream(rate, RATE_HZ, 1, dtype="float64", quality="VHQ") if rate != RATE_HZ else None
    hop = round(LEVEL_S * rate)
    lowest, highest, total, length, n_clipped, n_over = np.inf, -np.inf, 0.0, 0, 0, 0
    powers, mono_powers, rounded = [], [], [np.empty(0, dtype=np.int16)]
    for piece in _regular(pieces, hop * -(-PIECE // hop)):
        used = piece if channel is None else piece[:, channel - 1 : channel]
        if not np.isfinite(used).all():
            at = start_s + (length + int(np.flatnonzero(~np.isfinite(used).all(axis=1))[0])) / rate
            raise UserError(f"{path}: contains NaN or infinity at {at:.3f} s; export it again")
        length += len(used)
        if length > LONGEST_S * rate:
            raise UserError(f"{path}: lasts more than {LONGEST_S / 3600:g} hours; cut it into shorter files")
        if np.abs(used).max() > LOUDEST:
            raise UserError(f"{path}: its samples exceed {LOUDEST:g} times full scale; export it with full scale 1")
        mono = used.mean(axis=1)
        lowest, highest, total = min(lowest, mono.min()), max(highest, mono.max()), total + float(mono.sum())
        n_clipped += int(((np.abs(used) >= 1 - 1 / FULL_SCALE) & (np.abs(used) <= 1)).sum())
        if used.shape[1] > 1:
            powers.append(_powers(used, hop))
            mono_powers.append(_powers(mono[:, None], hop))
        resampled = mono if resampler is None else resampler.resample_chunk(mono)
        n_over += int((np.abs(resampled) > 1).sum())
        rounded.append(to_16_bit(resampled))
    if resampler is not None:
        rounded.append(to_16_bit(resampler.resample_chunk(np.empty(0), last=True)))
    if not any(map(len, rounded)):
        raise UserError(f"{path}: contains no sound; copy it again")
    different = _difference(path, np.concatenate(powers), np.concatenate(mono_powers)[:, 0]) if powers else None
    if different and not mix_different:
        raise UserError(f"{path}: its {different}; {_choose(n_channels)}")
    if highest - lowest <= 2 * SILENT:
        raise UserError(f"{path}: is silent; check the recording")
    notes = []
    if n_channels > 1:
        although = f", although {different}: set the channel of the record" if different else ""
        mixed_down = f"{n_channels} channels mixed down to one{although}"
        notes.append(mixed_down if channel is None else f"only channel {channel} used")
    if rate != RATE_HZ:
        lost = f" (nothing above {rate // 2} Hz)" if rate < RATE_HZ else ""
        notes.append(f"resampled from {rate} Hz to {RATE_HZ} Hz{lost}")
    if abs(total / length) >= OFFSET:
        notes.append(f"constant offset of {100 * total / length:.1f} % of full scale, which the features ignore")
    if n_clipped > FEW_CLIPPED:
        notes.append(f"{n_clipped} samples at full scale: recorded too loud")
    if n_over:
        notes.append(f"{n_over} samples clipped at full scale")
    samples = np.concatenate(rounded)
    return Sound(samples / FULL_SCALE, float(rate), notes)


def _check_header(path: str | Path, rate: int, n_channels: int, channel: int | None) -> None:
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise UserError(f"{path}: {rate} Hz is not a sampling rate of recorded speech; check the file")
    if not 1 <= n_channels <= MOST_CHANNELS:
        raise UserError(f"{path}: has {n_channels} channels; at most {MOST_CHANNELS} can be read: check the file")
    if channel is not None and not 1 <= channel <= n_channels:
        raise UserError(f"{path}: has {n_channels} channel(s), so there is no channel {channel}")


def _regular(pieces: Iterator[Floats], size: int) -> Iterator[Floats]:
    """Yield the samples of the pieces, (n, C) each, in pieces of ``size`` and a shorter last one."""
    waiting: list[Floats] = []
    n_waiting = 0
    for piece in pieces:
        waiting.append(piece)
        n_waiting += len(piece)
        if n_waiting >= size:
            joined = np.concatenate(waiting)
            whole = n_waiting // size * size
            yield from np.split(joined[:whole], whole // size)
            waiting, n_waiting = [joined[whole:]], n_waiting - whole
    if n_waiting:
        yield np.concatenate(waiting)


def _powers(samples: Floats, hop: int) -> Floats:
    """Return the power of each channel without its mean, per ``hop`` samples of (n, C); a rest is left out."""
    whole = len(samples) // hop
    return samples[: whole * hop].reshape(whole, hop, -1).var(axis=1)


def _choose(n_channels: int) -> str:
    return f"choose one of 1 to {n_channels} (channel: of the record, or --channel)"


def _difference(path: str | Path, powers: Floats, mixed_powers: Floats) -> str | None:
    """Return which channels contain different speech, or speech and noise; None if they belong to one recording.

    Parameters
    ----------
    powers, mixed_powers : power of each channel (K, C), and of the mean of all channels (K,), per ``LEVEL_S``.

    Raises
    ------
    UserError : if the channels have opposite phase, so that nothing is left of them when they are mixed down.
    """
    n_channels = powers.shape[1]
    if not len(powers):
        return None
    if mixed_powers.sum() < 0.5 * powers.sum(axis=0).max() / n_channels**2:
        raise UserError(f"{path}: its channels cancel each other, since one is inverted; {_choose(n_channels)}")
    levels = 10.0 * np.log10(np.maximum(powers, SILENT**2))
    loud = np.percentile(levels, 95, axis=0)
    spread = loud - np.percentile(levels, 10, axis=0)
    audible = loud > loud.max() - INAUDIBLE_DB
    speaks = np.flatnonzero(audible & (spread >= SPEECH_DB))
    if not len(speaks):
        return None
    first = speaks[np.argmax(loud[speaks])]
    relative = np.maximum(levels - loud, -INAUDIBLE_DB)
    for other in np.flatnonzero(audible):
        active = np.maximum(relative[:, first], relative[:, other]) > -ACTIVE_DB
        if (relative[active, first] - relative[active, other]).std() > DIFFERENT_DB:
            held = "different speech" if other in speaks else "speech and a constant noise"
            one, two = sorted((first + 1, other + 1))
            return f"channels {one} and {two} contain {held}"
    return None


def to_16_bit(samples: Floats) -> npt.NDArray[np.int16]:
    """Return samples rounded to 16 bits; those of a 16-bit file are returned unchanged."""
    rounded = np.empty(len(samples), dtype=np.int16)
    for place in range(0, len(samples), PIECE):  # temporary arrays as long as hours of sound would take gigabytes
        piece = np.round(samples[place : place + PIECE] * FULL_SCALE)
        rounded[place : place + PIECE] = np.clip(piece, -FULL_SCALE, FULL_SCALE - 1)
    return rounded


def write(samples: Floats, path: str | Path) -> None:
    """Write mono sound at ``RATE_HZ`` as a 16-bit wav file; a floating-point one would contain the date."""
    encoded = io.BytesIO()  # libsndfile does not say why writing failed, such as a full disk
    # Rounded here, because libsndfile writes full scale as 32767 and reads it as 32768.
    soundfile.write(encoded, to_16_bit(samples), RATE_HZ, subtype="PCM_16", format="WAV")
    with tables.replacing(path) as temporary:
        temporary.write_bytes(encoded.getbuffer())
