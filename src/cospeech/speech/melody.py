"""Pitch and intensity at 100 Hz, which head gestures follow (Sargin 2006, 4.1.2).

Pitch and intensity are meaningful within utterances only: stretches of voice with short unvoiced gaps, in which the
pitch is interpolated. Their means over all utterances of the record are removed, and the pitch is smoothed. What lies
between utterances is filled with Gaussian noise of mean 0 and variance 1, so that continuous densities can model it.

Readings of the text:

- Noise of unit variance is only comparable with features of unit variance, so pitch and intensity are also divided by
  their standard deviations over the utterances.
- Utterances and the low-pass filter are not specified. Here, an utterance ends where the voice pauses for longer than
  ``LONGEST_GAP_S``, and the pitch is averaged with a Hann window of ``SMOOTHED_S``.
- The intensity is printed as the weighted sum of squares. It is expressed in decibels here, in which a few loud
  syllables do not outweigh all others.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Flags, Floats
from cospeech.data.rng import random_source
from cospeech.errors import UserError

STEP_S = 0.01
"""Frame period in seconds."""

WINDOW_S, KAISER_BETA = 0.032, 20.0
"""Length and shape of the window of the intensity."""

FLOOR_DB = -100.0
"""Intensity of digital silence, in decibels re full scale."""

LONGEST_GAP_S, SHORTEST_S = 0.2, 0.1
"""Longest unvoiced gap within an utterance, and the shortest utterance."""

SMOOTHED_S = 0.07
"""Width of the window that smooths the pitch."""

BLOCK_FRAMES = 60_000
"""Number of frames whose intensity is computed at once."""


def table(record: str, f0_hz: Floats, intensity_db: Floats, seed: int) -> pd.DataFrame:
    """Return the melody of a record (schema ``melody``).

    Parameters
    ----------
    record : name of the record; the noise between utterances depends on it and on the seed.
    f0_hz : (T,) pitch in hertz of frames of ``STEP_S``, NaN where unvoiced.
    intensity_db : (T,) intensity of the same frames, as from ``intensity``.
    seed : seed of the run.

    Raises
    ------
    UserError : if the record has no utterance.
    """
    active = utterances(~np.isnan(f0_hz))
    if not active.any():
        raise UserError(
            f"record '{record}': there is no utterance in its {len(f0_hz) * STEP_S:.1f} s of sound, of which "
            f"{np.count_nonzero(~np.isnan(f0_hz)) * STEP_S:.1f} s are voiced; record speech, or leave this record out"
        )
    rng = random_source(seed, "melody", record)
    pitch, loudness = (
        np.where(active, _normalised(values, active), rng.standard_normal(len(values)))
        for values in (_smoothed(_without_gaps(f0_hz), active), intensity_db)
    )
    return pd.DataFrame(
        {
            "frame": np.arange(len(f0_hz)),
            "time_s": segments.frame_times(len(f0_hz), 1.0 / STEP_S),
            "f0_hz": f0_hz,
            "intensity_db": intensity_db,
            "active": active,
            "pitch": pitch,
            "d_pitch": slope(pitch),
            "intensity": loudness,
        }
    )


def intensity(samples: Floats, rate_hz: float) -> Floats:
    """Return the intensity (T,) of frames of ``STEP_S`` in decibels re full scale.

    It is the mean of the squared samples in a window of ``WINDOW_S`` around the centre of the frame, weighted with a
    Kaiser window of shape ``KAISER_BETA``.

    Parameters
    ----------
    samples : (n,) sound, full scale 1.
    rate_hz : sampling rate in Hz.
    """
    n_frames = int(len(samples) / (STEP_S * rate_hz) + 1e-6)
    width = round(WINDOW_S * rate_hz)
    weights = np.kaiser(width, KAISER_BETA)
    weights /= weights.sum()
    padded = np.pad(np.asarray(samples, dtype=float) ** 2, width)
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    first = np.round(segments.frame_times(n_frames, 1.0 / STEP_S) * rate_hz + width / 2).astype(int)
    blocks = [windows[first[start : start + BLOCK_FRAMES]] @ weights for start in range(0, n_frames, BLOCK_FRAMES)]
    power = np.concatenate([*blocks, np.empty(0)])
    return 10.0 * np.log10(np.maximum(power, 10.0 ** (FLOOR_DB / 10.0)))


def utterances(voiced: Flags) -> Flags:
    """Return which frames (T,) belong to an utterance.

    Parameters
    ----------
    voiced : (T,) which frames of ``STEP_S`` are voiced.
    """
    active = np.zeros(len(voiced), dtype=bool)
    frames = np.flatnonzero(voiced)
    if not len(frames):
        return active
    breaks = np.flatnonzero(np.diff(frames) - 1 > LONGEST_GAP_S / STEP_S + 1e-6) + 1
    for stretch in np.split(frames, breaks):
        first, end = int(stretch[0]), int(stretch[-1]) + 1
        active[first:end] = end - first >= SHORTEST_S / STEP_S - 1e-6
    return active


def slope(values: Floats) -> Floats:
    """Return the slope per frame (T,) by regression over five frames (eq. 4.8); the ends are continued by repetition.

    Parameters
    ----------
    values : (T,) values of consecutive frames.
    """
    before2, before, _, after, after2 = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="edge"), 5).T
    return ((after - before) + 2.0 * (after2 - before2)) / 10.0


def _without_gaps(f0_hz: Floats) -> Floats:
    """Return the pitch with linear interpolation where there is no voice."""
    frames, voiced = np.arange(len(f0_hz)), ~np.isnan(f0_hz)
    return np.interp(frames, frames[voiced], f0_hz[voiced])


def _smoothed(values: Floats, active: Flags) -> Floats:
    """Return running means of the active frames (T,), weighted with a Hann window; utterances do not mix."""
    window = np.hanning(round(SMOOTHED_S / STEP_S) + 2)[1:-1]
    half = len(window) // 2
    total, weight = (
        np.convolve(np.pad(part, half), window, mode="valid") for part in (np.where(active, values, 0.0), active)
    )
    return np.where(active, total / np.where(active, weight, 1.0), 0.0)


def _normalised(values: Floats, active: Flags) -> Floats:
    """Return values without their mean over the active frames, in units of their standard deviation there."""
    spread = float(values[active].std())
    return np.asarray((values - values[active].mean()) / (spread if spread > 0.0 else 1.0), dtype=np.float64)
