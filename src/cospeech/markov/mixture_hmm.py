"""Left-to-right hidden Markov models with Gaussian mixtures, and networks of them (Sargin 2006, 3.2.2, 3.2.3, 3.3).

A clip starts in the first state of a model, stays in a state or moves on to the next one with every frame, and ends
by leaving the last state. The density of a state is a mixture of Gaussians with diagonal covariances. In a network,
any model may follow any other, so that the most likely path through it finds where in a recording the events are that
the models describe (Rabiner 1989; Young et al., The HTK Book).

Variances are at least a given floor, and probabilities of staying are within limits. The M-step returns the maximum
*under* these limits, so that the likelihood does not decrease in training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.errors import UserError
from cospeech.markov import mixture_hmm_kernels
from cospeech.markov.word_hmm import LEAST_OCCUPANCY, LEAST_STAY, MOST_STAY, Clips


class MixtureHMM(NamedTuple):
    """A model of S states with K components each: ``stay`` (S,), ``weight`` (S, K), ``mean``, ``variance`` (S, K,
    D)."""

    stay: Floats
    weight: Floats
    mean: Floats
    variance: Floats


class Fit(NamedTuple):
    """A trained model, and the log-likelihoods (iterations + 1,) during training; the last is that of the model."""

    model: MixtureHMM
    log_likelihoods: Floats


class Path(NamedTuple):
    """The most likely path through a network.

    Attributes
    ----------
    branch : (T,) index of the model of each frame.
    begins : (T,) whether a pass through the model begins with this frame.
    log_score : log of the joint probability of path and frames.
    """

    branch: Integers
    begins: Flags
    log_score: float


class _Packed(NamedTuple):
    """The parameters of the densities as kernels take them, components in one row."""

    mean: Floats
    halved: Floats
    constant: Floats


def _packed(model: MixtureHMM) -> _Packed:
    n_features = model.mean.shape[-1]
    mean, variance = (values.reshape(-1, n_features).T for values in (model.mean, model.variance))
    with np.errstate(divide="ignore"):
        weight = np.log(model.weight.ravel())
    constant = weight - 0.5 * np.log(2.0 * np.pi * variance).sum(axis=0)
    return _Packed(np.ascontiguousarray(mean), np.ascontiguousarray(0.5 / variance), constant)


def log_densities(model: MixtureHMM, frames: Floats) -> Floats:
    """Return log p(x_t | state i), (T, S), of frames (T, D)."""
    found = np.empty((len(frames), len(model.stay)))
    mixture_hmm_kernels.log_densities(np.ascontiguousarray(frames), *_packed(model), found)
    return found


def log_likelihood(model: MixtureHMM, frames: Floats) -> float:
    """Return log P(frames | model) of a clip (T, D); minus infinity if it has fewer frames than the model states."""
    if len(frames) < len(model.stay):
        return -np.inf
    scores = log_densities(model, frames)
    total = mixture_hmm_kernels.beliefs(scores, np.log(model.stay), np.log1p(-model.stay), np.empty_like(scores))
    return float(total)


def start(clips: Clips, n_states: int, n_components: int, floor: Floats, rng: np.random.Generator) -> MixtureHMM:
    """Return a model to start from: each clip is cut into as many equal parts as there are states.

    The means of the components of a state are frames of its parts, each drawn with a probability proportional to its
    squared distance from the nearest one that was drawn before, as in k-means++ (Arthur and Vassilvitskii 2007).

    Parameters
    ----------
    clips : the training clips.
    floor : (D,) minimum variances.

    Raises
    ------
    UserError : if there is no clip, or one has fewer frames than the model states.
    """
    if not len(clips.length):
        raise UserError("there is no training clip for a model; record more")
    if clips.length.min() < n_states:
        raise UserError(
            f"a clip of {clips.length.min()} frames is too short for a model of {n_states} states; leave it out or "
            "set fewer states"
        )
    places = np.concatenate([np.arange(length) * n_states // length for length in clips.length])
    frames = np.concatenate(
        [clips.frames[begin : begin + length] for begin, length in zip(clips.begin, clips.length, strict=True)]
    )
    parts = [frames[places == state] for state in range(n_states)]
    variance = np.array([np.maximum(part.var(axis=0), floor) for part in parts])
    mean = np.array(
        [
            _spread(part / np.sqrt(own), n_components, rng) * np.sqrt(own)
            for part, own in zip(parts, variance, strict=True)
        ]
    )
    return MixtureHMM(
        np.array([np.clip(1.0 - len(clips.length) / len(part), LEAST_STAY, MOST_STAY) for part in parts]),
        np.full((n_states, n_components), 1.0 / n_components),
        mean,
        np.repeat(variance[:, None], n_components, axis=1),
    )


def _spread(frames: Floats, number: int, rng: np.random.Generator) -> Floats:
    """Return ``number`` of the frames (T, D) that lie apart."""
    if number == 1:
        return frames.mean(axis=0, keepdims=True)
    chosen = [frames[rng.integers(len(frames))]]
    nearest = np.full(len(frames), np.inf)
    for _ in range(number - 1):
        nearest = np.minimum(nearest, ((frames - chosen[-1]) ** 2).sum(axis=1))
        total = nearest.sum()
        row = rng.choice(len(frames), p=nearest / total) if total > 0.0 else rng.integers(len(frames))
        chosen.append(frames[row])
    return np.array(chosen)


def fit(model: MixtureHMM, clips: Clips, floor: Floats, iterations: int, tolerance: float = 0.0) -> Fit:
    """Train a model by Baum-Welch.

    Parameters
    ----------
    clips : the training clips, none shorter than the model.
    floor : (D,) minimum variances.
    iterations : maximum number of updates.
    tolerance : stop when the log-likelihood gain per frame falls below this.
    """
    history: list[float] = []
    for _ in range(iterations + 1):
        updated, log_likelihood = _updated(model, clips, floor)
        history.append(log_likelihood)
        gain = np.inf if len(history) == 1 else history[-1] - history[-2]
        if len(history) > iterations or gain < tolerance * clips.length.sum():
            break
        model = updated
    return Fit(model, np.array(history))


def _updated(model: MixtureHMM, clips: Clips, floor: Floats) -> tuple[MixtureHMM, float]:
    """Return the model after one iteration of Baum-Welch, and the log-likelihood before it."""
    packed = _packed(model)
    occupied, first, second = np.zeros(len(packed.constant)), np.zeros_like(packed.mean), np.zeros_like(packed.mean)
    total = mixture_hmm_kernels.expect(
        clips.frames, clips.begin, clips.length, np.log(model.stay), np.log1p(-model.stay), *packed,
        occupied, first, second,
    )  # fmt: skip
    shape = model.mean.shape
    seen = occupied > LEAST_OCCUPANCY
    count = np.where(seen, occupied, 1.0)
    shift = first / count
    variance = np.maximum(second / count - shift**2, floor[:, None])
    in_state = occupied.reshape(shape[:2]).sum(axis=1)
    return MixtureHMM(
        np.clip(1.0 - len(clips.length) / in_state, LEAST_STAY, MOST_STAY),
        occupied.reshape(shape[:2]) / in_state[:, None],
        np.where(seen, packed.mean + shift, packed.mean).T.reshape(shape),
        np.where(seen, variance, 0.5 / packed.halved).T.reshape(shape),
    ), float(total)


@dataclass(frozen=True)
class Training:
    """How models are trained.

    Attributes
    ----------
    iterations : maximum number of iterations of Baum-Welch.
    tolerance : stop when the log-likelihood gain per frame falls below this.
    variance_floor : minimum variance, as a share of that of all training frames.
    """

    iterations: int
    tolerance: float
    variance_floor: float

    def train(self, clips: Clips, n_states: int, n_components: int, rng: np.random.Generator) -> MixtureHMM:
        """Return a model of clips. Those with fewer frames than states are left out.

        Parameters
        ----------
        clips : training clips; ``clips.frames`` are all training frames, also those of other models.

        Raises
        ------
        UserError : if no clip is long enough.
        """
        long_enough = clips.chosen(np.flatnonzero(clips.length >= n_states))
        floor = self.variance_floor * clips.frames.var(axis=0)
        first = start(long_enough, n_states, n_components, floor, rng)
        return fit(first, long_enough, floor, self.iterations, self.tolerance).model


def decode(models: Sequence[MixtureHMM], prior: Floats, frames: Floats) -> Path:
    """Return the most likely path of a recording through a network of models.

    Parameters
    ----------
    models : of D features each; their numbers of states and components may differ.
    prior : (M,) probability of each model after any other one, and at the start.
    frames : (T, D), at least as many as the shortest model has states.

    Raises
    ------
    UserError : if no model is as short as the recording.
    """
    lengths = np.array([len(model.stay) for model in models])
    if len(frames) < lengths.min():
        raise UserError(f"a recording of {len(frames)} frames is shorter than every model; leave it out")
    stay = np.concatenate([model.stay for model in models])
    scores = np.concatenate([log_densities(model, frames) for model in models], axis=1)
    end = np.cumsum(lengths) - 1
    branch, begins = np.empty(len(frames), dtype=np.int64), np.empty(len(frames), dtype=np.bool_)
    log_score = mixture_hmm_kernels.decode(
        scores, end - lengths + 1, end, np.log(prior), np.log(stay), np.log1p(-stay), branch, begins
    )
    return Path(branch, begins, float(log_score))
