"""The six prosody features (Özkul 2012, 4.2, eq. 4.3-4.5): intensity, pitch, pitch gain and their derivatives.

What the text leaves open is settled so:

- Frame k covers [k, k + 1) times ``frame_s``; its analysis window is centred on the frame's centre. At the ends of
  the record the window holds the samples that exist.
- Eq. 4.4 lacks the squares under its roots. The signal of a window is zero outside the window, and the sums run over
  all samples; both roots are then the window's energy, and r falls with the lag by the share of the window that
  still overlaps. This is what keeps the arg max from the multiples of the period: of the frames voiced for Praat's
  tracker too, 1 % are off by more than a fifth, and 3 % where each lag is weighed by its own overlap.
- The mean of the window is removed before eq. 4.4, or a constant offset would correlate with itself at every lag.
- The maximum is one of the peaks of r between the two pitch limits, not the slope at a limit; where r has no peak, it
  is its largest value. A parabola through the peak places it between samples (an addition to the thesis: at 16 kHz
  and 400 Hz a sample is 0.4 semitones).
- A window without energy has no lag: it is null, enters the features as the mean lag, and its gain is 0.
- The first derivative is the difference to the frame before, 0 in the first frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import fft

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError

FEATURES = ("intensity", "pitch_lag", "pitch_gain")
"""The three features whose derivatives are the other three (eq. 4.5)."""

QUIETEST = 1.0 / (12 * 32768**2)
"""Power of rounding to 16 bits, full scale 1: the least energy whose logarithm means anything."""

BLOCK = 128
"""Frames that are transformed at once: they fit the cache, and memory does not grow with the record."""


class Frames(NamedTuple):
    """What is measured in each of T frames: log energy, best lag in seconds (NaN where none), and its gain."""

    intensity_log: Floats
    lag_s: Floats
    gain: Floats


def measure(
    samples: Floats, rate_hz: float, *, frame_s: float, window_s: float, pitch_min_hz: float, pitch_max_hz: float
) -> Frames:
    """Measure intensity (eq. 4.3), best lag and pitch gain (eq. 4.4) of every frame.

    Parameters
    ----------
    samples : (n,) sound, full scale 1.
    rate_hz : sampling rate.
    frame_s, window_s : distance of frames and length of the analysis window, in seconds.
    pitch_min_hz, pitch_max_hz : range of the pitch.

    Raises
    ------
    UserError : where the sound is shorter than a frame, or the window holds no two periods of the lowest pitch.
    """
    width = round(window_s * rate_hz)
    n_frames = int(len(samples) / (frame_s * rate_hz) + 1e-6)
    if n_frames < 1:
        raise UserError(f"the sound lasts {len(samples) / rate_hz:.3f} s, less than one frame of {frame_s} s")
    shortest, longest = int(np.ceil(rate_hz / pitch_max_hz)), int(rate_hz / pitch_min_hz)
    if longest + 1 >= width or shortest < 2:
        raise UserError(
            f"speech: a window of {window_s} s at {rate_hz} Hz cannot hold pitch from {pitch_min_hz} to "
            f"{pitch_max_hz} Hz; raise pitch_min_hz, lower pitch_max_hz, or widen window_s"
        )
    padded = np.pad(np.asarray(samples, dtype=float), width)
    first = np.round((np.arange(n_frames) + 0.5) * frame_s * rate_hz).astype(np.int64) + width - width // 2
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    present = np.minimum(first + width, width + len(samples)) - np.maximum(first, width)
    lags = np.arange(shortest - 1, longest + 2)  # one more on each side, to see whether a limit is a peak
    parts = [
        _measure_block(windows[first[k : k + BLOCK]], present[k : k + BLOCK], lags) for k in range(0, n_frames, BLOCK)
    ]
    intensity, lag, gain = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Frames(intensity, lag / rate_hz, gain)


def _measure_block(windows: Floats, present: npt.NDArray[np.int64], lags: npt.NDArray[np.int64]) -> Frames:
    """Return the measures of windows (n, W) of which ``present`` samples lie in the record, lags in samples."""
    energy = (windows**2).sum(axis=1) / present
    centred = windows - windows.mean(axis=1, keepdims=True)
    size = fft.next_fast_len(windows.shape[1] + int(lags[-1]), real=True)
    power = np.abs(fft.rfft(centred, size, axis=1)) ** 2
    products = fft.irfft(power, size, axis=1)
    sounding = products[:, 0] > QUIETEST * windows.shape[1]
    r = products[:, lags] / np.where(sounding, products[:, 0], 1.0)[:, None]
    lag, gain = _highest_peak(r)
    return Frames(
        np.log(np.maximum(energy, QUIETEST)),
        np.where(sounding, lag + lags[0], np.nan),
        np.where(sounding, np.clip(gain, -1.0, 1.0), 0.0),
    )


def _highest_peak(r: Floats) -> tuple[Floats, Floats]:
    """Return place and value of the highest peak in each row of ``r`` (n, L), columns 1 to L - 2, between samples."""
    before, top, after = r[:, :-2], r[:, 1:-1], r[:, 2:]
    bend = before - 2 * top + after
    peak = (top >= before) & (top >= after) & (bend < 0)
    shift = 0.5 * (before - after) / np.where(peak, bend, -1.0)
    height = np.where(peak, top - 0.25 * (before - after) * shift, -np.inf)
    rows, best = np.arange(len(r)), height.argmax(axis=1)
    slope = ~peak.any(axis=1)
    best[slope] = top[slope].argmax(axis=1)
    lag = best + 1 + np.where(slope, 0.0, shift[rows, best])
    return lag, np.where(slope, top[rows, best], height[rows, best])


def statistics(record: str, frames: Frames, voiced_gain: float) -> pd.DataFrame:
    """Return the one-row table of what the features of a record are normalised with.

    Voiced frames, gain above ``voiced_gain``, make the mean lag.

    Raises
    ------
    UserError : where no frame is voiced or the intensity never changes.
    """
    voiced = frames.gain > voiced_gain
    spread = float(frames.intensity_log.std())
    if not voiced.any():
        raise UserError(
            f"record '{record}': no frame is voiced (pitch gain above {voiced_gain}); it is silent or no speech: "
            "check its sound, or leave the record out"
        )
    if spread < 1e-9:
        raise UserError(f"record '{record}': its intensity never changes, so it is no speech; check its sound")
    return pd.DataFrame(
        {
            "record": [record],
            "n_frames": [len(voiced)],
            "n_voiced": [int(voiced.sum())],
            "voiced_gain": [voiced_gain],
            "lag_mean_s": [float(frames.lag_s[voiced].mean())],
            "intensity_mean": [float(frames.intensity_log.mean())],
            "intensity_deviation": [spread],
        }
    )


def features(frames: Frames, statistics: pd.DataFrame, frame_s: float) -> pd.DataFrame:
    """Return the prosody table of one record (eq. 4.5), normalised with its ``statistics``.

    Intensity gets mean 0 and variance 1, the mean lag is removed from the lags; the raw values stay beside them.
    """
    used = statistics.iloc[0]
    n_frames = len(frames.gain)
    lag = frames.lag_s - used["lag_mean_s"]
    table = pd.DataFrame(
        {
            "frame": np.arange(n_frames),
            "time_s": segments.frame_times(n_frames, 1 / frame_s),
            "intensity": (frames.intensity_log - used["intensity_mean"]) / used["intensity_deviation"],
            "pitch_lag": np.where(np.isnan(lag), 0.0, lag),
            "pitch_gain": frames.gain,
        }
    )
    for name in FEATURES:
        table[f"d_{name}"] = table[name].diff().fillna(0.0)
    return table.assign(intensity_log=frames.intensity_log, lag_s=frames.lag_s)
