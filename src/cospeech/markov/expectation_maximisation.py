"""The loop of expectation maximisation, which hidden Markov models over symbols share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from cospeech.data.arrays import Floats

Model = TypeVar("Model")
Counts = TypeVar("Counts")


class Fit(NamedTuple, Generic[Model]):
    """A trained model, and the objective (iterations + 1,) during training; the last is that of the model."""

    model: Model
    objective: Floats


def fit(
    model: Model,
    expect: Callable[[Model], Counts],
    objective: Callable[[Model, Counts], float],
    maximise: Callable[[Model, Counts], Model],
    iterations: int,
    least_gain: float,
) -> Fit[Model]:
    """Train ``model``, which is updated by ``maximise`` given the counts that ``expect`` returns.

    Parameters
    ----------
    objective : what training increases.
    iterations : maximum number of updates.
    least_gain : stop when the objective increases by less than this.
    """
    history: list[float] = []
    while True:
        counts = expect(model)
        history.append(objective(model, counts))
        slow = len(history) > 1 and history[-1] - history[-2] < least_gain
        if slow or len(history) > iterations:
            return Fit(model, np.array(history))
        model = maximise(model, counts)
