"""Head and hands: nods and tilts with pitch accents, and directional hand gestures with keywords.

Each accent has a gesture of the head with a given probability, whose onset is normally distributed around that of the
accent; so has each keyword a gesture of the hands. Further gestures come at any time, independently of speech.
Gestures of one kind do not overlap: one that would overlap an earlier one is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.studio.directions import sentences
from cospeech.studio.directions.settings import Settings
from cospeech.studio.directions.voice import Event, Spoken

FPS = 30.0
"""Frame rate of head and hands."""
NODS = 66 / 81
"""Share of nods among the gestures of the head (3.4.2)."""
NOD_S, TILT_S, HAND_S = (0.35, 0.6), (0.6, 1.1), (0.9, 1.5)
"""Ranges of the durations of gestures."""
NOD_DEG, TILT_DEG = (2.5, 9.0), (3.0, 10.0)
"""Ranges of their sizes. The 45 degrees of 3.3.3 are hardly possible while speaking."""
HAND_LEAD_S, HAND_LAG_S = 0.25, 0.2
"""Mean time by which hand gestures begin before their keywords, and its standard deviation."""
HEAD_ALONE, HAND_ALONE = 0.08, 0.02
"""Rates of gestures that are independent of speech, per second."""
SIDE_M, HEIGHT_M = (0.05, 0.3), (0.05, 0.25)
"""Ranges of how far a hand moves to the side, and up."""
SWAY_DEG, SWAY_M, SWAY_S = 1.8, 0.07, 0.2
"""Standard deviations of other movements of the head and of the hands, and their time scale."""
NOISE_DEG, NOISE_M = 0.15, 0.004
"""Standard deviations of the error of measurement."""
NOD_TURNS, SETTLES = 0.35, 0.25
"""Share of a nod at which the head is lowest, and share of other gestures that rise and fall each take."""
COLUMNS = ["x_deg", "y_deg", "z_deg", "left_x_m", "left_y_m", "right_x_m", "right_y_m"]


class Performance(NamedTuple):
    """Gestures of the head and of the hands in an answer, and the movement of both, (T, 7) of ``COLUMNS``."""

    head: list[Event]
    hand: list[Event]
    movement: Floats


def perform(record: str, spoken: Spoken, duration_s: float, settings: Settings, seed: int) -> Performance:
    """Return the gestures and movements that accompany an answer of ``duration_s`` seconds."""
    rng = random_source(seed, "directions", "gestures", record)
    accents = [syllable for syllable in spoken.syllables if syllable.label == "accent"]
    keywords = [word for word in spoken.words if word.label in sentences.KEYWORDS]
    head = [
        _head(accent.start_s + settings.head_lag_s * rng.standard_normal(), rng)
        for accent in accents
        if rng.random() < settings.accents_with_head
    ]
    hand = [
        _hand(keyword.start_s - HAND_LEAD_S + HAND_LAG_S * rng.standard_normal(), keyword.label, rng)
        for keyword in keywords
        if rng.random() < settings.keywords_with_hand
    ]
    head += [_head(at_s, rng) for at_s in _alone(HEAD_ALONE, duration_s, rng)]
    hand += [_hand(at_s, _any_keyword(rng), rng) for at_s in _alone(HAND_ALONE, duration_s, rng)]
    head, hand = _apart(head, duration_s), _apart(hand, duration_s)
    return Performance(head, hand, _movement(head, hand, duration_s, rng))


def _head(start_s: float, rng: np.random.Generator) -> Event:
    label = "nod" if rng.random() < NODS else "tilt"
    return Event(start_s, start_s + rng.uniform(*(NOD_S if label == "nod" else TILT_S)), label)


def _hand(start_s: float, label: str, rng: np.random.Generator) -> Event:
    return Event(start_s, start_s + rng.uniform(*HAND_S), label)


def _any_keyword(rng: np.random.Generator) -> str:
    return sentences.KEYWORDS[rng.integers(len(sentences.KEYWORDS))]


def _alone(rate: float, duration_s: float, rng: np.random.Generator) -> list[float]:
    """Return times of gestures that are independent of speech, in seconds."""
    found: list[float] = rng.uniform(0.0, duration_s, rng.poisson(rate * duration_s)).tolist()
    return found


def _apart(events: list[Event], duration_s: float) -> list[Event]:
    """Return the events within an answer, in order, without those that overlap one that was planned before."""
    kept: list[Event] = []
    for event in events:
        inside = event.start_s >= 0.0 and event.end_s <= duration_s
        if inside and all(event.end_s <= one.start_s or event.start_s >= one.end_s for one in kept):
            kept.append(event)
    return sorted(kept)


def _movement(head: list[Event], hand: list[Event], duration_s: float, rng: np.random.Generator) -> Floats:
    """Return head angles and hand positions (T, 7), ``COLUMNS``."""
    times_s = frame_times(int(duration_s * FPS), FPS)
    found = _sway(len(times_s), rng)
    for event in head:
        share = _share(event, times_s)
        if event.label == "nod":
            found[:, 0] += rng.uniform(*NOD_DEG) * _nod(share)
        else:
            found[:, 2] += rng.choice([-1.0, 1.0]) * rng.uniform(*TILT_DEG) * _held(share)
    for event in hand:
        course = _held(_share(event, times_s))
        if event.label in ("left", "straight"):
            found[:, 3] += (rng.uniform(*SIDE_M) if event.label == "left" else 0.0) * course
            found[:, 4] += rng.uniform(*HEIGHT_M) * course
        if event.label in ("right", "straight"):
            found[:, 5] -= (rng.uniform(*SIDE_M) if event.label == "right" else 0.0) * course
            found[:, 6] += rng.uniform(*HEIGHT_M) * course
    return found + np.array([NOISE_DEG] * 3 + [NOISE_M] * 4) * rng.standard_normal(found.shape)


def _share(event: Event, times_s: Floats) -> Floats:
    """Return how much of an event is over at each time, 0 to 1."""
    return np.clip((times_s - event.start_s) / (event.end_s - event.start_s), 0.0, 1.0)


def _nod(share: Floats) -> Floats:
    """Return the course of a nod: the head comes down and sharply comes back up."""
    course = np.where(share < NOD_TURNS, share / NOD_TURNS, (1.0 - share) / (1.0 - NOD_TURNS))
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * course))


def _held(share: Floats) -> Floats:
    """Return the course of a gesture that is held between its rise and its fall."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(share, 1.0 - share) / SETTLES, 0.0, 1.0)))


def _sway(n_frames: int, rng: np.random.Generator) -> Floats:
    """Return movements that are no gestures, (n_frames, 7): noise, smoothed over ``SWAY_S``."""
    reach = np.arange(-round(3 * SWAY_S * FPS), round(3 * SWAY_S * FPS) + 1) / FPS
    kernel = np.exp(-0.5 * (reach / SWAY_S) ** 2)
    kernel /= np.sqrt((kernel**2).sum())
    noise = rng.standard_normal((n_frames + len(kernel) - 1, len(COLUMNS)))
    smooth = np.column_stack([np.convolve(column, kernel, mode="valid") for column in noise.T])
    return smooth * np.array([SWAY_DEG] * 3 + [SWAY_M] * 4)


def movement_table(record: str, movement: Floats) -> pd.DataFrame:
    """Return a movement (T, 7) as a table (schema ``direction_movement``)."""
    table = pd.DataFrame(movement, columns=COLUMNS)
    table.insert(0, "record", record)
    table.insert(1, "frame", np.arange(len(movement)))
    table.insert(2, "time_s", frame_times(len(movement), FPS))
    return table


def event_table(record: str, tiers: dict[str, list[Event]]) -> pd.DataFrame:
    """Return the events of an answer as a table (schema ``direction_events``), one tier below the other."""
    rows = [(record, tier, number, *event) for tier, events in tiers.items() for number, event in enumerate(events)]
    return pd.DataFrame(rows, columns=["record", "tier", "event", "start_s", "end_s", "label"])
