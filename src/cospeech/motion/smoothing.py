"""Smoothing of joint angles where one unit meets the next (Özkul 2012, chapter 6 and figure 6.3).

A filter has a window of frames. It is applied around phrase boundaries only: fully at the two frames that meet, with
a fade-out over one window on either side, and not at all beyond. All filters are symmetric, so that gestures are not
delayed relative to the speech.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats

FILTERS = ("none", "exponential", "moving_average", "gaussian", "median")
"""The filters of figure 6.3."""


def smooth(values: Floats, filter_name: str, window: int) -> Floats:
    """Return ``values`` (T, ...) filtered over all frames; beyond the ends, the first and last value are repeated.

    Parameters
    ----------
    values : (T, ...) continuous signals; angles must be unwrapped.
    filter_name : one of ``FILTERS``.
    window : length of the filter in frames; an even length is rounded up to the next odd one. 1 changes nothing.
    """
    half = window // 2
    if filter_name == "none" or half == 0:
        return values
    if filter_name == "median":
        return np.median(_neighbours(values, half), axis=-1)
    weights = kernel(filter_name, 2 * half + 1)
    return _neighbours(values, len(weights) // 2) @ weights


def kernel(filter_name: str, window: int) -> Floats:
    """Return the symmetric weights of a linear filter of ``window`` (odd) frames, which sum to 1.

    ``moving_average`` has equal weights, and ``gaussian`` those of a bell curve up to two standard deviations.
    ``exponential`` is exponential smoothing with the factor 2 / (window + 1), which has the same mean age as the
    window, applied forward and backward: the weights fall by (window - 1) / (window + 1) per frame on both sides, and
    are truncated at two windows. The middle weight is close to 1 / window, so that jumps are divided as by the moving
    average.
    """
    if filter_name == "moving_average":
        weights = np.ones(window)
    elif filter_name == "gaussian":
        weights = np.exp(-0.5 * np.linspace(-2.0, 2.0, window) ** 2)
    elif filter_name == "exponential":
        weights = ((window - 1) / (window + 1)) ** np.abs(np.arange(-2 * window, 2 * window + 1))
    else:
        raise ValueError(f"'{filter_name}' is not a linear filter")
    return weights / weights.sum()


def influence(boundaries: npt.ArrayLike, n_frames: int, window: int) -> Floats:
    """Return the weight of the filtered values in each frame, (T,) in [0, 1], given the first frames of phrases.

    It is 1 at the two frames that meet and falls to 0 as half a cosine over ``window`` frames on either side.
    """
    meets = np.asarray(boundaries, dtype=float) - 0.5
    if len(meets) == 0:
        return np.zeros(n_frames)
    frames = np.arange(n_frames)
    after = np.clip(np.searchsorted(meets, frames), 0, len(meets) - 1)
    before = np.maximum(after - 1, 0)
    distance = np.minimum(np.abs(frames - meets[after]), np.abs(frames - meets[before])) - 0.5
    return np.where(distance < window, 0.5 + 0.5 * np.cos(np.pi * np.minimum(distance / window, 1.0)), 0.0)


def around_boundaries(angles_deg: Floats, boundaries: npt.ArrayLike, filter_name: str, window: int) -> Floats:
    """Return unwrapped angles (T, ...) smoothed around the first frames of phrases and unchanged elsewhere."""
    share = influence(boundaries, len(angles_deg), window)
    share = share.reshape(-1, *(1,) * (angles_deg.ndim - 1))
    return angles_deg + share * (smooth(angles_deg, filter_name, window) - angles_deg)


def _neighbours(values: Floats, half: int) -> Floats:
    """Return the ``2 * half + 1`` frames around every frame along a new last axis."""
    padded = np.pad(values, [(half, half), *[(0, 0)] * (values.ndim - 1)], mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
