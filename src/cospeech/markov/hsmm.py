"""Hidden semi-Markov model: each state lasts for a while and emits one symbol per frame (Özkul 2012, chapter 5).

A path is a sequence of segments (state j_l, duration k_l) that cover frames 0 ... T - 1. Its score is

    log pi(j_1) + sum_l log a(j_{l-1}, j_l) + sum_l log d_{j_l}(k_l) + w * sum_t log b_{j(t)}(xi_t)

with w = 1 in eq. 5.9. Any other emission weight w is a stream exponent as in Sargin 2006, eq. 4.18: it makes up for
symbols that are correlated from frame to frame, which the model counts as independent. ``censoring`` says what
happens at the end of the sequence: with ``none`` the last segment ends there; with ``right`` the end may cut it off,
and P(duration >= k) takes the place of d(k).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.markov import hsmm_kernels

Censoring = Literal["none", "right"]
Smoothing = Literal["none", "additive", "kernel"]

_ARRAYS = ("initial", "transitions", "emissions", "durations")
"""The attributes of a model that are arrays."""


@dataclass(frozen=True)
class _Parameters:
    states: tuple[str, ...]
    symbols: tuple[str, ...]
    initial: Floats
    transitions: Floats
    emissions: Floats
    durations: Floats


@dataclass(frozen=True)
class HSMM(_Parameters):
    """The probabilities of a model.

    Attributes
    ----------
    states : (S,) names of the states.
    symbols : (K,) names of the symbols that they emit.
    initial : (S,) pi, eq. 5.4.
    transitions : (S, S) a, eq. 5.1, from row to column; a state may follow itself.
    emissions : (S, K) b, eq. 5.2.
    durations : (S, D) d, eq. 5.3; column k - 1 is a duration of k frames.
    """


@dataclass(frozen=True)
class Counts(_Parameters):
    """The counts of eq. 5.5-5.8, of one sequence or summed over several; shapes as in ``HSMM``."""

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.states, self.symbols, *(getattr(self, name) + getattr(other, name) for name in _ARRAYS))


class Path(NamedTuple):
    """A path of L segments: first frames (L,), names of their states (L,), and the score of the path."""

    starts: Integers
    labels: npt.NDArray[np.object_]
    log_score: float


def encode(labels: npt.ArrayLike, names: tuple[str, ...], where: str) -> Integers:
    """Return the index of each label in ``names``, shape (n,).

    Raises
    ------
    UserError : if a label is not among the names; ``where`` says what the labels are.
    """
    given = np.asarray(labels, dtype=object)
    heads = np.flatnonzero(np.append(True, given[1:] != given[:-1])[: len(given)])  # labels come in runs
    place = {name: number for number, name in enumerate(names)}
    codes = np.array([place.get(given[head], -1) for head in heads], dtype=np.int64)
    if (codes < 0).any():
        first = heads[int(np.flatnonzero(codes < 0)[0])]
        raise UserError(f"{where}: label '{given[first]}' at {first}; known are {', '.join(names)}")
    return np.repeat(codes, np.diff(np.append(heads, len(given))))


def count(
    segments: pd.DataFrame,
    observations: npt.ArrayLike,
    states: tuple[str, ...],
    symbols: tuple[str, ...],
    n_bins: int,
) -> Counts:
    """Count the segments and symbols of one sequence (Özkul 2012, C, O and G of eq. 5.5-5.8).

    Parameters
    ----------
    segments : segment table (schema ``segments``) of the sequence, whose labels are states.
    observations : (T,) symbol of every frame.
    states, symbols : names that may occur.
    n_bins : D; longer segments are counted in the last bin, which is the longest duration that can be decoded.

    Notes
    -----
    Neighbouring segments of the same state are two segments. The first and the last segment, which may be cut by the
    ends of the sequence, are counted like all others, as in the thesis.

    Raises
    ------
    UserError : if a label or symbol is unknown, or the segments and the observations differ in length.
    """
    where = f"record {segments['record'].iloc[0]}"
    codes = encode(segments["label"], states, where)
    lengths = (segments["end_frame"] - segments["start_frame"]).to_numpy(dtype=np.int64)
    emitted = encode(observations, symbols, where)
    if lengths.sum() != len(emitted):
        raise UserError(f"{where}: its segments cover {lengths.sum()} frames, its observations {len(emitted)}")
    n_states = len(states)
    initial = np.zeros(n_states)
    initial[codes[0]] = 1.0
    transitions = np.zeros((n_states, n_states))
    np.add.at(transitions, (codes[:-1], codes[1:]), 1.0)
    emissions = np.zeros((n_states, len(symbols)))
    np.add.at(emissions, (np.repeat(codes, lengths), emitted), 1.0)
    durations = np.zeros((n_states, n_bins))
    np.add.at(durations, (codes, np.minimum(lengths, n_bins) - 1), 1.0)
    return Counts(states, symbols, initial, transitions, emissions, durations)


def estimate(counts: Counts, floor: float, smoothing: Smoothing = "none", amount: float = 1.0) -> HSMM:
    """Return the relative frequencies of ``counts`` (Özkul 2012, eq. 5.5-5.8), floored.

    Parameters
    ----------
    floor : every probability is raised to at least this value and its distribution is normalised again, so that no
        path has a score of minus infinity. With 0 nothing is floored.
    smoothing : how the duration histograms are smoothed. ``none``: not at all; ``additive``: ``amount`` is added to
        the count of every bin; ``kernel``: each segment is spread over the bins by a Gaussian with a standard
        deviation of ``amount`` bins.

    Notes
    -----
    States without a segment are left out: their emissions would be uniform, and would win long stretches.
    """
    seen = np.flatnonzero(counts.durations.sum(axis=1) > 0)
    if len(seen) == 0:
        raise ValueError("no segment was counted")
    counted = HSMM(
        states=tuple(counts.states[i] for i in seen),
        symbols=counts.symbols,
        initial=counts.initial[seen],
        transitions=counts.transitions[np.ix_(seen, seen)],
        emissions=counts.emissions[seen],
        durations=_smoothed(counts.durations[seen], smoothing, amount),
    )
    return floored(counted, floor)


def floored(model: HSMM, floor: float) -> HSMM:
    """Return ``model`` with normalised distributions and no probability below ``floor``; see ``estimate``."""
    return HSMM(model.states, model.symbols, *(_floored(getattr(model, name), floor) for name in _ARRAYS))


def _floored(weights: Floats, floor: float) -> Floats:
    """Normalise over the last axis (to a uniform distribution if all are 0), raise to the floor, normalise again."""
    total = weights.sum(axis=-1, keepdims=True)
    share = np.where(total > 0, weights / np.where(total > 0, total, 1.0), 1.0 / weights.shape[-1])
    raised = np.maximum(share, floor)
    return raised / raised.sum(axis=-1, keepdims=True)


def _smoothed(histograms: Floats, smoothing: Smoothing, amount: float) -> Floats:
    if smoothing == "none":
        return histograms
    if smoothing == "additive":
        return histograms + amount
    bins = np.arange(histograms.shape[1])
    kernel = np.exp(-0.5 * ((bins[:, None] - bins[None, :]) / amount) ** 2)
    return histograms @ (kernel / kernel.sum(axis=1, keepdims=True))  # rows sum to 1, so that edges lose no segment


def decode(model: HSMM, observations: npt.ArrayLike, weight: float = 1.0, censoring: Censoring = "none") -> Path:
    """Return the best path (Özkul 2012, eq. 5.9 and Alg. 1; the first segment may end at any t <= D).

    Parameters
    ----------
    observations : (T,) symbol of every frame.
    weight : emission weight w.
    censoring : whether the end of the sequence may cut the last segment.

    Raises
    ------
    UserError : if there is no frame, or a symbol is unknown.

    Notes
    -----
    Ties are broken from the end: the last state that comes first in ``model.states`` wins, then the shortest last
    segment, and so on towards the beginning.
    """
    return decode_each(model, observations, [weight], censoring)[0]


def decode_each(
    model: HSMM, observations: npt.ArrayLike, weights: Sequence[float], censoring: Censoring = "none"
) -> list[Path]:
    """Return the best path under each emission weight; see ``decode``."""
    logs = _logs(model, observations, 0.0, censoring)
    risen = _risen(logs.durations)
    return [_best_path(model, logs._replace(emissions=_emissions(model, weight)), *risen) for weight in weights]


def _best_path(model: HSMM, logs: _Logs, risen: Integers, n_risen: Integers) -> Path:
    n_states, n_bins = logs.durations.shape
    n_frames = len(logs.observations)
    block = hsmm_kernels.BLOCK
    padded = np.full((n_states, n_bins + block), -np.inf)
    padded[:, :n_bins] = logs.durations
    offer = np.full((n_states, n_frames + block), -np.inf)
    emitted = np.zeros(n_states)
    before = np.empty((n_states, n_frames), dtype=np.min_scalar_type(n_states))
    hsmm_kernels.best_scores(
        logs.initial,
        logs.transitions,
        padded,
        risen,
        n_risen,
        logs.emissions,
        logs.observations,
        offer,
        emitted,
        before,
    )
    starts, states = np.empty((2, n_frames), dtype=np.int64)
    score, n_segments = hsmm_kernels.trace_back(logs.durations, logs.last, offer, emitted, before, starts, states)
    if n_segments == 0:
        raise ValueError(f"the model has no path over {n_frames} frames; floor its probabilities")
    return _path(model, starts, states, n_segments, score)


def _risen(durations: Floats) -> tuple[Integers, Integers]:
    """Return the durations above the minimum of each state, and their number (``hsmm_kernels.best_scores``)."""
    above = durations > durations.min(axis=1, keepdims=True)
    number = above.sum(axis=1)
    n_bins = durations.shape[1]
    number[(number * hsmm_kernels.SPARSE > n_bins) | (n_bins < hsmm_kernels.BLOCK)] = -1
    frames = np.zeros((len(durations), max(0, number.max())), dtype=np.int64)
    for row, found, n in zip(frames, above, number, strict=True):
        row[: max(0, n)] = np.flatnonzero(found)[: max(0, n)] + 1
    return frames, number


def sample(
    model: HSMM,
    observations: npt.ArrayLike,
    rng: np.random.Generator,
    weight: float = 1.0,
    censoring: Censoring = "none",
) -> Path:
    """Return a path drawn with probability proportional to exp(score), by forward filtering, backward sampling.

    Parameters
    ----------
    rng : random number generator; two numbers are drawn per frame, and two more.
    """
    logs = _logs(model, observations, weight, censoring)
    n_frames = len(logs.observations)
    ending, offer, of_state, total = _filter(logs)
    if total == -np.inf:
        raise ValueError(f"the model has no path over {n_frames} frames; floor its probabilities")
    starts, states = np.empty((2, n_frames), dtype=np.int64)
    uniforms = rng.random((n_frames + 1, 2))
    n_segments = hsmm_kernels.draw_back(
        logs.transitions, logs.durations, logs.last, ending, offer, of_state, uniforms, starts, states
    )
    score = _score(logs, starts[-n_segments:], states[-n_segments:])
    return _path(model, starts, states, n_segments, score)


def log_likelihood(
    model: HSMM, observations: npt.ArrayLike, weight: float = 1.0, censoring: Censoring = "none"
) -> float:
    """Return the log of the sum of exp(score) over all paths: the log-likelihood if ``weight`` is 1."""
    return _filter(_logs(model, observations, weight, censoring))[3]


class _Logs(NamedTuple):
    """The arguments of the kernels."""

    initial: Floats
    transitions: Floats
    durations: Floats
    last: Floats
    emissions: Floats
    observations: Integers


def _logs(model: HSMM, observations: npt.ArrayLike, weight: float, censoring: Censoring) -> _Logs:
    codes = encode(observations, model.symbols, "observations")
    if len(codes) == 0:
        raise UserError("observations: there is no frame to decode")
    last = model.durations
    if censoring == "right":
        last = np.minimum(np.cumsum(last[:, ::-1], axis=1)[:, ::-1], 1.0)  # P(duration >= k)
    with np.errstate(divide="ignore"):
        return _Logs(
            np.log(model.initial),
            np.log(model.transitions),
            np.log(model.durations),
            np.ascontiguousarray(np.log(last)),
            _emissions(model, weight),
            codes,
        )


def _emissions(model: HSMM, weight: float) -> Floats:
    """Return the weighted logarithms of the emissions, (S, K)."""
    if weight == 0:
        return np.zeros_like(model.emissions)
    if not (model.emissions > 0).all():
        raise ValueError("an emission probability is 0; floor the model")
    return weight * np.log(model.emissions)


def _score(logs: _Logs, starts: Integers, states: Integers) -> float:
    lengths = np.diff(np.append(starts, len(logs.observations)))
    if lengths.max() > logs.durations.shape[1]:
        return -np.inf
    return float(
        logs.initial[states[0]]
        + logs.transitions[states[:-1], states[1:]].sum()
        + logs.durations[states[:-1], lengths[:-1] - 1].sum()
        + logs.last[states[-1], lengths[-1] - 1]
        + logs.emissions[np.repeat(states, lengths), logs.observations].sum()
    )


def _filter(logs: _Logs) -> tuple[Floats, Floats, Floats, float]:
    """Return ending, offer and of_state for ``draw_back``, and the log of the summed score of all paths."""
    n_states, n_bins = logs.durations.shape
    n_frames = len(logs.observations)
    ending, offer = np.full((2, n_states, n_frames), -np.inf)
    emitted, of_state = np.zeros((2, n_states))
    sums = np.zeros((n_states, n_frames + n_bins))
    hsmm_kernels.summed_scores(
        logs.initial,
        logs.transitions,
        logs.durations,
        logs.emissions,
        logs.observations,
        ending,
        offer,
        emitted,
        sums,
    )
    return ending, offer, of_state, float(hsmm_kernels.closing_scores(logs.last, offer, emitted, of_state))


def _path(model: HSMM, starts: Integers, states: Integers, n_segments: int, score: float) -> Path:
    """Return the path that a kernel wrote to the last ``n_segments`` places of ``starts`` and ``states``."""
    labels = np.array(model.states, dtype=object)[states[-n_segments:]]
    return Path(starts[-n_segments:].copy(), labels, float(score))
