"""A parallel HMM over streams of symbols (Sargin 2006, 4.2.2): branches as in ``parallel``, discrete observations.

All streams share the states. Given the state s, they are independent, and stream k with the symbol y_k contributes
P(y_k | s) to the power of its weight (eq. 4.18). With weights other than 1, these products are not probabilities, and
what training increases is their sum over all paths.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.markov import expectation_maximisation, fixed_lag, parallel_start, parallel_symbols_kernels
from cospeech.markov.expectation_maximisation import Fit
from cospeech.markov.parallel import LEAST_STAY, MOST_STAY, by_branch, flat, in_vectors, of_vectors, separation

LEAST_PROBABILITY = 1e-12
"""The minimum probability of a symbol, so that no sequence is impossible."""


INITIAL_SHARE = 0.1
"""Weight of the uniform distribution in the emissions of an initial model, because training never leaves 0."""


class SymbolHMM(NamedTuple):
    """A model: ``entry`` (M,), ``stay`` (M, N), and per stream ``emissions`` (M, N, K) and ``weights``."""

    entry: Floats
    stay: Floats
    emissions: tuple[Floats, ...]
    weights: tuple[float, ...]


class Counts(NamedTuple):
    """Expected counts of an E-step; state s = n * M + m is the n-th of branch m.

    Attributes
    ----------
    score : logarithm of the sum over all paths.
    entered : (M,) passes through each branch.
    occupied : (Y, S) frames with each combination of symbols in each state (see ``combined``).
    final : (S,) sequences that end in each state.
    """

    score: float
    entered: Floats
    occupied: Floats
    final: Floats


class Path(NamedTuple):
    """The most likely path: ``branch`` and ``state`` (T,) within it, ``begins`` (T,), and its log score."""

    branch: Integers
    state: Integers
    begins: Flags
    score: float


def split(model: SymbolHMM, stream: int) -> SymbolHMM:
    """Return the model of one stream alone, which has the same states (Sargin 2006, below eq. 4.18)."""
    return model._replace(emissions=(model.emissions[stream],), weights=(model.weights[stream],))


def combined(model: SymbolHMM, symbols: Integers) -> Integers:
    """Return one number (T,) for the symbols (T, streams) of each frame, the last stream counting in ones."""
    sizes = [values.shape[-1] for values in model.emissions]
    return np.ascontiguousarray(np.ravel_multi_index(tuple(symbols.T), sizes))


def log_densities(model: SymbolHMM) -> Floats:
    """Return the logarithm of eq. 4.18 for all combinations of symbols in all states, (Y, S)."""
    table = np.zeros((1, model.stay.size))
    for values, weight in zip(model.emissions, model.weights, strict=True):
        own = weight * np.log(np.maximum(flat(values), LEAST_PROBABILITY)).T
        table = (table[:, None] + own[None]).reshape(-1, model.stay.size)
    return table


def start(
    sequences: list[Integers],
    sizes: tuple[int, ...],
    weights: tuple[float, ...],
    n_branches: int,
    states: int,
    length: int,
    rng: np.random.Generator,
) -> SymbolHMM:
    """Return a model to train, whose branches are clusters of random segments of ``length`` frames on average.

    Parameters
    ----------
    sequences : (T, streams) symbols each.
    sizes : number of symbols of each stream.

    Raises
    ------
    UserError : if the sequences are too short for one segment per branch.
    """
    marked = [
        np.concatenate([np.eye(size)[symbols[:, stream]] for stream, size in enumerate(sizes)], axis=1)
        for symbols in sequences
    ]
    seen: Flags = np.asarray(np.concatenate(marked).any(axis=0))
    clusters = parallel_start.from_clusters(
        [frames[:, seen] for frames in marked], n_branches, states, length, np.zeros(int(seen.sum())), rng
    )
    share = np.zeros((n_branches, states, len(seen)))
    share[..., seen] = clusters.mean
    edges = np.cumsum(sizes)[:-1]
    emissions = tuple(_smoothed(part, INITIAL_SHARE) for part in np.split(share, edges, axis=-1))
    return SymbolHMM(clusters.entry, clusters.stay, emissions, weights)


def _smoothed(probabilities: Floats, share: float) -> Floats:
    """Return a mixture with the uniform distribution, which has the weight ``share``."""
    return (1.0 - share) * probabilities + share / probabilities.shape[-1]


def expect(model: SymbolHMM, sequences: list[Integers]) -> Counts:
    """Return the expected counts of all sequences (T, streams) (the E-step of Baum-Welch)."""
    n_branches = len(model.entry)
    by_symbol = np.exp(log_densities(model))
    densities = np.array([in_vectors(values, n_branches, 0.0) for values in by_symbol])
    stay, leave = (in_vectors(values, n_branches, 0.0) for values in (flat(model.stay), 1.0 - flat(model.stay)))
    entry = in_vectors(model.entry, n_branches, 0.0)
    entered, occupied, final = np.zeros_like(entry), np.zeros_like(densities), np.zeros_like(stay)
    score = 0.0
    for symbols in sequences:
        score += parallel_symbols_kernels.expect(
            combined(model, symbols), densities, entry, stay, leave, entered, occupied, final
        )
    return Counts(
        score,
        of_vectors(entered, n_branches),
        np.array([of_vectors(values, n_branches) for values in occupied]),
        of_vectors(final, n_branches),
    )


def maximise(model: SymbolHMM, counts: Counts, pseudo: float) -> SymbolHMM:
    """Return the model with the highest objective under the expected counts (the M-step of Baum-Welch).

    ``pseudo`` is added to the count of every symbol in every state and stream.
    """
    n_branches = len(model.entry)
    ended = np.cumsum(counts.final.reshape(-1, n_branches), axis=0)
    left = np.maximum(counts.entered - ended, 0.0)  # what enters a branch leaves each state, unless it ends before
    arrived = np.concatenate([counts.entered[None], left[:-1]])
    frames = counts.occupied.sum(axis=0).reshape(-1, n_branches)
    stayed = np.maximum(frames - arrived, 0.0)
    moves = stayed + left
    stay = np.clip(stayed / np.where(moves > 0.0, moves, 1.0), LEAST_STAY, MOST_STAY)
    joint = counts.occupied.reshape(*(values.shape[-1] for values in model.emissions), -1)
    emissions = []
    for stream, values in enumerate(model.emissions):
        others = tuple(axis for axis in range(len(model.emissions)) if axis != stream)
        seen = joint.sum(axis=others).T + pseudo
        total = seen.sum(axis=1, keepdims=True)
        share = np.where(total > 0.0, seen / np.where(total > 0.0, total, 1.0), flat(values))
        emissions.append(by_branch(share, n_branches))
    return model._replace(
        entry=counts.entered / counts.entered.sum(),
        stay=np.where(moves > 0.0, stay, model.stay.T).T.copy(),
        emissions=tuple(emissions),
    )


def objective(model: SymbolHMM, score: float, pseudo: float) -> float:
    """Return what training increases: the log score, and the pseudo-counts times the logarithms of all emissions."""
    if pseudo == 0.0:
        return score
    prior = sum(
        weight * float(np.log(np.maximum(values, LEAST_PROBABILITY)).sum())
        for values, weight in zip(model.emissions, model.weights, strict=True)
    )
    return score + pseudo * prior


def fit(
    model: SymbolHMM, sequences: list[Integers], iterations: int, tolerance: float = 0.0, pseudo: float = 0.0
) -> Fit[SymbolHMM]:
    """Train ``model`` by Baum-Welch.

    Parameters
    ----------
    sequences : (T, streams) symbols each.
    iterations : maximum number of updates.
    tolerance : stop when the gain of the objective per frame falls below this.
    pseudo : count that is added to every symbol in every state and stream (a Dirichlet prior).
    """
    n_frames = sum(len(symbols) for symbols in sequences)
    return expectation_maximisation.fit(
        model,
        lambda now: expect(now, sequences),
        lambda now, counts: objective(now, counts.score, pseudo),
        lambda now, counts: maximise(now, counts, pseudo),
        iterations,
        tolerance * n_frames,
    )


def decode(model: SymbolHMM, symbols: Integers) -> Path:
    """Return the most likely path for a sequence (T, streams)."""
    densities = log_densities(model)[combined(model, symbols)]
    states, score = fixed_lag.best_path(model.entry, model.stay, densities)
    n_branches = len(model.entry)
    return Path(states % n_branches, states // n_branches, fixed_lag.begins(states, n_branches), score)


def branch_scores(model: SymbolHMM, symbols: Integers, starts: Flags) -> Floats:
    """Return log P(segment | branch) of every segment of a sequence (T, streams) for every branch, (L, M).

    ``starts`` (T,) are true where a segment begins.
    """
    densities = log_densities(model)[combined(model, symbols)]
    edges = np.append(np.flatnonzero(starts), len(symbols))
    found = np.empty((len(edges) - 1, len(model.entry)))
    stay = flat(model.stay)
    parallel_symbols_kernels.branch_scores(densities, edges, np.log(stay), np.log1p(-stay), found)
    return found


def beta(model: SymbolHMM, sequences: list[Integers], paths: list[Path]) -> float:
    """Return the fitness measure beta of Sargin 2006, 4.15-4.16; see ``parallel.beta``."""
    scores = [branch_scores(model, symbols, path.begins) for symbols, path in zip(sequences, paths, strict=True)]
    return separation(scores, sum(len(symbols) for symbols in sequences))
