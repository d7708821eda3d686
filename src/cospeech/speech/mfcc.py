"""Mel-frequency cepstral coefficients with their first and second derivatives (Sargin 2006, 2.1.2).

The coefficients are those of kaldi-native-fbank: 25 ms windows, 23 triangular mel filters, cosine transform, lifter.
"""

from __future__ import annotations

import kaldi_native_fbank as knf
import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.segments import frame_times
from cospeech.errors import UserError

RATE_HZ = 100.0
"""Number of frames per second."""
CEPSTRA = 13
"""Number of coefficients without derivatives; the first is that of order 0, the level."""
WINDOW_MS = 25.0
FULL_SCALE = 32768.0
"""Kaldi expects samples of 16 bits."""
REACH = 2
"""Number of frames before and after a frame that its derivative is computed from."""
COLUMNS = [f"c{n}" for n in range(1, 3 * CEPSTRA + 1)]


def coefficients(samples: Floats, rate_hz: float) -> Floats:
    """Return 13 mel-frequency cepstral coefficients, their first and their second derivatives.

    Parameters
    ----------
    samples : (n,) samples with full scale 1.
    rate_hz : sampling rate, in hertz.

    Returns
    -------
    (T, 39): 100 frames per second; frame k is centred at (k + 0.5) / 100 seconds. The derivatives are per frame.

    Raises
    ------
    UserError : if the sound is shorter than one frame.
    """
    return with_derivatives(cepstra(samples, rate_hz))


def cepstra(samples: Floats, rate_hz: float) -> Floats:
    """Return 13 mel-frequency cepstral coefficients (T, 13); parameters and errors as in ``coefficients``."""
    options = knf.MfccOptions()
    options.frame_opts.samp_freq = rate_hz
    options.frame_opts.frame_shift_ms = 1000.0 / RATE_HZ
    options.frame_opts.frame_length_ms = WINDOW_MS
    options.frame_opts.dither = 0.0
    options.frame_opts.snip_edges = False
    options.num_ceps = CEPSTRA
    options.use_energy = False
    frames = knf.OnlineMfcc(options)
    frames.accept_waveform(rate_hz, (FULL_SCALE * samples).astype(np.float32))
    frames.input_finished()
    if frames.num_frames_ready == 0:
        raise UserError(f"{len(samples) / rate_hz:.3f} s of sound is less than one frame; record more")
    return np.array([frames.get_frame(n) for n in range(frames.num_frames_ready)], dtype=float)


def with_derivatives(values: Floats) -> Floats:
    """Return features (T, D) with their first and second derivatives per frame, (T, 3 D)."""
    first = derivative(values)
    return np.concatenate([values, first, derivative(first)], axis=1)


def derivative(values: Floats) -> Floats:
    """Return the slope per frame of features (T, D) by linear regression over five frames.

    The first and the last frame are repeated beyond the ends.
    """
    padded = np.pad(values, ((REACH, REACH), (0, 0)), mode="edge")
    steps = range(1, REACH + 1)
    total = sum(n * (padded[REACH + n : len(padded) - REACH + n] - padded[REACH - n : -REACH - n]) for n in steps)
    return np.asarray(total / (2 * sum(n * n for n in steps)))


def table(clip: str, features: Floats) -> pd.DataFrame:
    """Return features (T, 39) of a clip as a table (schema ``mfcc``)."""
    frames = pd.DataFrame(features, columns=COLUMNS)
    frames.insert(0, "clip", clip)
    frames.insert(1, "frame", np.arange(len(features)))
    frames.insert(2, "time_s", frame_times(len(features), RATE_HZ))
    return frames
