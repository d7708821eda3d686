"""Formants, the resonances of the vocal tract, by linear prediction.

The sound is resampled to twice the highest formant, its treble is raised by 6 dB per octave, and to each window a
filter is fitted that predicts every sample from those before it (J. P. Burg, in "Modern Spectrum Analysis", 1978).
The frequencies of the complex roots of its polynomial are the formants, as in Praat.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy import signal

from cospeech.data import segments
from cospeech.data.arrays import Floats

STEP_S = 0.01
"""Frame period in seconds."""

WINDOW_S = 0.05
"""Length of the Gaussian window, of which half has the weight of the centre."""

CEILING_HZ = 5500.0
"""Highest formant; that of a woman's voice. 5000 Hz suits a man's."""

N_FORMANTS = 5
"""Number of formants below the ceiling; the filter has two coefficients for each."""

EMPHASIS_HZ = 50.0
"""Frequency from which on the treble is raised."""

EDGE_HZ = 50.0
"""Distance from 0 and from the ceiling within which a root is not a formant."""


def find(samples: Floats, rate_hz: int, ceiling_hz: float = CEILING_HZ) -> Floats:
    """Return the formants in hertz, (T, ``N_FORMANTS``), in ascending order, of frames of ``STEP_S``.

    Parameters
    ----------
    samples : (n,) sound, full scale 1.
    rate_hz : sampling rate in Hz.
    ceiling_hz : highest formant.

    Returns
    -------
    Formants, also of frames without voice, where they mean little; NaN where fewer were found.
    """
    rate = round(2 * ceiling_hz)
    ratio = Fraction(rate, rate_hz)
    sampled = signal.resample_poly(np.asarray(samples, dtype=float), ratio.numerator, ratio.denominator)
    raised = signal.lfilter([1.0, -np.exp(-2.0 * np.pi * EMPHASIS_HZ / rate)], [1.0], sampled)
    windows = _windows(raised, rate, int(len(samples) / (STEP_S * rate_hz) + 1e-6))
    return _resonances(burg(windows, 2 * N_FORMANTS), rate)


def burg(windows: Floats, order: int) -> Floats:
    """Return the coefficients (T, order) of filters that predict each sample of windows (T, n) from those before it.

    One coefficient after another is chosen such that the sum of the squared errors of predicting forward and backward
    is least. Windows of zeros have coefficients of zero.
    """
    forward, backward = windows[:, 1:].copy(), windows[:, :-1].copy()
    found = np.zeros((len(windows), 0))
    for _ in range(order):
        energy = (forward**2 + backward**2).sum(axis=1)
        reflection = 2.0 * (forward * backward).sum(axis=1) / np.where(energy > 0.0, energy, 1.0)
        found = np.column_stack([found - reflection[:, None] * found[:, ::-1], reflection])
        forward, backward = (
            (forward - reflection[:, None] * backward)[:, 1:],
            (backward - reflection[:, None] * forward)[:, :-1],
        )
    return found


def _windows(samples: Floats, rate: int, n_frames: int) -> Floats:
    """Return Gaussian windows of the sound around the centres of the frames, (T, n)."""
    width = round(WINDOW_S * rate)
    places = (np.arange(width) + 0.5) / width - 0.5
    edge = np.exp(-12.0)
    shape = (np.exp(-48.0 * places**2) - edge) / (1.0 - edge)
    first = np.round(segments.frame_times(n_frames, 1.0 / STEP_S) * rate + width / 2).astype(int)
    return np.lib.stride_tricks.sliding_window_view(np.pad(samples, width), width)[first] * shape


def _resonances(filters: Floats, rate: int) -> Floats:
    """Return the frequencies in hertz of the roots of filters (T, order), in ascending order; NaN where fewer."""
    n_frames, order = filters.shape
    companions = np.zeros((n_frames, order, order))
    companions[:, 0] = filters
    companions[:, np.arange(1, order), np.arange(order - 1)] = 1.0
    roots = np.linalg.eigvals(companions)
    frequencies = np.angle(roots) * rate / (2.0 * np.pi)
    inside = (roots.imag > 0.0) & (frequencies > EDGE_HZ) & (frequencies < rate / 2 - EDGE_HZ)
    return np.sort(np.where(inside, frequencies, np.nan), axis=1)[:, : order // 2]
