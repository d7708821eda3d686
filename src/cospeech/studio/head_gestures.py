"""Head gestures that are joined with pitch movements (Sargin 2006, 4).

Each movement is joined with one gesture: the head turns or tilts to a side and comes back, or nods. Which gesture it
is, and how far the head turns, are habits of the actor. The gesture begins somewhat before its movement, by a lag
that varies from one time to the next. Where there is no movement, the head rests.

The head listens in random spans of a few seconds (see ``worlds``). In the others, it follows the movements of speech
that is not heard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.studio import worlds
from cospeech.studio.choreography import minimum_jerk
from cospeech.studio.motion import wander
from cospeech.studio.movements import CONTOURS, NONE

GESTURES = ("turn_left", "turn_right", "tilt_left", "tilt_right", "nod")
REST = "rest"

AXES = {
    "turn_left": (1, 1.0),
    "turn_right": (1, -1.0),
    "tilt_left": (2, -1.0),
    "tilt_right": (2, 1.0),
    "nod": (0, 1.0),
}
"""The angle of a gesture, 0 to 2 for x, y and z, and its sign."""

SIZE_DEG = {
    "turn_left": (13.0, 18.0),
    "turn_right": (13.0, 18.0),
    "tilt_left": (9.0, 13.0),
    "tilt_right": (9.0, 13.0),
}
NOD_DEG, NOD_S = (9.0, 13.0), 0.6
"""Ranges of the size of gestures, and the duration of a single nod, of which a gesture has as many as fit best."""

ASIDE_DEG = 2.5
"""Standard deviation of the angles of an actor's gestures about the other axes."""

SIZE_SPREAD = 0.12
"""Standard deviation of the logarithm of the size of a gesture, from one time to the next."""

MOVES_S, MOST_MOVES = 0.35, 0.45
"""Duration of the movement to the place of a gesture, and of that back; at most this share of the gesture each."""

SWAY_DEG = (0.7, 1.0, 0.6)
SWAY_HZ = (0.05, 0.5)
"""Size and range of frequencies of the sway of the head about each axis."""

LAG_S, LAG_SPREAD_S, LAG_LIMITS_S = (0.10, 0.25), 0.05, (0.0, 0.4)
"""Range of an actor's mean lag, standard deviation and limits of the lag from one time to the next."""

NEUTRAL_S = 0.5
"""Time for which the head rests at the start of a record, as its first frame is the reference for all others."""

SHORTEST_S = 0.2
"""Shortest head gesture; where the head begins to listen, a movement could cut one short."""


@dataclass(frozen=True)
class Habits:
    """The head gestures of one actor.

    Attributes
    ----------
    joined : the gesture that each pitch movement is joined with.
    lag_s : mean time by which the gesture begins before the movement.
    places_deg : angles x, y and z of each gesture; for a nod, those of its deepest point.
    """

    joined: dict[str, str]
    lag_s: float
    places_deg: dict[str, Floats]


def habits(actor: str, seed: int) -> Habits:
    """Return the head gestures of ``actor``, sampled from the seed and the actor's name."""
    rng = random_source(seed, "head gestures", actor)
    order = rng.permutation(len(GESTURES))
    places = {}
    for gesture in GESTURES:
        axis, sign = AXES[gesture]
        place = rng.normal(0.0, ASIDE_DEG, 3)
        place[axis] = sign * rng.uniform(*SIZE_DEG.get(gesture, NOD_DEG))
        places[gesture] = place
    joined = {movement: GESTURES[k] for movement, k in zip(CONTOURS, order, strict=True)}
    return Habits(joined, float(rng.uniform(*LAG_S)), places)


def write(
    own: Habits, movements: pd.DataFrame, other: pd.DataFrame, coupling: float, frame_s: float, seed: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the head gestures of a record: a segment table, and the joint patterns (schema ``head_joints``).

    Parameters
    ----------
    movements : the pitch movements of the record, a segment table.
    other : those of speech that is not heard, of the same duration.
    coupling : expected share of time in which the head listens, 0 to 1.
    frame_s : spacing of prosody frames.
    """
    record = str(movements["record"].iloc[0])
    n_frames = int(movements["end_frame"].iloc[-1])
    rng = random_source(seed, "joint patterns", record)
    spans = worlds.listening(n_frames * frame_s, coupling, random_source(seed, "head listens", record))
    parts = []
    for table, coupled in ((movements, True), (other, False)):
        lag_s = np.clip(rng.normal(own.lag_s, LAG_SPREAD_S, len(table)), *LAG_LIMITS_S)
        part = table[["label", "start_frame", "start_s"]].assign(coupled=coupled)
        part["head_frame"] = np.round(table["start_s"] / frame_s - lag_s / frame_s).astype(np.int64)
        parts.append(part[worlds.listens(table["start_s"].to_numpy(), spans) == coupled])
    chosen = pd.concat(parts).sort_values(["head_frame", "start_frame"], kind="stable", ignore_index=True)
    chosen = chosen[_apart(chosen["head_frame"].tolist(), round(NEUTRAL_S / frame_s), round(SHORTEST_S / frame_s))]
    gestures = chosen["label"].map(own.joined | {NONE: REST})
    starts, labels = np.append(0, chosen["head_frame"]), np.append(REST, gestures)
    first = np.append(True, (labels[1:] != REST) | (labels[:-1] != REST))
    table = segments.from_starts(record, starts[first], labels[first], n_frames, 1.0 / frame_s)
    return table, _joints(record, chosen[gestures != REST], gestures[gestures != REST], frame_s)


def _apart(frames: list[int], earliest: int, apart: int) -> list[bool]:
    """Return which of the ascending frames are kept, so that the first is not early and none is close to the last."""
    kept, last = [], earliest - apart
    for frame in frames:
        kept.append(frame >= last + apart)
        last = frame if kept[-1] else last
    return kept


def _joints(record: str, chosen: pd.DataFrame, gestures: pd.Series, frame_s: float) -> pd.DataFrame:
    head_start_s = chosen["head_frame"].to_numpy() * frame_s
    return pd.DataFrame(
        {
            "record": record,
            "joint": np.arange(len(chosen), dtype=np.int64),
            "head": gestures.to_numpy(dtype=object),
            "melody": chosen["label"].to_numpy(dtype=object),
            "head_start_s": head_start_s,
            "melody_start_s": chosen["start_s"].to_numpy(dtype=float),
            "lag_s": chosen["start_s"].to_numpy(dtype=float) - head_start_s,
            "coupled": chosen["coupled"].to_numpy(dtype=bool),
        }
    )


def perform(own: Habits, gestures: pd.DataFrame, times_s: Floats, seed: int) -> Floats:
    """Return the angles x, y and z of the head, (T, 3) in degrees, neutral at the first of ``times_s`` (T,).

    Parameters
    ----------
    gestures : the head gestures of the record, a segment table.
    """
    rng = random_source(seed, "head", str(gestures["record"].iloc[0]))
    angles = np.zeros((len(times_s), 3))
    for start, end, label in zip(gestures["start_s"], gestures["end_s"], gestures["label"], strict=True):
        if label != REST:
            u = np.clip((times_s - start) / (end - start), 0.0, 1.0)
            course = _nods(u, end - start) if label == "nod" else _excursion(u, end - start)
            angles += rng.lognormal(0.0, SIZE_SPREAD) * course[:, None] * own.places_deg[label]
    sway = np.column_stack([degrees * wander(times_s, *SWAY_HZ, rng) for degrees in SWAY_DEG])
    return np.asarray(angles + sway * np.clip((times_s - times_s[0]) / NEUTRAL_S, 0.0, 1.0)[:, None])


def _excursion(u: Floats, duration_s: float) -> Floats:
    """Return the share of the way (T,) to the place of a gesture at its relative times (T,): there and back."""
    moves = min(MOVES_S / duration_s, MOST_MOVES)
    keys = np.array([0.0, moves, 1.0 - moves, 1.0])
    return minimum_jerk(keys, np.array([[0.0], [1.0], [1.0], [0.0]]), u)[:, 0]


def _nods(u: Floats, duration_s: float) -> Floats:
    """Return the share of the way down (T,) at the relative times (T,) of a gesture."""
    return np.sin(np.pi * max(1, round(duration_s / NOD_S)) * u) ** 2


def truth(own: dict[str, Habits]) -> pd.DataFrame:
    """Return the habits of actors as a table (schema ``head_habits``)."""
    rows = [
        (actor, movement, gesture, habit.lag_s, *habit.places_deg[gesture])
        for actor, habit in own.items()
        for movement, gesture in habit.joined.items()
    ]
    return pd.DataFrame(rows, columns=["actor", "melody", "head", "lag_s", "x_deg", "y_deg", "z_deg"])
