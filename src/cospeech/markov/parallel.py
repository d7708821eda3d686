"""The parallel HMM of Özkul 2012, 4.1 (Sargin 2006, 4.2.1): M left-to-right branches of N states from a shared node.

A sequence starts at the node, enters the first state of branch m with probability ``entry[m]``, passes through the
states of the branch in order, staying in each with probability ``stay``, and returns from the last state to the node.
It may end in any state. One pass through a branch is one segment. Densities are Gaussian with diagonal covariance.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import parallel_exact, parallel_scaled, parallel_viterbi
from cospeech.markov.lanes import LANES
from cospeech.markov.parallel_scaled import FREE, MUST, NEVER

__all__ = ["FREE", "MUST", "NEVER", "Clamp", "Counts", "ParallelHMM", "Path"]


LEAST_OCCUPANCY = 1e-3
"""States with fewer expected frames keep their parameters in the M-step."""

LEAST_STAY, MOST_STAY = 1e-6, 1.0 - 1e-6
"""Limits of the self-transition probability, so that no state is absorbing."""


class ParallelHMM(NamedTuple):
    """A model: ``entry`` (M,), ``stay`` (M, N), ``mean`` and ``variance`` (M, N, D)."""

    entry: Floats
    stay: Floats
    mean: Floats
    variance: Floats


class Clamp(NamedTuple):
    """Constraints on the path of a sequence of T frames.

    Attributes
    ----------
    allowed : (T, M) of bool, the branches that may be active in each frame; (0, M) if all may.
    cuts : (T,) of int8, whether segments begin in each frame: ``FREE``, ``MUST`` or ``NEVER``; (0,) if all are free.
    """

    allowed: npt.NDArray[np.bool_]
    cuts: npt.NDArray[np.int8]


class Counts(NamedTuple):
    """Expected counts of an E-step; state s = n * M + m is the n-th of branch m.

    Attributes
    ----------
    entered : (M,) segments of each branch.
    occupied : (S,) frames in each state.
    stayed, left : (S,) transitions of each state to itself and to another one.
    first, second : (D, S) sums of the features minus ``pivot`` (D,), and of their squares, over the frames of each
        state.
    """

    log_likelihood: float
    entered: Floats
    occupied: Floats
    stayed: Floats
    left: Floats
    first: Floats
    second: Floats
    pivot: Floats


class Sums(NamedTuple):
    """The counts of ``parallel_scaled.expect``, with the states in vectors."""

    log_likelihood: float
    entered: Floats
    moments: Floats
    final: Floats


Summed = TypeVar("Summed", Counts, Sums)


class Path(NamedTuple):
    """A path: ``branch`` (T,), whether a segment ``begins`` (T,) in each frame, and its log-probability."""

    branch: npt.NDArray[np.int64]
    begins: npt.NDArray[np.bool_]
    score: float


class Fit(NamedTuple):
    """A trained model, and the log-likelihoods (iterations + 1,) during training; the last is that of the model."""

    model: ParallelHMM
    log_likelihoods: Floats


def unclamped(n_branches: int) -> Clamp:
    """Return a clamp without constraints for sequences of any length."""
    return Clamp(np.ones((0, n_branches), dtype=bool), np.zeros(0, dtype=np.int8))


def flat(values: Floats) -> Floats:
    """Return (M, N, ...) as (N * M, ...)."""
    return np.ascontiguousarray(np.swapaxes(values, 0, 1)).reshape(-1, *values.shape[2:])


def by_branch(values: Floats, n_branches: int) -> Floats:
    """Return (N * M, ...) as (M, N, ...)."""
    return np.ascontiguousarray(np.swapaxes(values.reshape(-1, n_branches, *values.shape[1:]), 0, 1))


class Packed(NamedTuple):
    """The parameters as kernels take them: state s = n * M + m is the n-th of branch m; densities in log2."""

    entry: Floats
    stay: Floats
    leave: Floats
    weight: Floats
    shift: Floats
    constant: Floats
    pivot: Floats


def _packed(model: ParallelHMM) -> Packed:
    pivot = model.mean.reshape(-1, model.mean.shape[-1]).mean(axis=0)
    variance, stay = flat(model.variance), flat(model.stay)
    weight = np.sqrt(0.5 / np.log(2.0) / variance)
    shift = (flat(model.mean) - pivot) * weight
    constant = -0.5 * np.log2(2 * np.pi * variance).sum(axis=1)
    return Packed(model.entry, stay, 1.0 - stay, weight, shift, constant, pivot)


def _in_logs(packed: Packed, base: float) -> Packed:
    """Return the parameters with probabilities as logarithms."""
    with np.errstate(divide="ignore"):
        entry, stay, leave = (np.log(values) / np.log(base) for values in packed[:3])
    return packed._replace(entry=entry, stay=stay, leave=leave)


def _in_lanes(packed: Packed) -> Packed:
    """Return the parameters with states in vectors; the branches that pad the last vector are never entered."""
    n_branches = len(packed.entry)
    stay, leave, weight, shift = (in_vectors(values, n_branches, 0.0) for values in packed[1:5])
    constant = in_vectors(packed.constant, n_branches, -np.inf)
    return Packed(in_vectors(packed.entry, n_branches, 0.0), stay, leave, weight, shift, constant, packed.pivot)


class Forms(NamedTuple):
    """The parameters state by state (``packed``), and in vectors for scaled probabilities (``scaled``).

    The densities of ``scaled`` are relative to ``ceiling``, a log2 density that no state exceeds.
    """

    n_branches: int
    packed: Packed
    scaled: Packed
    ceiling: float


def _forms(model: ParallelHMM) -> Forms:
    packed = _packed(model)
    ceiling = float(packed.constant.max())
    relative = packed._replace(constant=packed.constant - ceiling)
    return Forms(len(model.entry), packed, _in_lanes(relative), ceiling)


def in_vectors(values: Floats, n_branches: int, missing: float) -> Floats:
    """Return (N * M,) or (N * M, D) as (V, LANES) or (V, D, LANES)."""
    by_place = values.reshape(-1, n_branches, *values.shape[1:])
    n_groups = -(-n_branches // LANES)
    filled = np.full((len(by_place), n_groups * LANES, *values.shape[1:]), missing)
    filled[:, :n_branches] = by_place
    grouped = filled.reshape(-1, LANES, *values.shape[1:])
    return np.ascontiguousarray(grouped.swapaxes(1, -1))


def of_vectors(vectors: Floats, n_branches: int) -> Floats:
    """Return the values that ``in_vectors`` was called with."""
    n_groups, rest = -(-n_branches // LANES), vectors.shape[1:-1]
    by_place = vectors.swapaxes(1, -1).reshape(-1, n_groups * LANES, *rest)
    return by_place[:, :n_branches].reshape(-1, *rest)


def _clamps(model: ParallelHMM, sequences: list[Floats], clamps: list[Clamp] | None) -> list[Clamp]:
    return clamps if clamps is not None else [unclamped(len(model.entry))] * len(sequences)


class Densities:
    """The log densities of frames in all states; the parameters are prepared once."""

    def __init__(self, model: ParallelHMM) -> None:
        self._packed = _packed(model)[3:]
        self._n_states = model.stay.size

    def of(self, frames: Floats) -> Floats:
        """Return the natural log densities (T, S) of frames (T, D); state s = n * M + m is the n-th of branch m."""
        found = np.empty((len(frames), self._n_states))
        parallel_exact.fill_log_densities(frames, *self._packed, found)
        return found


def log_likelihood(model: ParallelHMM, frames: Floats, clamp: Clamp | None = None) -> float:
    """Return log P(frames | model) of a sequence (T, D), summed over the paths that ``clamp`` admits."""
    forms, known = _forms(model), clamp or unclamped(len(model.entry))
    found = _expect_scaled(forms, frames, known).log_likelihood
    return found if np.isfinite(found) else _expect_exact(forms, frames, known).log_likelihood


def expect(model: ParallelHMM, sequences: list[Floats], clamps: list[Clamp] | None = None) -> Counts:
    """Return the expected counts of all sequences (the E-step of Baum-Welch).

    Scaled probabilities are used for each sequence, or logarithms if these are not reliable.

    Raises
    ------
    UserError : if the clamp of a sequence admits no path.
    """
    forms = _forms(model)
    sums: Sums = _nothing(forms)
    counts: list[Counts] = []
    for index, (frames, clamp) in enumerate(zip(sequences, _clamps(model, sequences, clamps), strict=True)):
        found = _expect_scaled(forms, frames, clamp)
        if np.isfinite(found.log_likelihood):
            sums = _sum(sums, found)
            continue
        counts.append(_expect_exact(forms, frames, clamp))
        if counts[-1].log_likelihood == -np.inf:
            raise UserError(
                f"sequence {index} of {len(frames)} frames: no path through the model satisfies its constraints"
            )
    total = _counts(forms, sums)
    for exact in counts:
        total = _sum(total, exact)._replace(pivot=total.pivot)
    return total


def _sum(one: Summed, other: Summed) -> Summed:
    """Add two tuples field by field."""
    pairs: list[tuple[Any, Any]] = list(zip(one, other, strict=True))
    return type(one)(*(a + b for a, b in pairs))


def _nothing(forms: Forms) -> Sums:
    entry, stay, pivot = forms.scaled.entry, forms.scaled.stay, forms.scaled.pivot
    return Sums(0.0, np.zeros_like(entry), np.zeros((len(stay), 1 + 2 * len(pivot), LANES)), np.zeros_like(stay))


def _expect_scaled(forms: Forms, frames: Floats, clamp: Clamp) -> Sums:
    sums = _nothing(forms)
    found = parallel_scaled.expect(frames, *clamp, *forms.scaled, *sums[1:]) + forms.ceiling * len(frames)
    return sums._replace(log_likelihood=found * np.log(2.0))


def _counts(forms: Forms, sums: Sums) -> Counts:
    n_branches, n_features = forms.n_branches, len(forms.scaled.pivot)
    begun = of_vectors(sums.entered, n_branches)
    moments = of_vectors(sums.moments, n_branches).T
    # What enters a branch passes through all of its states, except for what is in it at the end of the sequence.
    ended = np.cumsum(of_vectors(sums.final, n_branches).reshape(-1, n_branches), axis=0)
    left = np.maximum(begun - ended, 0.0)
    arrived = np.concatenate([begun, left.ravel()[:-n_branches]])
    occupied, first, second = moments[0], moments[1 : 1 + n_features], moments[1 + n_features :]
    stayed = np.maximum(occupied - arrived, 0.0)
    return Counts(sums.log_likelihood, begun, occupied, stayed, left.ravel(), first, second, forms.scaled.pivot)


def _expect_exact(forms: Forms, frames: Floats, clamp: Clamp) -> Counts:
    given = _in_logs(forms.packed, np.e)
    n_branches, n_states, n_features = forms.n_branches, len(given.stay), len(given.pivot)
    counts = (
        np.zeros(n_branches), np.zeros(n_states), np.zeros(n_states), np.zeros(n_states),
        np.zeros((n_features, n_states)), np.zeros((n_features, n_states)),
    )  # fmt: skip
    found = parallel_exact.expect(frames, *clamp, *given, *counts)
    return Counts(found * np.log(2.0), *counts, given.pivot)


def maximise(model: ParallelHMM, counts: Counts, floor: Floats) -> ParallelHMM:
    """Return the maximum likelihood model of the expected counts (the M-step of Baum-Welch).

    Variances are at least ``floor`` (D,); this is the constrained maximum, so that the likelihood cannot decrease.
    States without frames keep their parameters.
    """
    n_branches = len(model.entry)
    moves = counts.stayed + counts.left
    occupied, moved = counts.occupied > LEAST_OCCUPANCY, moves > LEAST_OCCUPANCY
    frames = np.where(occupied, counts.occupied, 1.0)
    shift = (counts.first / frames).T
    variance = np.maximum((counts.second / frames).T - shift**2, floor)
    stay = np.clip(counts.stayed / np.where(moved, moves, 1.0), LEAST_STAY, MOST_STAY)
    seen = occupied[:, None]
    return ParallelHMM(
        counts.entered / counts.entered.sum(),
        by_branch(np.where(moved, stay, flat(model.stay)), n_branches),
        by_branch(np.where(seen, counts.pivot + shift, flat(model.mean)), n_branches),
        by_branch(np.where(seen, variance, flat(model.variance)), n_branches),
    )


def fit(
    model: ParallelHMM,
    sequences: list[Floats],
    floor: Floats,
    iterations: int,
    tolerance: float = 0.0,
    clamps: list[Clamp] | None = None,
) -> Fit:
    """Train ``model`` by Baum-Welch.

    Parameters
    ----------
    sequences : (T, D) each, with the features of the model.
    floor : (D,) minimum variance of each feature.
    iterations : maximum number of updates.
    tolerance : stop when the log-likelihood gain per frame falls below this.
    clamps : one per sequence, or None.
    """
    model = model._replace(
        variance=np.maximum(model.variance, floor), stay=np.clip(model.stay, LEAST_STAY, MOST_STAY)
    )
    n_frames = sum(len(frames) for frames in sequences)
    history: list[float] = []
    for _ in range(iterations):
        counts = expect(model, sequences, clamps)
        history.append(counts.log_likelihood)
        if len(history) > 1 and history[-1] - history[-2] < tolerance * n_frames:
            return Fit(model, np.array(history))
        model = maximise(model, counts, floor)
    found = zip(sequences, _clamps(model, sequences, clamps), strict=True)
    history.append(sum(log_likelihood(model, frames, clamp) for frames, clamp in found))
    return Fit(model, np.array(history))


def decode(model: ParallelHMM, frames: Floats, clamp: Clamp | None = None) -> Path:
    """Return the most likely path through the model for a sequence (T, D) (Viterbi; Özkul 2012, 4.2).

    Two successive passes through the same branch are two segments; ``begins`` marks the start of the second.

    Raises
    ------
    UserError : if the clamp admits no path.
    """
    allowed, cuts = clamp or unclamped(len(model.entry))
    branch, begins = np.empty(len(frames), dtype=np.int64), np.empty(len(frames), dtype=bool)
    packed = _in_lanes(_in_logs(_packed(model), 2.0))
    score = parallel_viterbi.decode(frames, allowed, cuts, *packed, branch, begins) * np.log(2.0)
    if score == -np.inf:
        raise UserError(f"a sequence of {len(frames)} frames: no path through the model satisfies its constraints")
    return Path(branch, begins, float(score))


def branch_log_likelihoods(model: ParallelHMM, frames: Floats, begins: npt.NDArray[np.bool_]) -> Floats:
    """Return log P(segment | branch) of every segment of a sequence for every branch, (L, M)."""
    starts = np.append(np.flatnonzero(begins), len(frames))
    found = np.empty((len(starts) - 1, len(model.entry)))
    parallel_exact.branch_likelihoods(frames, starts, *_in_logs(_packed(model), np.e)[1:], found)
    return found


def alpha(log_likelihood: float, n_frames: int) -> float:
    """Return the fitness measure alpha, the log-likelihood per frame (Sargin 2006, 4.14)."""
    return log_likelihood / n_frames


def beta(model: ParallelHMM, sequences: list[Floats], paths: list[Path]) -> float:
    """Return the fitness measure beta, the mean log-likelihood ratio of the two best branches per frame.

    See Sargin 2006, 4.15-4.16. It is NaN for a model with one branch.
    """
    pairs = zip(sequences, paths, strict=True)
    found = [branch_log_likelihoods(model, frames, path.begins) for frames, path in pairs]
    return separation(found, sum(len(frames) for frames in sequences))


def separation(log_likelihoods: list[Floats], n_frames: int) -> float:
    """Return beta of sequences whose segments have the log-likelihoods (L, M) under the branches."""
    if log_likelihoods[0].shape[1] < 2:
        return np.nan
    ranked = np.sort(np.concatenate(log_likelihoods), axis=1)
    return float((ranked[:, -1] - ranked[:, -2]).sum()) / n_frames
