"""Head patterns from melody patterns by gradient boosting: how well any method can do with what the systems hear."""

from __future__ import annotations

from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from cospeech.data.arrays import Floats, Integers

STEP, N_STEPS = 3, 8
"""A frame is described by the melody patterns at steps of 3 frames up to 24 frames before and after it."""

SETTINGS: dict[str, Any] = {
    "max_iter": 40,
    "max_leaf_nodes": 15,
    "learning_rate": 0.15,
    "early_stopping": False,
    "random_state": 0,
}


def windows(symbols: Integers, n_symbols: int) -> Floats:
    """Return which melody pattern holds at each step around each frame, (T, (2 * N_STEPS + 1) * n_symbols).

    Nothing holds before the first frame and after the last one.
    """
    reach = STEP * N_STEPS
    marked = np.pad(np.eye(n_symbols)[symbols], ((reach, reach), (0, 0)))
    around = np.lib.stride_tricks.sliding_window_view(marked, 2 * reach + 1, axis=0)[:, :, ::STEP]
    return np.ascontiguousarray(around).reshape(len(symbols), -1)


class BoostedLabeller:
    """The most probable head pattern of every frame, when the last frame has been heard.

    Parameters
    ----------
    melodies, heads : patterns of the training stretches, (T,) each. n_melodies : number of melody patterns.
    """

    def __init__(self, melodies: list[Integers], heads: list[Integers], n_melodies: int) -> None:
        from sklearn.ensemble import HistGradientBoostingClassifier  # takes half a second to import

        self._n_melodies = n_melodies
        self._heard: list[Integers] = []
        self._model = HistGradientBoostingClassifier(**SETTINGS)
        inputs = np.concatenate([windows(symbols, n_melodies) for symbols in melodies])
        with threadpool_limits(1):  # the machine is shared by the jobs of a run
            self._model.fit(inputs, np.concatenate(heads))

    def hear(self, symbols: Integers) -> Integers:
        """Return nothing yet."""
        self._heard.append(symbols)
        return symbols[:0]

    def end(self) -> Integers:
        """Return the head pattern of every frame."""
        symbols = np.concatenate(self._heard)
        if len(symbols) == 0:
            return symbols
        with threadpool_limits(1):
            return np.asarray(self._model.predict(windows(symbols, self._n_melodies)), dtype=np.int64)
