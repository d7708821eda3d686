"""Syllables of speech from its intensity and pitch, in a stream or a recording (Levine 2009, 3.2-3.4; 2010, 6.1).

A syllable is a peak of the intensity between two troughs. There are also boundaries where speech becomes voiced or
unvoiced and where it falls silent. The table therefore contains voiced syllables, the consonants between them, which
have no pitch, and gaps where there is silence. There is one implementation: a recording is a stream that is pushed
and finished. The chunks in which samples arrive do not change the result.

Details that the papers leave open are implemented as follows:

- The papers report a syllable when the next peak is found. Here, it is reported as soon as the intensity has risen
  from the trough by the dip that makes it a boundary and the next peak can no longer be too close.
- A trough is a boundary if it lies 0.5 dB below the peaks on both sides, and these are at least 75 ms apart. Of two
  closer peaks, the higher one counts.
- The Gaussian window of the intensity has a standard deviation of 12 ms and ends 27.5 ms after its centre. This is
  one fixed part of the delay. The other is that a stretch of speech has ended when none of three frames (of 5 ms) is
  of its kind: voiced, unvoiced or silent.
- A stretch of less than 40 ms between changes of voicing joins the next one, or is ignored before silence. A syllable
  of more than a second is cut.
- Pitch and voicing are found by Praat's autocorrelation method (Boersma 1993) with its default costs, from 60 to
  500 Hz in sound decimated to 4 kHz. The path through the candidates looks ahead by two frames instead of to the end
  of the recording. The pitch of a syllable is that of its longest stretch without a jump. ``pitch`` contains Praat's
  own track.
- Silence is relative to the levels of noise and of loud speech, which are tracked (see ``syllables_kernels``).

Window, dip and distance are within the ranges that earlier trials on the five LibriVox sentences recommended. The
shortest length and the cutoff frequency of the pitch were chosen after looking at these sentences, so their F1 is
slightly optimistic. Nothing was tuned on the studio's voices. Measured, with voiced syllables as detections of vowels
that are right within 50 ms (``bench/syllables.py``):

- LibriVox: F1 0.89 (0.86 within 20 ms); from the peak of a syllable until it is known, 137 ms in the median and
  203 ms at the 90th percentile. If unvoiced syllables counted as detections, F1 would be 0.74.
- Eight voices of the studio's synthesiser: F1 0.92 to 0.97; 123 to 142 ms in the median.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.speech import syllables_kernels as kernels

UNVOICED_HZ = kernels.PITCH_HZ
"""Range over which the pitch of an unvoiced syllable is uniformly distributed, in hertz."""

PIECE = 256 * kernels.HOP
"""Number of samples analysed at once."""


class Syllable(NamedTuple):
    """A syllable; times in seconds from the start of the stream.

    Attributes
    ----------
    start_s, peak_s, end_s : its start, the peak of its intensity, and its end.
    known_s : when it is reported to a live listener: the duration of the sound heard until then. If only the end of
        the sound reveals the syllable, it is known a hop (5 ms) after it.
    f0_hz : mean pitch, NaN if unvoiced.
    f0_rise_hz, f0_fall_hz : largest rise and largest fall of the pitch within it, NaN if unvoiced.
    intensity_db : mean power, relative to full scale.
    """

    start_s: float
    peak_s: float
    end_s: float
    known_s: float
    f0_hz: float
    f0_rise_hz: float
    f0_fall_hz: float
    intensity_db: float


class Stream:
    """Finds the syllables of sound that arrives in chunks, in constant memory.

    Parameters
    ----------
    rate_hz : sampling rate of the sound, which must be 16 kHz.

    Raises
    ------
    UserError : if the sampling rate is another one.
    """

    def __init__(self, rate_hz: float) -> None:
        if rate_hz != kernels.RATE_HZ:
            raise UserError(f"syllables: the sound has {rate_hz:g} Hz; resample it to {kernels.RATE_HZ} Hz")
        self._memory = kernels.memory()
        self._rows = np.zeros(PIECE // kernels.HOP + 1, kernels.ROW)
        self._n_samples = 0

    def push(self, samples: npt.NDArray[np.floating]) -> list[Syllable]:
        """Continue the stream, and return the syllables that have become known.

        Parameters
        ----------
        samples : (n,) the next samples, full scale 1. Louder samples are clipped; those that are not finite count as
            zero.

        Raises
        ------
        UserError : if the samples are integers, or have several channels.
        """
        if samples.ndim != 1 or samples.dtype.kind != "f":
            raise UserError(
                f"syllables: samples of type {samples.dtype} and shape {samples.shape}; one channel of "
                "floating-point samples with full scale 1 is needed"
            )
        self._n_samples += len(samples)
        found: list[Syllable] = []
        for first in range(0, len(samples), PIECE):
            piece = np.ascontiguousarray(samples[first : first + PIECE], dtype=np.float64)
            found += self._read(kernels.push(piece, self._memory, self._rows), None)
        return found

    def finish(self) -> list[Syllable]:
        """End the stream, and return its remaining syllables. No samples may follow."""
        n_frames = -(-self._n_samples // kernels.HOP)
        duration_s = self._n_samples / kernels.RATE_HZ
        n_ahead = (n_frames + kernels.AHEAD + kernels.LASTING - 1) * kernels.HOP - self._n_samples
        found = self._read(kernels.push(np.zeros(n_ahead), self._memory, self._rows), duration_s)
        return found + self._read(kernels.close(self._memory, n_frames, self._rows), duration_s)

    def _read(self, n_rows: int, end_s: float | None) -> list[Syllable]:
        return [_syllable(row, end_s) for row in self._rows[:n_rows].tolist()]


def _syllable(row: tuple[Any, ...], end_s: float | None) -> Syllable:
    """Return the syllable of a row of the kernels, or, if ``end_s`` is given, of one in a stream that ends there."""
    first, peak, after, known, f0_hz, rise_hz, fall_hz, power = row
    after_s, known_s = after * kernels.HOP_S, known * kernels.HOP_S
    if end_s is not None:
        after_s, known_s = min(after_s, end_s), end_s + kernels.HOP_S
    peak_s = min((peak + 0.5) * kernels.HOP_S, after_s)
    return Syllable(
        first * kernels.HOP_S, peak_s, after_s, known_s, f0_hz, rise_hz, fall_hz, 10.0 * math.log10(power)
    )


def find(samples: Floats, rate_hz: float) -> list[Syllable]:
    """Return the syllables of a whole recording (n,); see ``Stream``."""
    stream = Stream(rate_hz)
    return stream.push(samples) + stream.finish()


def table(record: str, found: list[Syllable]) -> pd.DataFrame:
    """Return the syllables of a record as a table (schema ``syllables``)."""
    columns = pd.DataFrame(found, columns=Syllable._fields).astype(float)
    columns.insert(0, "record", record)
    columns.insert(1, "syllable", np.arange(len(found)))
    return columns


def unvoiced_density(mean_hz: npt.ArrayLike, deviation_hz: npt.ArrayLike) -> Floats:
    """Return the expected normal density at the pitch of an unvoiced syllable.

    The pitch is a random variable that is uniform over ``UNVOICED_HZ`` (Levine 2010, 6.1), and a model integrates it
    out: this is the integral of the normal density over the range, divided by the width of the range.

    Parameters
    ----------
    mean_hz, deviation_hz : mean and standard deviation of the normal distribution, of any one shape.
    """
    low, high = ((np.subtract(edge, mean_hz) / deviation_hz) for edge in UNVOICED_HZ)
    return np.asarray((special.ndtr(high) - special.ndtr(low)) / (UNVOICED_HZ[1] - UNVOICED_HZ[0]))
