"""Left-to-right hidden Markov models of words, many at a time (Sargin 2006, 2.1.1; Rabiner 1989).

A clip starts in the first state of its model, stays in a state or moves on to the next one with every frame, and may
end in any state. Densities are Gaussian with diagonal covariance. All models have the same numbers of states and
features, and are trained and evaluated in one call.

Variances are at least a given floor, and the probabilities of staying are within limits. The M-step returns the
maximum *under* these limits, so that the likelihood of no model decreases in training.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.markov import word_hmm_kernels
from cospeech.markov.lanes import LANES

LEAST_OCCUPANCY = 1e-3
"""States with fewer expected frames keep their parameters in the M-step."""

LEAST_STAY, MOST_STAY = 1e-6, 1.0 - 1e-6
"""Limits of the probability of staying in a state, except in the last one, which is never left."""


class WordHMMs(NamedTuple):
    """R models of S states: ``stay`` (R, S), ``mean`` and ``variance`` (R, S, D)."""

    stay: Floats
    mean: Floats
    variance: Floats


class Clips(NamedTuple):
    """Sequences of frames.

    Attributes
    ----------
    frames : (T, D) of all clips.
    begin, length : (C,) index of the first frame of each clip, and its number of frames.
    """

    frames: Floats
    begin: Integers
    length: Integers

    def chosen(self, clips: Integers) -> Clips:
        """Return some clips, given by index."""
        return Clips(self.frames, self.begin[clips], self.length[clips])


class Fit(NamedTuple):
    """Trained models, and log-likelihoods (iterations + 1, R) during training; the last are those of the models."""

    models: WordHMMs
    log_likelihoods: Floats


class Counts(NamedTuple):
    """Expected counts of an E-step.

    Attributes
    ----------
    log_likelihood : (R,) of the clips of each model.
    occupied, ended : (R, S) frames in each state, and clips that end in it.
    first, second : (R, S, D) sums of the frames minus ``pivot`` (D,), and of their squares, over the frames of each
        state.
    """

    log_likelihood: Floats
    occupied: Floats
    ended: Floats
    first: Floats
    second: Floats
    pivot: Floats


class _Packed(NamedTuple):
    """The parameters as kernels take them: densities and transitions in log2."""

    weight: Floats
    shift: Floats
    constant: Floats
    stay: Floats
    move: Floats


def _packed(models: WordHMMs, pivot: Floats) -> _Packed:
    weight = np.sqrt(0.5 / np.log(2.0) / models.variance)
    leave = np.maximum(1.0 - models.stay, 2.0**-1000)
    return _Packed(
        weight,
        (models.mean - pivot) * weight,
        -0.5 * np.log2(2 * np.pi * models.variance).sum(axis=-1),
        np.log2(models.stay),
        np.log2(leave),
    )


def _grouped(values: Floats) -> Floats:
    """Return (R, ...) as (G, ..., LANES); the last group is filled with copies of the last model."""
    n_groups = -(-len(values) // LANES)
    filled = values[np.minimum(np.arange(n_groups * LANES), len(values) - 1)]
    return np.ascontiguousarray(np.moveaxis(filled.reshape(n_groups, LANES, *values.shape[1:]), 1, -1))


def _pivot(models: WordHMMs) -> Floats:
    """Return the mean of all means, (D,); frames are taken relative to it, which keeps sums of squares exact."""
    return models.mean.reshape(-1, models.mean.shape[-1]).mean(axis=0)


def check(clips: Clips, n_states: int) -> None:
    """Raise UserError where a clip has fewer frames than a model has states."""
    if len(clips.length) and clips.length.min() < n_states:
        raise UserError(
            f"a clip of {clips.length.min()} frames is too short for a word model of {n_states} states; leave it out "
            "or set fewer states"
        )


def log_likelihoods(models: WordHMMs, clips: Clips) -> Floats:
    """Return log P(clip | model), (C, R)."""
    pivot = _pivot(models)
    packed = [_grouped(values) for values in _packed(models, pivot)]
    found = np.empty((len(clips.begin), packed[0].shape[0] * LANES))
    if len(clips.begin):
        word_hmm_kernels.score(clips.frames, clips.begin, clips.length, pivot, *packed, found)
    return found[:, : len(models.stay)] * np.log(2.0)


def start(clips: Clips, owner: Integers, n_models: int, n_states: int, floor: Floats) -> WordHMMs:
    """Return models to start from: each clip is cut into as many equal parts as there are states.

    Parameters
    ----------
    clips, owner : the training clips, and (C,) the index of the model that each belongs to.
    floor : (D,) minimum variances.

    Raises
    ------
    UserError : if a clip has fewer frames than states.
    """
    check(clips, n_states)
    n_features = clips.frames.shape[1]
    count = np.zeros((n_models, n_states))
    first, second = np.zeros((n_models, n_states, n_features)), np.zeros((n_models, n_states, n_features))
    pivot = clips.frames.mean(axis=0)
    bounds = clips.begin[:, None] + np.arange(n_states + 1) * clips.length[:, None] // n_states
    for model, places in zip(owner, bounds, strict=True):
        frames = clips.frames[places[0] : places[-1]] - pivot
        parts = places[:-1] - places[0]
        count[model] += np.diff(places)
        first[model] += np.add.reduceat(frames, parts)
        second[model] += np.add.reduceat(frames**2, parts)
    mean = first / count[:, :, None]
    variance = np.maximum(second / count[:, :, None] - mean**2, floor)
    clips_of = np.bincount(owner, minlength=n_models)[:, None]
    stay = np.clip(1.0 - clips_of / count, LEAST_STAY, MOST_STAY)
    stay[:, -1] = 1.0
    return WordHMMs(stay, mean + pivot, variance)


def expect(models: WordHMMs, clips: Clips, owner: Integers) -> Counts:
    """Return the expected counts of the clips of each model (the E-step of Baum-Welch)."""
    n_models, n_states, n_features = models.mean.shape
    pivot = _pivot(models)
    sums = Counts(
        np.zeros(n_models),
        np.zeros((n_models, n_states)),
        np.zeros((n_models, n_states)),
        np.zeros((n_models, n_states, n_features)),
        np.zeros((n_models, n_states, n_features)),
        pivot,
    )
    order = np.argsort(clips.length, kind="stable")  # clips in the same vectors should be equally long
    word_hmm_kernels.expect(
        clips.frames,
        clips.begin[order],
        clips.length[order],
        owner[order],
        pivot,
        *_packed(models, pivot),
        *sums[:-1],
    )
    return sums._replace(log_likelihood=sums.log_likelihood * np.log(2.0))


def maximise(models: WordHMMs, counts: Counts, floor: Floats) -> WordHMMs:
    """Return the maximum likelihood models of the expected counts within the limits (the M-step of Baum-Welch).

    A clip leaves state i if it ends in a later one. States without frames keep their parameters.
    """
    left = counts.ended[:, ::-1].cumsum(axis=1)[:, ::-1] - counts.ended
    before_end = counts.occupied - counts.ended
    moved = before_end > LEAST_OCCUPANCY
    stay = np.clip(1.0 - left / np.where(moved, before_end, 1.0), LEAST_STAY, MOST_STAY)
    stay = np.where(moved, stay, models.stay)
    stay[:, -1] = 1.0
    occupied = (counts.occupied > LEAST_OCCUPANCY)[:, :, None]
    frames = np.where(occupied, counts.occupied[:, :, None], 1.0)
    shift = counts.first / frames
    variance = np.maximum(counts.second / frames - shift**2, floor)
    return WordHMMs(
        stay,
        np.where(occupied, counts.pivot + shift, models.mean),
        np.where(occupied, variance, models.variance),
    )


def fit(
    models: WordHMMs, clips: Clips, owner: Integers, floor: Floats, iterations: int, tolerance: float = 0.0
) -> Fit:
    """Train all models by Baum-Welch, each on its own clips.

    Parameters
    ----------
    clips, owner : see ``start``.
    floor : (D,) minimum variances.
    iterations : maximum number of updates.
    tolerance : stop when the log-likelihood gain per frame, over all models, falls below this.
    """
    history: list[Floats] = []
    for _ in range(iterations):
        counts = expect(models, clips, owner)
        history.append(counts.log_likelihood)
        if len(history) > 1 and (history[-1] - history[-2]).sum() < tolerance * clips.length.sum():
            return Fit(models, np.array(history))
        models = maximise(models, counts, floor)
    history.append(expect(models, clips, owner).log_likelihood)
    return Fit(models, np.array(history))
