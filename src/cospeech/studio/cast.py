"""The cast: the planted behaviour of a virtual actor, sampled once from the seed and the actor's name.

A cast member is a semi-Markov process of gesture phrases (Özkul 2012, 5.1) with a distribution of prosody patterns
for each gesture. This is exactly the model that the synthesis room estimates, so that estimates can be compared with
the ground truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.errors import UserError
from cospeech.studio.patterns import NAMES, PAUSE

REST = GESTURES.index("rest")

# For each gesture: its relative frequency, its mean duration in seconds, and the gesture that habitually follows it.
HABITS = {
    "raise_both": (1.0, 2.3, "open"),
    "rest": (0.0, 2.0, None),
    "left": (1.0, 1.9, "right"),
    "perpendicular": (1.0, 2.9, "contact"),
    "contact": (1.0, 2.6, "raise_both"),
    "open": (1.0, 1.7, "left"),
    "right": (1.0, 1.8, "perpendicular"),
}
SHORTEST_S, LONGEST_S = 0.8, 6.0
OPENS_AT_REST = 0.85
BACK_TO_REST = 0.45
FOLLOWS_HABIT = 0.25
REPEATS = 0.03


@dataclass(frozen=True)
class Member:
    """The planted parameters of one actor.

    ``initial`` (G,), ``transitions`` (G, G) and ``durations`` (G, D) are those of Özkul 2012, eq. 5.1-5.4;
    durations[i, k - 1] is the probability that gesture i lasts k prosody frames. ``coupled`` (G, P) is the
    distribution of prosody patterns in gesture phrases whose speech is coupled to the gesture. Gestures are in the
    order of ``vocabulary.GESTURES``, patterns in that of ``patterns.NAMES``.
    """

    actor: str
    initial: Floats
    transitions: Floats
    durations: Floats
    coupled: Floats

    def occupancy(self) -> Floats:
        """Return the long-run fraction of frames in each gesture, (G,)."""
        n = len(self.initial)
        balance = np.vstack([self.transitions.T - np.eye(n), np.ones(n)])
        visits = np.linalg.lstsq(balance, np.append(np.zeros(n), 1.0), rcond=None)[0]
        frames = visits * (self.durations @ np.arange(1, self.durations.shape[1] + 1))
        return frames / frames.sum()

    def marginal(self) -> Floats:
        """Return the long-run fraction of frames in each pattern, (P,), from which uncoupled speech is sampled."""
        return self.occupancy() @ self.coupled

    def emissions(self, coupling: float) -> Floats:
        """Return the probability of each pattern in a frame of each gesture, (G, P), at the given coupling."""
        return (1.0 - coupling) * self.marginal() + coupling * self.coupled


def member(actor: str, seed: int, frame_s: float, max_duration_s: float) -> Member:
    """Return the cast member called ``actor``.

    Parameters
    ----------
    frame_s : spacing of prosody frames, the grid of all planted durations.
    max_duration_s : D_max, the longest gesture phrase that a model can represent.

    Raises
    ------
    UserError : if D_max is shorter than the gesture phrases of the studio.
    """
    bins = round(max_duration_s / frame_s)
    if bins * frame_s < 2 * SHORTEST_S:
        raise UserError(
            f"config: synthesis.max_duration_s is {max_duration_s} s, but the studio's gesture phrases last "
            f"{SHORTEST_S} to {LONGEST_S} s; allow at least {2 * SHORTEST_S} s"
        )
    rng = random_source(seed, "cast", actor)
    taste = np.array([HABITS[gesture][0] for gesture in GESTURES]) * rng.gamma(16.0, 1 / 16.0, len(GESTURES))
    return Member(
        actor=actor,
        initial=_initial(taste),
        transitions=_transitions(taste, rng),
        durations=_durations(rng, frame_s, bins),
        coupled=_coupled(rng),
    )


def _initial(taste: Floats) -> Floats:
    """Return initial probabilities: records mostly start at rest."""
    initial = (1.0 - OPENS_AT_REST) * taste / taste.sum()
    initial[REST] = OPENS_AT_REST
    return initial


def _transitions(taste: Floats, rng: np.random.Generator) -> Floats:
    """Return transition probabilities: rest to preferred gestures, a gesture to rest or to its habitual next one."""
    rows = np.zeros((len(GESTURES), len(GESTURES)))
    for i, gesture in enumerate(GESTURES):
        free = taste.copy()
        free[i] = 0.0
        if i != REST:
            rows[i, REST] = BACK_TO_REST * rng.uniform(0.8, 1.2)
            rows[i, i] = REPEATS
            rows[i, GESTURES.index(HABITS[gesture][2])] = FOLLOWS_HABIT * rng.uniform(0.8, 1.2)
        rows[i] += (1.0 - rows[i].sum()) * free / free.sum()
    return rows


def _durations(rng: np.random.Generator, frame_s: float, bins: int) -> Floats:
    """Return duration probabilities: truncated gamma densities on the grid of prosody frames."""
    seconds = np.arange(1, bins + 1) * frame_s
    possible = (seconds >= SHORTEST_S) & (seconds <= LONGEST_S)
    tempo = rng.uniform(0.88, 1.12)
    rows = np.zeros((len(GESTURES), bins))
    for i, gesture in enumerate(GESTURES):
        mean = HABITS[gesture][1] * tempo * rng.uniform(0.9, 1.1)
        shape = rng.uniform(3.5, 7.0)
        logarithm = (shape - 1.0) * np.log(seconds) - seconds * shape / mean
        rows[i] = np.where(possible, np.exp(logarithm - logarithm.max()), 0.0)
    return rows / rows.sum(axis=1, keepdims=True)


def _coupled(rng: np.random.Generator) -> Floats:
    """Return pattern probabilities: each gesture has a main and a second pattern, rest has pauses and soft asides."""
    speaking = rng.permutation([p for p in range(len(NAMES)) if p != PAUSE])
    shift = int(rng.integers(1, len(speaking)))
    rows = np.zeros((len(GESTURES), len(NAMES)))
    moving = [i for i in range(len(GESTURES)) if i != REST]
    for place, i in enumerate(moving):
        rows[i, speaking[place]] = rng.uniform(0.55, 0.65)
        rows[i, speaking[(place + shift) % len(speaking)]] = rng.uniform(0.16, 0.22)
        rows[i, PAUSE] = rng.uniform(0.04, 0.07)
    rows[REST, PAUSE] = rng.uniform(0.58, 0.68)
    rows[REST, NAMES.index("p8")] = rng.uniform(0.12, 0.18)
    for row in rows:
        row += (1.0 - row.sum()) * rng.dirichlet(np.full(len(NAMES), 4.0))
    return rows


def tables(cast: list[Member], couplings: Mapping[str, float], frame_s: float) -> dict[str, pd.DataFrame]:
    """Return the planted model of the whole cast: the tables initial, transitions, emissions and durations.

    Parameters
    ----------
    cast : the cast.
    couplings : the coupling of gestures and prosody patterns of each actor, by name.
    frame_s : spacing of prosody frames.
    """
    gestures = np.array(GESTURES, dtype=object)
    return {
        "initial": _stack(cast, lambda m: {"gesture": gestures, "probability": m.initial}),
        "transitions": _stack(cast, lambda m: _grid(m.transitions, from_gesture=gestures, to_gesture=gestures)),
        "emissions": _stack(
            cast,
            lambda m: _grid(m.emissions(couplings[m.actor]), gesture=gestures, prosody=np.array(NAMES, dtype=object)),
        ),
        "durations": _stack(cast, lambda m: _duration_rows(m, gestures, frame_s)),
    }


def _stack(cast: list[Member], columns: Callable[[Member], dict[str, npt.NDArray]]) -> pd.DataFrame:
    frames = [pd.DataFrame({"actor": m.actor, **columns(m)}) for m in cast]
    return pd.concat(frames, ignore_index=True).assign(floor=np.nan)


def _grid(probability: Floats, **axes: npt.NDArray) -> dict[str, npt.NDArray]:
    (row_name, rows), (column_name, columns) = axes.items()
    return {
        row_name: np.repeat(rows, len(columns)),
        column_name: np.tile(columns, len(rows)),
        "probability": probability.ravel(),
    }


def _duration_rows(m: Member, gestures: npt.NDArray, frame_s: float) -> dict[str, npt.NDArray]:
    bins = np.arange(1, m.durations.shape[1] + 1)
    return _grid(m.durations, gesture=gestures, bin=bins) | {"duration_s": np.tile(bins * frame_s, len(gestures))}
