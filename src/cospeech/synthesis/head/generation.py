"""From pattern labels to the angles of the head (Sargin 2006, 4.3).

The thesis says that state occupancies follow from the diagonal of the d-step transition matrix, which would give
nearly all frames to the last state, because nothing leaves it within the pattern. They are taken to be shares of the
expected durations 1 / (1 - a_i) here.

With the filters ``printed``, angles are drawn from the Gaussian of each state and filtered by a median over 11
frames and a Gaussian over 15. This takes away most of the speed and some of the spread of a head. The filters
``kept`` filter the means of the states by the same Gaussian, and add noise whose autocovariance is what the result
lacks compared with the training records, by an autoregression (Yule-Walker). Spread, speed and jerk depend on the
autocovariance at the first lags only and are therefore kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.synthesis.head import generation_kernels as kernels
from cospeech.synthesis.head.generation_kernels import Patterns

Filters = Literal["printed", "kept"]

MEDIAN_FRAMES = 11
GAUSSIAN_FRAMES = 15
DEVIATIONS = 3.0
"""Standard deviations of the Gaussian filter between its centre and its end; the thesis gives only its length."""

ORDER = 4
"""Order of the autoregression: jerk depends on the autocovariance up to a lag of 3 frames."""

LARGEST_REFLECTION = 0.9999
"""Limit of the reflection coefficients, so that the autoregression is stable."""

N_AXES = 3


class Noise(NamedTuple):
    """An autoregression per axis: ``coefficients`` (P, 3), of the last value first, and ``scale`` (3,), degrees."""

    coefficients: Floats
    scale: Floats


NO_NOISE = Noise(np.zeros((ORDER, N_AXES)), np.zeros(N_AXES))


class Style(NamedTuple):
    """How angles are generated: frames of ``overlap``, ``ahead`` (see ``Generator``), and the filters."""

    overlap: int
    ahead: int
    filters: Filters


def style(overlap: int, look_ahead: int, filters: str) -> Style:
    """Return a style; the look-ahead is at least what the overlap needs.

    Raises
    ------
    UserError : if the filters are unknown, or a number is negative.
    """
    known: tuple[Filters, ...] = get_args(Filters)
    if filters not in known:
        raise UserError(f"config: synthesis.systems.head.filters: '{filters}'; known are {', '.join(known)}")
    if overlap < 0:
        raise UserError(f"config: synthesis.systems.head.overlap_frames: {overlap}; it cannot be negative")
    return Style(overlap, max(overlap + 1, look_ahead), known[known.index(filters)])


def gaussian() -> Floats:
    """Return the weights (15,) of the Gaussian filter."""
    steps = np.arange(GAUSSIAN_FRAMES) - GAUSSIAN_FRAMES // 2
    weights = np.exp(-0.5 * (steps * DEVIATIONS / (GAUSSIAN_FRAMES // 2)) ** 2)
    return np.asarray(weights / weights.sum())


def patterns_of(model: LabelledHMM) -> Patterns:
    """Return what the head patterns generate: the angles are the first three features."""
    hmm = model.hmm
    lasting = 1.0 / (1.0 - hmm.stay)
    edges = np.cumsum(lasting, axis=1) / lasting.sum(axis=1, keepdims=True)
    return Patterns(
        np.ascontiguousarray(hmm.mean[:, :, :N_AXES]),
        np.ascontiguousarray(np.sqrt(hmm.variance[:, :, :N_AXES])),
        np.ascontiguousarray(edges[:, :-1]),
        lasting.sum(axis=1),
    )


class _Centred:
    """A filter over ``half`` frames on both sides, as frames (n, 3) become known."""

    def __init__(self, half: int, weights: Floats | None) -> None:
        self._half, self._weights = half, weights
        self._known = np.empty((0, N_AXES))
        self._made = 0

    def hear(self, frames: Floats) -> Floats:
        """Return the filtered frames that become certain."""
        self._known = np.concatenate([self._known, frames])
        return self._filtered(len(self._known) - self._half)

    def end(self) -> Floats:
        """Return the filtered frames that are still missing."""
        return self._filtered(len(self._known))

    def _filtered(self, until: int) -> Floats:
        found = np.empty((max(0, until - self._made), N_AXES))
        if len(found):
            if self._weights is None:
                kernels.medians(self._known, self._made, self._half, found)
            else:
                kernels.weighted(self._known, self._made, self._weights, found)
            spent = max(0, until - self._half)
            self._known, self._made = self._known[spent:], until - spent
        return found


class Generator:
    """The angles of the head, as the labels of its patterns become known.

    Parameters
    ----------
    patterns : the patterns of the head.
    how : overlap, look-ahead and filters. A frame is generated when the label ``ahead`` frames later is known; a
        segment whose end is known by then is generated as in the thesis.
    noise : noise of the filters ``kept``.
    rng : random numbers.
    """

    def __init__(self, patterns: Patterns, how: Style, noise: Noise, rng: np.random.Generator) -> None:
        self._patterns, self._how, self._rng = patterns, how, rng
        self._memory = kernels.memory(2 * how.overlap + how.ahead + 2)
        smooth = _Centred(GAUSSIAN_FRAMES // 2, gaussian())
        self._filters = [smooth] if how.filters == "kept" else [_Centred(MEDIAN_FRAMES // 2, None), smooth]
        self._noise, self._past = noise, np.zeros_like(noise.coefficients)

    def hear(self, labels: Integers) -> Floats:
        """Return the frames (n, 3) in degrees that become certain with the next labels (T,)."""
        memory = self._memory
        due = max(0, int(memory.heard[0]) + len(labels) - self._how.ahead) - int(memory.made[0])
        frames = np.empty((due, N_AXES))
        kernels.generate(labels, self._patterns, self._how.overlap, self._how.ahead, self._drawn(due), memory, frames)
        for one in self._filters:
            frames = one.hear(frames)
        return self._coloured(frames)

    def end(self) -> Floats:
        """Return the frames (n, 3) that are still missing when the last label is known."""
        memory = self._memory
        frames = np.empty((int(memory.heard[0] - memory.made[0]), N_AXES))
        kernels.finish(self._patterns, self._how.overlap, self._drawn(len(frames)), memory, frames)
        for one in self._filters:
            frames = np.concatenate([one.hear(frames), one.end()])
        return self._coloured(frames)

    def _drawn(self, n_frames: int) -> Floats:
        """Return the noise of the segments, which the filters ``kept`` do without."""
        shape = n_frames, 2 * self._how.overlap + 2, N_AXES
        return np.zeros(shape) if self._how.filters == "kept" else self._rng.standard_normal(shape)

    def _coloured(self, frames: Floats) -> Floats:
        if self._how.filters == "printed" or len(frames) == 0:
            return frames
        noise = self._rng.standard_normal(frames.shape)
        kernels.colour(noise, self._noise.coefficients, self._noise.scale, self._past)
        return frames + noise


def fit_noise(original: Sequence[Floats], made: Sequence[Floats]) -> Noise:
    """Return the noise that gives the angles ``made``, (T, 3) each, the autocovariance of the original ones."""
    lacking = _autocovariance(original) - _autocovariance(made)
    fitted = [_autoregression(column) for column in lacking.T]
    return Noise(np.column_stack([own for own, _ in fitted]), np.array([scale for _, scale in fitted]))


def _autocovariance(sequences: Sequence[Floats]) -> Floats:
    """Return the autocovariance of sequences (T, 3) about their mean at lags 0 to P, (P + 1, 3)."""
    mean = np.concatenate(list(sequences)).mean(axis=0)
    sums, counts = np.zeros((ORDER + 1, N_AXES)), np.zeros(ORDER + 1)
    for frames in sequences:
        away = frames - mean
        for lag in range(min(ORDER + 1, len(frames))):
            sums[lag] += (away[lag:] * away[: len(away) - lag]).sum(axis=0)
            counts[lag] += len(away) - lag
    return np.asarray(sums / np.maximum(counts, 1.0)[:, None])


def _autoregression(autocovariance: Floats) -> tuple[Floats, float]:
    """Return the coefficients (ORDER,) and the innovation's deviation of an autocovariance (Levinson-Durbin).

    An impossible autocovariance is replaced by a possible one: there is no noise without variance, and reflection
    coefficients are limited.
    """
    coefficients = np.zeros(ORDER)
    error = float(autocovariance[0])
    if error <= 0.0:
        return coefficients, 0.0
    for p in range(ORDER):
        gap = autocovariance[p + 1] - coefficients[:p] @ autocovariance[p:0:-1]
        reflection = float(np.clip(gap / error, -LARGEST_REFLECTION, LARGEST_REFLECTION))
        coefficients[: p + 1] = np.append(coefficients[:p] - reflection * coefficients[:p][::-1], reflection)
        error *= 1.0 - reflection**2
    return coefficients, float(np.sqrt(error))
