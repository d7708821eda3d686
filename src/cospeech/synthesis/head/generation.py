"""From pattern labels to the angles of the head (Sargin 2006, 4.3).

The thesis says that state occupancies follow from the diagonal of the d-step transition matrix, which would give
nearly all frames to the last state, because nothing leaves it within the pattern. They are taken to be shares of the
expected durations 1 / (1 - a_i) here.

With the filters ``printed``, angles are drawn from the Gaussian of each state and filtered by a median over 11
frames and a Gaussian over 15. This takes away most of the speed and some of the spread of a head. The filters
``kept`` filter the means of the states by the same Gaussian, and add noise that supplies the variance, of the angles
and of their first and third differences, that the result lacks compared with the training records: spread, speed and
jerk are kept. The noise is a sum of white noises, each smoothed by four equal first-order filters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np
from scipy.optimize import nnls
from scipy.special import comb

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

TIMES = np.geomspace(0.3, 24.0, 12)
"""Time constants of the smoothed noises in frames, (C,)."""

ROUNDS = 6
"""Corrections of the mean squares that the noise has to reach."""

DIFFERENCES = (0, 1, 3)
"""Orders of the differences whose variances are kept: spread, speed and jerk."""

N_AXES = 3


class Noise(NamedTuple):
    """Noise of the filters ``kept``: ``deviation`` (C, 3) of each smoothed noise on each axis, degrees."""

    deviation: Floats


NO_NOISE = Noise(np.zeros((len(TIMES), N_AXES)))


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


class Stage(NamedTuple):
    """How far the filters go: which ones, and how many of them."""

    filters: Filters
    n_filters: int


def of_stage(name: str) -> Stage:
    """Return a stage of figure 4.5: drawn, after the median, printed (after both filters), or kept."""
    stages: dict[str, Stage] = {
        "drawn": Stage("printed", 0),
        "median": Stage("printed", 1),
        "printed": Stage("printed", 2),
        "kept": Stage("kept", 1),
    }
    return stages[name]


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
    n_filters : number of filters that are used, to show what each does.
    """

    def __init__(
        self, patterns: Patterns, how: Style, noise: Noise, rng: np.random.Generator, n_filters: int = 2
    ) -> None:
        self._patterns, self._how, self._rng = patterns, how, rng
        self._memory = kernels.memory(2 * how.overlap + how.ahead + 2)
        smooth = _Centred(GAUSSIAN_FRAMES // 2, gaussian())
        every = [smooth] if how.filters == "kept" else [_Centred(MEDIAN_FRAMES // 2, None), smooth]
        self._filters = every[:n_filters]
        self._noise = _Smoothed(noise, rng)

    def hear(self, labels: Integers) -> Floats:
        """Return the frames (n, 3) in degrees that become certain with the next labels (T,)."""
        memory = self._memory
        due = max(0, int(memory.heard[0]) + len(labels) - self._how.ahead) - int(memory.made[0])
        frames = np.empty((due, N_AXES))
        kernels.generate(labels, self._patterns, self._how.overlap, self._how.ahead, self._drawn(due), memory, frames)
        for one in self._filters:
            frames = one.hear(frames)
        return self._finished(frames)

    def end(self) -> Floats:
        """Return the frames (n, 3) that are still missing when the last label is known."""
        memory = self._memory
        frames = np.empty((int(memory.heard[0] - memory.made[0]), N_AXES))
        kernels.finish(self._patterns, self._how.overlap, self._drawn(len(frames)), memory, frames)
        for one in self._filters:
            frames = np.concatenate([one.hear(frames), one.end()])
        return self._finished(frames)

    def _drawn(self, n_frames: int) -> Floats:
        """Return the noise of the segments, which the filters ``kept`` do without."""
        shape = n_frames, 2 * self._how.overlap + 2, N_AXES
        return np.zeros(shape) if self._how.filters == "kept" else self._rng.standard_normal(shape)

    def _finished(self, frames: Floats) -> Floats:
        return self._noise.add(frames) if self._how.filters == "kept" else frames


class _Smoothed:
    """The sum of smoothed noises, as it is needed."""

    def __init__(self, noise: Noise, rng: np.random.Generator) -> None:
        self._scale = noise.deviation / np.sqrt(_variances()[0])[:, None]
        self._poles = np.exp(-1.0 / TIMES)
        self._past = np.zeros((kernels.STAGES, *noise.deviation.shape))
        self._rng = rng

    def add(self, frames: Floats) -> Floats:
        """Return the next frames (T, 3) with noise."""
        found, noise = frames.copy(), self._rng.standard_normal((len(frames), *self._scale.shape))
        kernels.add_noise(noise, self._poles, self._scale, self._past, found)
        return found


def fit_noise(original: Sequence[Floats], made: Sequence[Floats]) -> Noise:
    """Return the noise that gives the angles ``made``, (T, 3) each, spread, speed and jerk of the original ones.

    A head that rests in between has a smaller mean speed than noise of the same mean square. The mean squares to
    reach are therefore corrected by what is reached with the noise.
    """
    own = _variances() / _variances()[0]
    aim, base, sizes = _squares(original), _squares(made), _sizes(original)
    noise = NO_NOISE
    for _ in range(ROUNDS):
        lacking = np.maximum(aim - base, 0.0)
        shares = [
            nnls(own / axis[:, None], missing / axis)[0] for axis, missing in zip(aim.T, lacking.T, strict=True)
        ]
        noise = Noise(np.sqrt(np.column_stack(shares)))
        rng = np.random.default_rng(0)
        aim = aim * (sizes / _sizes([_Smoothed(noise, rng).add(frames) for frames in made])) ** 2
    return noise


def _differences(sequences: Sequence[Floats]) -> list[Floats]:
    """Return the angles (T, 3) minus their mean, and their ``DIFFERENCES``, of all sequences."""
    mean = np.concatenate(list(sequences)).mean(axis=0)
    return [
        np.concatenate([np.diff(frames - mean, n=order, axis=0) for frames in sequences]) for order in DIFFERENCES
    ]


def _squares(sequences: Sequence[Floats]) -> Floats:
    """Return the mean squares of the ``DIFFERENCES`` of angles (T, 3) by axis, (3, 3), all positive."""
    return np.maximum([(values**2).mean(axis=0) for values in _differences(sequences)], np.finfo(float).tiny)


def _sizes(sequences: Sequence[Floats]) -> Floats:
    """Return the spread of angles (T, 3) by axis, and the mean norm of their other ``DIFFERENCES``, (3, 3)."""
    spread, *others = _differences(sequences)
    norms = [np.full(N_AXES, np.linalg.norm(values, axis=1).mean()) for values in others]
    return np.maximum([spread.std(axis=0), *norms], np.finfo(float).tiny ** 0.5)


def _variances() -> Floats:
    """Return the variances of each smoothed white noise and of its ``DIFFERENCES``, (3, C)."""
    steps = np.arange(round(40 * TIMES[-1]))
    poles = np.exp(-1.0 / TIMES)[:, None]
    response = (1.0 - poles) ** kernels.STAGES * poles**steps * comb(steps + kernels.STAGES - 1, kernels.STAGES - 1)
    padded = np.pad(response, ((0, 0), (max(DIFFERENCES), 0)))
    return np.array([(np.diff(padded, n=order, axis=1) ** 2).sum(axis=1) for order in DIFFERENCES])
