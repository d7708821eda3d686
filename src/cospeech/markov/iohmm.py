"""An input-output HMM over symbols, fully connected (Bengio and Frasconi 1995; Sargin 2006, 4.4.3).

The input u_t chooses the transition to the state s_t and the distribution of the output y_t:
P(s_t | s_(t-1), u_t) and P(y_t | s_t, u_t). Outputs are predicted from the inputs up to the same frame, because later
inputs say nothing about a state whose outputs are not known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.markov import expectation_maximisation, iohmm_kernels
from cospeech.markov.expectation_maximisation import Fit

INITIAL_STAY = 0.8
"""Mean probability of staying in a state in an initial model."""


class IOHMM(NamedTuple):
    """A model: ``initial`` (U, S), ``transitions`` (U, S, S) from the second axis, and ``emissions`` (U, S, K)."""

    initial: Floats
    transitions: Floats
    emissions: Floats


class Counts(NamedTuple):
    """Expected counts of an E-step, in the shapes of the model, and the log-likelihood."""

    log_likelihood: float
    initial: Floats
    transitions: Floats
    emissions: Floats


class Sequence(NamedTuple):
    """Symbols of the inputs and outputs of a sequence, (T,) each."""

    inputs: Integers
    outputs: Integers


def start(n_inputs: int, n_states: int, n_outputs: int, rng: np.random.Generator) -> IOHMM:
    """Return a random model to train, which tends to stay in a state."""
    moves = rng.dirichlet(np.ones(n_states), (n_inputs, n_states))
    return IOHMM(
        rng.dirichlet(np.ones(n_states), n_inputs),
        INITIAL_STAY * np.eye(n_states) + (1.0 - INITIAL_STAY) * moves,
        rng.dirichlet(np.ones(n_outputs), (n_inputs, n_states)),
    )


def expect(model: IOHMM, sequences: list[Sequence]) -> Counts:
    """Return the expected counts of all sequences (the E-step of generalised Baum-Welch)."""
    counts = tuple(np.zeros_like(values) for values in model)
    found = sum(iohmm_kernels.expect(*sequence, *model, *counts) for sequence in sequences)
    initial, transitions, emissions = counts
    return Counts(found, initial, transitions * model.transitions, emissions)


def maximise(model: IOHMM, counts: Counts, pseudo: float) -> IOHMM:
    """Return the model with the highest objective under the counts; distributions without counts stay as they are."""
    return IOHMM(*(_shares(own + pseudo, old) for own, old in zip(counts[1:], model, strict=True)))


def _shares(counts: Floats, otherwise: Floats) -> Floats:
    total = counts.sum(axis=-1, keepdims=True)
    return np.asarray(np.where(total > 0.0, counts / np.where(total > 0.0, total, 1.0), otherwise))


def objective(model: IOHMM, log_likelihood: float, pseudo: float) -> float:
    """Return what training increases: the log-likelihood, and ``pseudo`` times the logarithms of all parameters."""
    if pseudo == 0.0:
        return log_likelihood
    return log_likelihood + pseudo * float(sum(np.log(values).sum() for values in model))


def fit(
    model: IOHMM, sequences: list[Sequence], iterations: int, tolerance: float = 0.0, pseudo: float = 0.0
) -> Fit[IOHMM]:
    """Train ``model`` by expectation maximisation; see ``parallel_symbols.fit``."""
    n_frames = sum(len(sequence.inputs) for sequence in sequences)
    return expectation_maximisation.fit(
        model,
        lambda now: expect(now, sequences),
        lambda now, counts: objective(now, counts.log_likelihood, pseudo),
        lambda now, counts: maximise(now, counts, pseudo),
        iterations,
        tolerance * n_frames,
    )


class Predictor:
    """The distribution of the output in each frame, given the inputs up to it."""

    def __init__(self, model: IOHMM) -> None:
        self._model = model
        self._belief = np.zeros(0)

    def hear(self, inputs: Integers) -> Floats:
        """Return the probabilities (T, K) of the outputs for the next inputs (T,)."""
        found = np.empty((len(inputs), self._model.emissions.shape[-1]))
        if len(inputs) == 0:
            return found
        if len(self._belief) == 0:
            self._belief = self._model.initial[inputs[0]].copy()
            found[0] = self._belief @ self._model.emissions[inputs[0]]
            iohmm_kernels.predict(inputs[1:], *self._model[1:], self._belief, found[1:])
        else:
            iohmm_kernels.predict(inputs, *self._model[1:], self._belief, found)
        return found
