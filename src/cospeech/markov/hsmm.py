"""Hidden semi-Markov model: states that last, and emit one symbol a frame while they do (Özkul 2012, chapter 5).

The score of a path, a sequence of phrases (state j_l, duration k_l) that covers frames 0 ... T - 1, is

    log pi(j_1) + sum_l log a(j_{l-1}, j_l) + sum_l log d_{j_l}(k_l) + w * sum_t log b_{j(t)}(xi_t)

with w = 1 as in eq. 5.9. Another emission weight w is a stream exponent as in Sargin 2006, eq. 4.18: a prosody label
holds for a whole intonation phrase, but is counted once a frame. ``censoring``: with ``none`` the last phrase ends
with the record; with ``right`` the record cuts it off, and P(duration >= k) takes the place of d(k).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.markov import hsmm_kernels

Censoring = Literal["none", "right"]
Smoothing = Literal["none", "additive", "kernel"]

TABLES = ("initial", "transitions", "emissions", "durations")
"""The four tables that are a model: each has a schema and a field of the model of its name."""


@dataclass(frozen=True)
class SemiMarkov:
    """A model as its final probabilities.

    Attributes
    ----------
    states : (S,) names of the states: gesture classes.
    symbols : (K,) names of what they emit: prosody clusters.
    initial : (S,) pi, eq. 5.4.
    transitions : (S, S) a, eq. 5.1, from row to column; a state may follow itself.
    emissions : (S, K) b, eq. 5.2.
    durations : (S, D) d, eq. 5.3; column k - 1 is a duration of k frames.
    """

    states: tuple[str, ...]
    symbols: tuple[str, ...]
    initial: Floats
    transitions: Floats
    emissions: Floats
    durations: Floats


class Path(NamedTuple):
    """A sequence of phrases: first frames (L,), their states' names (L,), and the score of it all."""

    starts: Integers
    labels: npt.NDArray[np.object_]
    log_score: float


@dataclass(frozen=True)
class Counts:
    """What eq. 5.5-5.8 count, of one record or of several added up; shapes as in ``SemiMarkov``."""

    states: tuple[str, ...]
    symbols: tuple[str, ...]
    initial: Floats
    transitions: Floats
    emissions: Floats
    durations: Floats

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.states, self.symbols, *(getattr(self, name) + getattr(other, name) for name in TABLES))


def encode(labels: npt.ArrayLike, names: tuple[str, ...], where: str) -> Integers:
    """Return the place of each label in ``names``, shape (n,).

    Raises
    ------
    UserError : where a label is not among them.
    """
    given = np.asarray(labels, dtype=object)
    heads = np.flatnonzero(np.append(True, given[1:] != given[:-1])[: len(given)])  # as labels last, one look a run
    place = {name: number for number, name in enumerate(names)}
    codes = np.array([place.get(given[head], -1) for head in heads], dtype=np.int64)
    if (codes < 0).any():
        first = heads[int(np.flatnonzero(codes < 0)[0])]
        raise UserError(f"{where}: label '{given[first]}' at {first}; known are {', '.join(names)}")
    return np.repeat(codes, np.diff(np.append(heads, len(given))))


def count(
    phrases: pd.DataFrame,
    observations: npt.ArrayLike,
    states: tuple[str, ...],
    symbols: tuple[str, ...],
    n_bins: int,
) -> Counts:
    """Count one record (Özkul 2012, C, O and G of eq. 5.5-5.8).

    Parameters
    ----------
    phrases : segment table of the record on the frames of ``observations``.
    observations : (T,) symbol of every frame.
    states, symbols : names that may occur.
    n_bins : D; a longer phrase is counted in the last bin, the longest that a decoder can give.

    Notes
    -----
    Neighbours of one label are two phrases. The first and the last phrase, which the ends of the record may have
    cut, are counted like the others, as in the thesis.
    """
    where = f"record {phrases['record'].iloc[0]}"
    codes = encode(phrases["label"], states, where)
    lengths = (phrases["end_frame"] - phrases["start_frame"]).to_numpy(dtype=np.int64)
    emitted = encode(observations, symbols, where)
    if lengths.sum() != len(emitted):
        raise UserError(f"{where}: its phrases cover {lengths.sum()} frames, its prosody {len(emitted)}")
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


def estimate(counts: Counts, floor: float, smoothing: Smoothing = "none", amount: float = 1.0) -> SemiMarkov:
    """Return the relative frequencies of ``counts`` (Özkul 2012, eq. 5.5-5.8), floored.

    Parameters
    ----------
    floor : every probability is raised to at least this, then its distribution is scaled to sum to 1; so no
        decoding ends in minus infinity. With 0 nothing is floored.
    smoothing : of the durations. ``none``: the raw histogram; ``additive``: ``amount`` is added to every bin's
        count; ``kernel``: each phrase is spread over the bins by a Gaussian of standard deviation ``amount`` bins.

    Notes
    -----
    A state without a phrase is left out: nothing is known of it, and its flat emissions would win long stretches.
    """
    seen = np.flatnonzero(counts.durations.sum(axis=1) > 0)
    if len(seen) == 0:
        raise ValueError("no phrase was counted")
    counted = SemiMarkov(
        states=tuple(counts.states[i] for i in seen),
        symbols=counts.symbols,
        initial=counts.initial[seen],
        transitions=counts.transitions[np.ix_(seen, seen)],
        emissions=counts.emissions[seen],
        durations=_smoothed(counts.durations[seen], smoothing, amount),
    )
    return floored(counted, floor)


def floored(model: SemiMarkov, floor: float) -> SemiMarkov:
    """Return ``model`` with each distribution normalised and no probability below ``floor``; see ``estimate``."""
    return SemiMarkov(model.states, model.symbols, *(_floored(getattr(model, name), floor) for name in TABLES))


def _floored(weights: Floats, floor: float) -> Floats:
    """Normalise over the last axis (flat where all are 0), raise to the floor, normalise again."""
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
    return histograms @ (
        kernel / kernel.sum(axis=1, keepdims=True)
    )  # each row sums to 1: no phrase is lost at an edge


def to_tables(model: SemiMarkov, frame_s: float, floor: float | None = None) -> dict[str, pd.DataFrame]:
    """Return the model as tables of the schemas ``TABLES``; ``floor`` is the floor that was used."""
    states, symbols = (np.array(names, dtype=object) for names in (model.states, model.symbols))
    n_states, n_bins = model.durations.shape
    bins = np.tile(np.arange(1, n_bins + 1), n_states)
    keys = {
        "initial": {"gesture": states},
        "transitions": {"from_gesture": np.repeat(states, n_states), "to_gesture": np.tile(states, n_states)},
        "emissions": {"gesture": np.repeat(states, len(symbols)), "prosody": np.tile(symbols, n_states)},
        "durations": {"gesture": np.repeat(states, n_bins), "bin": bins, "duration_s": bins * frame_s},
    }
    shared = {"floor": np.nan if floor is None else floor, "actor": None}
    return {
        name: pd.DataFrame({**key, "probability": getattr(model, name).ravel(), **shared})
        for name, key in keys.items()
    }


def from_tables(tables: Mapping[str, pd.DataFrame]) -> SemiMarkov:
    """Return the model that ``tables`` (of the schemas ``TABLES``) hold; states in the order of ``initial``.

    Raises
    ------
    UserError : where a table lacks a probability of the model, or has one of a state that ``initial`` lacks.
    """
    states = tuple(tables["initial"]["gesture"])
    symbols = tuple(dict.fromkeys(tables["emissions"]["prosody"]))
    bins = tuple(range(1, int(tables["durations"]["bin"].max()) + 1))
    return SemiMarkov(
        states=states,
        symbols=symbols,
        initial=tables["initial"]["probability"].to_numpy(dtype=float).copy(),
        transitions=_matrix(tables, "transitions", "from_gesture", states, "to_gesture", states),
        emissions=_matrix(tables, "emissions", "gesture", states, "prosody", symbols),
        durations=_matrix(tables, "durations", "gesture", states, "bin", bins),
    )


def _matrix(
    tables: Mapping[str, pd.DataFrame], name: str, row: str, rows: tuple[str, ...], column: str, columns: tuple
) -> Floats:
    table = tables[name]
    row_of, column_of = ({key: place for place, key in enumerate(keys)} for keys in (rows, columns))
    if not set(table[row]) <= set(rows) or not set(table[column]) <= set(columns):
        raise UserError(f"{name} table: has a row of a gesture that the table of initial probabilities lacks")
    matrix = np.full((len(rows), len(columns)), np.nan)
    matrix[table[row].map(row_of), table[column].map(column_of)] = table["probability"]
    missing = np.argwhere(np.isnan(matrix))
    if len(missing):
        raise UserError(f"{name} table: lacks {row} '{rows[missing[0, 0]]}', {column} '{columns[missing[0, 1]]}'")
    return matrix


def decode(
    model: SemiMarkov, observations: npt.ArrayLike, weight: float = 1.0, censoring: Censoring = "none"
) -> Path:
    """Return the best path (Özkul 2012, eq. 5.9 and Alg. 1, in which any t <= D may end the first phrase).

    Parameters
    ----------
    observations : (T,) symbol of every frame.
    weight : emission weight w.
    censoring : whether the record's end may cut the last phrase.

    Notes
    -----
    Equal paths are told apart from the end: the last state that the model names first wins, then the shortest
    last phrase, and so on towards the beginning.
    """
    return decode_each(model, observations, [weight], censoring)[0]


def decode_each(
    model: SemiMarkov, observations: npt.ArrayLike, weights: Sequence[float], censoring: Censoring = "none"
) -> list[Path]:
    """Return the best path under each emission weight; see ``decode``."""
    logs = _logs(model, observations, 0.0, censoring)
    risen = _risen(logs.durations)
    return [_best_path(model, logs._replace(emissions=_emissions(model, weight)), *risen) for weight in weights]


def _best_path(model: SemiMarkov, logs: _Logs, risen: Integers, n_risen: Integers) -> Path:
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
    score, n_phrases = hsmm_kernels.trace_back(logs.durations, logs.last, offer, emitted, before, starts, states)
    if n_phrases == 0:
        raise ValueError(f"the model has no path over {n_frames} frames; floor its probabilities")
    return _path(model, starts, states, n_phrases, score)


def _risen(durations: Floats) -> tuple[Integers, Integers]:
    """Return the durations above the least of each state, and how many (see ``semi_kernels.best_scores``)."""
    above = durations > durations.min(axis=1, keepdims=True)
    number = above.sum(axis=1)
    n_bins = durations.shape[1]
    number[(number * hsmm_kernels.SPARSE > n_bins) | (n_bins < hsmm_kernels.BLOCK)] = -1
    frames = np.zeros((len(durations), max(0, number.max())), dtype=np.int64)
    for row, found, n in zip(frames, above, number, strict=True):
        row[: max(0, n)] = np.flatnonzero(found)[: max(0, n)] + 1
    return frames, number


def sample(
    model: SemiMarkov,
    observations: npt.ArrayLike,
    rng: np.random.Generator,
    weight: float = 1.0,
    censoring: Censoring = "none",
) -> Path:
    """Return a path drawn with probability proportional to exp(score): forward filter, backward draw.

    Parameters
    ----------
    rng : source of the draw; two numbers are taken for every frame and the end.
    """
    logs = _logs(model, observations, weight, censoring)
    n_frames = len(logs.observations)
    ending, offer, of_state, total = _filter(logs)
    if total == -np.inf:
        raise ValueError(f"the model has no path over {n_frames} frames; floor its probabilities")
    starts, states = np.empty((2, n_frames), dtype=np.int64)
    uniforms = rng.random((n_frames + 1, 2))
    n_phrases = hsmm_kernels.draw_back(
        logs.transitions, logs.durations, logs.last, ending, offer, of_state, uniforms, starts, states
    )
    score = _score(logs, starts[-n_phrases:], states[-n_phrases:])
    return _path(model, starts, states, n_phrases, score)


def log_likelihood(
    model: SemiMarkov, observations: npt.ArrayLike, weight: float = 1.0, censoring: Censoring = "none"
) -> float:
    """Return the log of the sum of exp(score) over all paths: the log-likelihood where ``weight`` is 1."""
    return _filter(_logs(model, observations, weight, censoring))[3]


def path_score(
    tables: Mapping[str, pd.DataFrame],
    phrases: pd.DataFrame,
    observations: npt.ArrayLike,
    weight: float = 1.0,
    censoring: Censoring = "none",
) -> float:
    """Return the score of the path ``phrases`` (a segment table over ``observations``) by the tables alone."""
    model = from_tables(tables)
    segments.check(phrases, "phrases")
    states = encode(phrases["label"], model.states, "phrases")
    return _score(_logs(model, observations, weight, censoring), phrases["start_frame"].to_numpy(), states)


class _Logs(NamedTuple):
    """The arguments of the kernels."""

    initial: Floats
    transitions: Floats
    durations: Floats
    last: Floats
    emissions: Floats
    observations: Integers


def _logs(model: SemiMarkov, observations: npt.ArrayLike, weight: float, censoring: Censoring) -> _Logs:
    codes = encode(observations, model.symbols, "prosody")
    if len(codes) == 0:
        raise UserError("prosody: holds no frame; there is nothing to decode")
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


def _emissions(model: SemiMarkov, weight: float) -> Floats:
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
    """Return what ``draw_back`` asks for (ending, offer, of_state), and the log of the summed score of all paths."""
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


def _path(model: SemiMarkov, starts: Integers, states: Integers, n_phrases: int, score: float) -> Path:
    """Return the ``n_phrases`` that the kernels left at the ends of ``starts`` and ``states``."""
    labels = np.array(model.states, dtype=object)[states[-n_phrases:]]
    return Path(starts[-n_phrases:].copy(), labels, float(score))
