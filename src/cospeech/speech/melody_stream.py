"""The melody of sound that arrives in chunks, frame by frame (see ``melody`` for that of a recording).

Intensity, utterances, the interpolation of unvoiced gaps, smoothing and slopes are those of a recording. Two things
cannot be known before the end of a recording and differ:

- Pitch is tracked by the method that finds it in syllables, which looks ahead by two frames of 5 ms instead of to the
  end. The range of the speaker is relative to the mean so far; in the first second of voice it is 60 to 500 Hz.
- Mean and standard deviation are those of the utterances so far. What was heard is forgotten with a time constant of
  a minute of speech, so that the melody adapts to voice and microphone.

In five LibriVox sentences, one after another, the pitch correlates by 0.89 with that of the recording, and the
intensity by 0.95.

A frame becomes known 375 ms after its end: it takes up to 290 ms to decide whether it belongs to an utterance, 50 ms
for smoothing and slope, and 35 ms for the pitch.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.speech import melody_kernels as kernels
from cospeech.speech import syllables_kernels

PIECE = 256 * kernels.STEP
"""Number of samples analysed at once."""

N_COLUMNS = 3


class Stream:
    """Measures the melody of sound that arrives in chunks, in constant memory. The chunks do not change the result.

    Parameters
    ----------
    rate_hz : sampling rate of the sound, which must be 16 kHz.
    record, seed : name of the stream and seed of the run, of the noise between utterances.

    Raises
    ------
    UserError : if the sampling rate is another one.
    """

    def __init__(self, rate_hz: float, record: str, seed: int) -> None:
        if rate_hz != kernels.RATE_HZ:
            raise UserError(f"melody: the sound has {rate_hz:g} Hz; resample it to {kernels.RATE_HZ} Hz")
        self._track, self._memory = syllables_kernels.memory(), kernels.memory()
        self._rng = random_source(seed, "melody", record)
        self._noise = np.empty((0, 2))
        self._n_samples = 0

    def push(self, samples: Floats) -> Floats:
        """Continue the stream by samples (n,), full scale 1, and return the frames that become known.

        Returns
        -------
        (T, 3) pitch, its slope per frame and intensity, as in the columns of schema ``melody``.
        """
        self._n_samples += len(samples)
        pieces = [samples[first : first + PIECE] for first in range(0, len(samples), PIECE)]
        parts = [self._measured(piece) for piece in pieces]
        return parts[0] if len(parts) == 1 else np.concatenate([*parts, np.empty((0, N_COLUMNS))])

    def finish(self) -> Floats:
        """End the stream, and return its remaining frames (T, 3). No samples may follow."""
        memory = self._memory[0]
        n_frames = self._n_samples // kernels.STEP
        n_hops = n_frames * kernels.PER_FRAME + syllables_kernels.AHEAD + syllables_kernels.LASTING
        tail = np.zeros(max(0, n_hops * kernels.HOP - self._n_samples))
        parts = [self._measured(tail[first : first + PIECE]) for first in range(0, len(tail), PIECE)]
        memory["end"] = n_frames
        rows = np.empty((min(n_frames, kernels.LATER), N_COLUMNS))
        kernels.close(self._memory, rows)
        return np.concatenate([*parts, rows])

    def _measured(self, samples: Floats) -> Floats:
        """Return the frames (T, 3) that become known with at most ``PIECE`` samples."""
        most = 1 + len(samples) // kernels.STEP
        if len(self._noise) < most:
            self._noise = np.concatenate([self._noise, self._rng.standard_normal((PIECE // kernels.STEP + 1, 2))])
        rows, before = np.empty((most, N_COLUMNS)), int(self._memory["n"][0])
        n_known = kernels.push(samples, self._track, self._memory, self._noise, rows)
        self._noise = self._noise[int(self._memory["n"][0]) - before :]
        return rows[:n_known]
