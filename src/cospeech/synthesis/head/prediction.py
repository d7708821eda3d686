"""Stage II at work: head patterns predicted from melody patterns as they are heard."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cospeech.data.arrays import Integers
from cospeech.markov import parallel_symbols
from cospeech.markov.fixed_lag import FixedLag
from cospeech.markov.fixed_lag_beliefs import FixedLagBeliefs
from cospeech.markov.iohmm import IOHMM, Predictor
from cospeech.markov.parallel import Densities, ParallelHMM, flat
from cospeech.markov.parallel_symbols import SymbolHMM

HEAD, MELODY = 0, 1
"""Streams of the joint patterns."""


class Labeller(Protocol):
    """What turns the melody patterns of frames into head patterns, some of them later."""

    def hear(self, symbols: Integers) -> Integers:
        """Return the head patterns that become certain with the next melody patterns (T,)."""

    def end(self) -> Integers:
        """Return the head patterns that are still missing."""


class MelodyLabeller:
    """The melody pattern of every frame, ``lag`` frames after it is heard (eq. 4.11-4.13)."""

    def __init__(self, model: ParallelHMM, lag: int) -> None:
        self._densities, self._path = Densities(model), FixedLag(model.entry, model.stay, lag)
        self._n_patterns = len(model.entry)

    def hear(self, frames: np.ndarray) -> Integers:
        """Return the patterns that become certain with the next frames (T, 3)."""
        return self._path.hear(self._densities.of(frames)) % self._n_patterns

    def end(self) -> Integers:
        """Return the patterns that are still missing."""
        return self._path.end() % self._n_patterns


class JointLabeller:
    """Head patterns by eq. 4.19: the most likely ones in the states of the best path through the melody stream."""

    def __init__(self, model: SymbolHMM, lag: int) -> None:
        self._densities = parallel_symbols.log_densities(parallel_symbols.split(model, MELODY))
        self._path = FixedLag(model.entry, model.stay, lag)
        self._label = flat(model.emissions[HEAD]).argmax(axis=1)

    def hear(self, symbols: Integers) -> Integers:
        """See ``Labeller``."""
        return self._label[self._path.hear(self._densities[symbols])]

    def end(self) -> Integers:
        """See ``Labeller``."""
        return self._label[self._path.end()]


class WeightedLabeller:
    """Head patterns that are most probable given all melody patterns up to ``lag`` frames later.

    The probability of a head pattern is its mean in the states, weighted by their posterior probabilities.
    """

    def __init__(self, model: SymbolHMM, lag: int) -> None:
        self._densities = np.exp(parallel_symbols.log_densities(parallel_symbols.split(model, MELODY)))
        self._beliefs = FixedLagBeliefs(model.entry, model.stay, lag)
        self._emissions = flat(model.emissions[HEAD])

    def hear(self, symbols: Integers) -> Integers:
        """See ``Labeller``."""
        return (self._beliefs.hear(self._densities[symbols]) @ self._emissions).argmax(axis=1)

    def end(self) -> Integers:
        """See ``Labeller``."""
        return (self._beliefs.end() @ self._emissions).argmax(axis=1)


class IOHMMLabeller:
    """Head patterns by an input-output HMM, whose inputs are ``ahead`` frames ahead of its outputs."""

    def __init__(self, model: IOHMM, ahead: int) -> None:
        self._predictor, self._ahead, self._n_skipped = Predictor(model), ahead, 0
        self._last = np.zeros(1, dtype=np.int64)

    def hear(self, symbols: Integers) -> Integers:
        """See ``Labeller``."""
        n_skipped = min(self._ahead - self._n_skipped, len(symbols))
        self._n_skipped += n_skipped
        self._last = symbols[-1:] if len(symbols) else self._last
        return self._predictor.hear(symbols[n_skipped:]).argmax(axis=1)

    def end(self) -> Integers:
        """See ``Labeller``; the last melody pattern stands for those that would follow."""
        return self._predictor.hear(np.repeat(self._last, self._n_skipped)).argmax(axis=1)


def ahead(symbols: Integers, n_frames: int) -> Integers:
    """Return symbols (T,) ``n_frames`` frames earlier, as ``IOHMMLabeller`` hears them; the last one is repeated."""
    return np.append(symbols, np.repeat(symbols[-1:], n_frames))[n_frames:]


def whole(labeller: Labeller, symbols: Integers) -> Integers:
    """Return the head patterns (T,) of all frames of a record with these melody patterns."""
    return np.append(labeller.hear(symbols), labeller.end())
