"""Arousal: a hidden state that drives the voice and, a little earlier, the vigour of the hands (Levine 2010, 3).

The states form a semi-Markov process. In speech, arousal sets the level, the range of the pitch and the length of
syllables. In the hands, it sets pace and size of beats, their height, and how far their paths bend; speed, spatial
extent, acceleration, curvature and height of the motion follow from these. The hands are ahead of the voice by a lag
that belongs to the actor (McNeill: gesture anticipates speech).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.studio import worlds

STATES = ("calm", "lively", "excited")
NEUTRAL = STATES.index("lively")

LOUDNESS_DB = (-6.0, 0.0, 6.0)
PITCH_RANGE = (0.6, 1.0, 1.35)
SYLLABLE = (1.25, 1.0, 0.8)
"""Effects on the voice by state: level, factor of pitch intervals, factor of the length of syllables."""

PACE = (0.6, 1.0, 1.6)
SIZE = (0.25, 0.9, 1.8)
REACH = (0.4, 0.8, 1.1)
ARC_M = (0.01, 0.05, 0.1)
FIDGET_M = (0.0, 0.02, 0.1)
"""Effects on the hands by state: factors of rate and size of beats, factor of the way from the place of rest to that
of a gesture, deviation from a straight path, and size of movements at rest."""

MEAN_S = (4.5, 7.0)
SHORTEST_S = 1.0
SHAPE = 2.5
"""Range of the mean duration of a state, its minimum, and the shape of the gamma distribution above it."""

LAG_S = (0.2, 0.3)
"""Range of the lag of an actor; all multiples of the prosody frame in it are equally likely."""

SETTLING_S = 60.0
"""Time for which the process runs before a record starts, so that it is stationary."""

EASE_S = 0.3
"""Width of the Hann window over which the hands pass from one state to the next."""


@dataclass(frozen=True)
class ArousalModel:
    """The planted arousal of one actor.

    Attributes
    ----------
    actor : the actor.
    mean_s : (S,) mean duration of each state, in seconds.
    lag_s : time by which the hands are ahead of the voice.
    next_state : (S, S) transition probabilities; a state does not follow itself.
    """

    actor: str
    mean_s: Floats
    lag_s: float
    next_state: Floats

    def share(self) -> Floats:
        """Return the long-run share of time in each state, (S,)."""
        n = len(STATES)
        balance = np.vstack([self.next_state.T - np.eye(n), np.ones(n)])
        visits = np.linalg.lstsq(balance, np.append(np.zeros(n), 1.0), rcond=None)[0]
        return visits * self.mean_s / (visits @ self.mean_s)


def model(actor: str, seed: int, frame_s: float) -> ArousalModel:
    """Return the arousal of ``actor``, sampled from the seed and the actor's name; the lag is in whole frames."""
    rng = random_source(seed, "arousal", actor)
    first, last = (round(limit / frame_s) for limit in LAG_S)
    rows = np.array([[0.0, 0.7, 0.3], [0.5, 0.0, 0.5], [0.3, 0.7, 0.0]])
    return ArousalModel(actor, rng.uniform(*MEAN_S, len(STATES)), frame_s * int(rng.integers(first, last + 1)), rows)


def process(own: ArousalModel, n_frames: int, frame_s: float, rng: np.random.Generator) -> Integers:
    """Return the state of arousal in each of ``n_frames`` prosody frames, (n_frames,), of the stationary process."""
    settling = round(SETTLING_S / frame_s)
    rows = np.cumsum(own.next_state, axis=1)
    state, length, runs, states = int(rng.integers(len(STATES))), 0, [], []
    while length < settling + n_frames:
        longer_s = rng.gamma(SHAPE, (own.mean_s[state] - SHORTEST_S) / SHAPE)
        runs.append(max(1, round((SHORTEST_S + longer_s) / frame_s)))
        states.append(state)
        length += runs[-1]
        state = int(np.searchsorted(rows[state], rng.random(), side="right"))
    return np.repeat(np.array(states), runs)[settling : settling + n_frames]


def write(
    own: ArousalModel, record: str, n_frames: int, coupling: float, frame_s: float, seed: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the arousal of one record in its speech and in the hands, as segment tables on prosody frames.

    Where the body listens, the state of the hands at time t is that of the speech at t + lag; elsewhere it is that of
    an independent sample of the process.
    """
    lag = round(own.lag_s / frame_s)
    spoken = process(own, n_frames + lag, frame_s, random_source(seed, "arousal of speech", record))
    other = process(own, n_frames, frame_s, random_source(seed, "arousal of hands", record))
    times_s = segments.frame_times(n_frames, 1.0 / frame_s)
    spans = worlds.listening(times_s[-1], coupling, random_source(seed, "listens to arousal", record))
    shown = np.where(worlds.listens(times_s, spans), spoken[lag:], other)
    names = np.array(STATES, dtype=object)
    return (
        segments.from_labels(record, names[spoken[:n_frames]], 1.0 / frame_s),
        segments.from_labels(record, names[shown], 1.0 / frame_s),
    )


def effect(table: pd.DataFrame | None, by_state: tuple[float, ...], times_s: Floats) -> Floats:
    """Return an effect of arousal at each time, (T,), that of the neutral state without arousal.

    Parameters
    ----------
    table : states as a segment table, or None.
    by_state : the effect in each of ``STATES``.
    """
    if table is None:
        return np.full(len(times_s), by_state[NEUTRAL])
    of_row = np.array(by_state)[[STATES.index(label) for label in table["label"]]]
    return np.asarray(of_row[segments.at_times(table, times_s)])


def eased(table: pd.DataFrame | None, by_state: tuple[float, ...], times_s: Floats) -> Floats:
    """Return an effect of arousal as ``effect`` does, with gradual and symmetric transitions over ``EASE_S``."""
    shares = (np.arange(9) + 1.0) / 10.0
    weights = np.hanning(len(shares) + 2)[1:-1]
    moved = [effect(table, by_state, times_s + EASE_S * (share - 0.5)) for share in shares]
    return np.asarray(weights @ np.array(moved) / weights.sum())


def states_table(cast: list[ArousalModel], coupling: float) -> pd.DataFrame:
    """Return the planted states and their effects for all actors (schema ``arousal_states``)."""
    effects = {
        "loudness_db": LOUDNESS_DB,
        "pitch_range": PITCH_RANGE,
        "syllable": SYLLABLE,
        "pace": PACE,
        "size": SIZE,
        "reach": REACH,
        "arc_m": ARC_M,
        "fidget_m": FIDGET_M,
    }
    tables = [
        pd.DataFrame(
            {
                "actor": own.actor,
                "state": list(STATES),
                "share": own.share(),
                "mean_s": own.mean_s,
                "lag_s": own.lag_s,
            }
            | {name: list(values) for name, values in effects.items()}
            | {"coupling": coupling}
        )
        for own in cast
    ]
    return pd.concat(tables, ignore_index=True)
