"""The choreography: keyframes of the hands in every gesture phrase.

A gesture phrase consists of phases (Kendon; McNeill): preparation, stroke, retraction. The stroke is a series of
beats at the actor's own pace, sometimes with a hold. If rest follows, the hands come down before the phrase ends, so
that the next one starts at rest. If another gesture follows, the phrase blends into its preparation, and the boundary
lies within one movement. Between two keyframes a hand moves with minimum jerk.

Positions are in metres in the frame of the chest, relative to the midpoint between the shoulders: outward (towards
the side of the hand), up, forward.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source

Place = tuple[float, float, float]

SIDES = ("left", "right")
REST: Place = (0.23, -0.515, 0.05)
DOWN_AND_BACK: Place = (0.5, -0.5, -0.7)
BACK: Place = (0.1, -0.5, -0.85)


@dataclass(frozen=True)
class Hand:
    """What one hand does in a class of gestures.

    Attributes
    ----------
    place : position of the stroke.
    beat : displacement of a beat from there.
    lag : delay relative to the other hand, as a fraction of a beat.
    pole : direction in which the elbow points.
    turn_deg : rotation of the forearm; positive turns the palm to the front and up.
    bend_deg : inward flexion of the wrist.
    """

    place: Place
    beat: Place = (0.0, 0.0, 0.0)
    lag: float = 0.0
    pole: Place = DOWN_AND_BACK
    turn_deg: float = 0.0
    bend_deg: float = 0.0


AT_REST = Hand(REST)
RAISED = Hand((0.22, -0.07, 0.33), (0.02, -0.13, 0.03), turn_deg=20.0)
UP_ALONE = Hand((0.24, -0.02, 0.34), (0.05, -0.14, 0.02), turn_deg=10.0)
VERTICAL = Hand((0.17, 0.00, 0.32), (0.0, -0.19, 0.02), turn_deg=-20.0)
HORIZONTAL = Hand((0.10, -0.22, 0.32), (0.20, 0.0, -0.02), lag=0.4, turn_deg=45.0)
TOUCHING = Hand((0.036, -0.24, 0.27), (0.0, -0.06, 0.03), turn_deg=0.0, bend_deg=-25.0)
OPENED = Hand((0.53, -0.26, -0.17), (0.05, 0.08, -0.04), pole=BACK, turn_deg=60.0)

FIGURES: dict[str, tuple[Hand, Hand]] = {
    "raise_both": (RAISED, RAISED),
    "rest": (AT_REST, AT_REST),
    "left": (UP_ALONE, AT_REST),
    "perpendicular": (VERTICAL, HORIZONTAL),
    "contact": (TOUCHING, TOUCHING),
    "open": (OPENED, OPENED),
    "right": (AT_REST, UP_ALONE),
}
"""The left and right hand in each class of Özkul 2012, Table 4.1; 'perpendicular' is for a left-handed actor."""

PREPARATION = (0.30, 0.32, 0.75)
RETRACTION = (0.33, 0.38, 0.85)
"""Duration of the phase as a fraction of the phrase, and its limits in seconds."""

LETS_GO = (0.15, 0.16, 0.30)
"""The same for the end of a phrase that is followed by another gesture."""


RIGHT_HANDED = 0.9
HOLD = 1.5
"""Duration of a hold in half beats."""

UNAWARE_S = 2.0
"""Minimum planned duration of the last gesture of a record, which the end of the record cuts off."""


@dataclass(frozen=True)
class Style:
    """How an actor moves: size and position of gestures, pace of beats, handedness, holds, sway of trunk and head."""

    size: float
    height_m: float
    forward_m: float
    beat_s: float
    right_handed: bool
    holds: float
    sway: float


def style(actor: str, seed: int) -> Style:
    """Return the style of ``actor``, sampled from the seed and the actor's name."""
    rng = random_source(seed, "style", actor)
    return Style(
        size=rng.uniform(0.85, 1.15),
        height_m=rng.uniform(-0.02, 0.04),
        forward_m=rng.uniform(-0.02, 0.02),
        beat_s=rng.uniform(0.42, 0.60),
        right_handed=rng.random() < RIGHT_HANDED,
        holds=rng.uniform(0.15, 0.40),
        sway=rng.uniform(0.8, 1.2),
    )


@dataclass
class Track:
    """The keyframes of one hand: times (K,), and values (K, 8) of position, pole, turn and bend."""

    times_s: list[float] = field(default_factory=list)
    values: list[Floats] = field(default_factory=list)

    def key(self, time_s: float, value: Floats) -> None:
        """Add a keyframe; keyframes must be in temporal order, and a second one at the same time is ignored."""
        if not self.times_s or time_s > self.times_s[-1] + 1e-9:
            self.times_s.append(time_s)
            self.values.append(value)

    def at(self, times_s: Floats) -> Floats:
        """Return the values (T, 8) at ``times_s`` (T,), by minimum-jerk interpolation between keyframes."""
        return minimum_jerk(np.array(self.times_s), np.array(self.values), times_s)


def minimum_jerk(key_times_s: Floats, values: Floats, times_s: Floats) -> Floats:
    """Return minimum-jerk interpolation (T, C) between keyframes, at rest at each of them (Flash and Hogan 1985)."""
    left = np.clip(np.searchsorted(key_times_s, times_s, side="right") - 1, 0, max(len(key_times_s) - 2, 0))
    right = np.minimum(left + 1, len(key_times_s) - 1)
    span = np.maximum(key_times_s[right] - key_times_s[left], 1e-9)
    u = np.clip((times_s - key_times_s[left]) / span, 0.0, 1.0)
    share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return values[left] + share[:, None] * (values[right] - values[left])


def tracks(gestures: pd.DataFrame, manner: Style, rng: np.random.Generator) -> tuple[Track, Track]:
    """Return the keyframes of the left and the right hand for the gesture phrases of one record."""
    hands = (Track(), Track())
    labels = gestures["label"].tolist()
    for row, (label, start, end) in enumerate(zip(labels, gestures["start_s"], gestures["end_s"], strict=True)):
        following = labels[row + 1] if row + 1 < len(labels) else None
        if label == "rest":
            for track in hands:
                value = pose(AT_REST, manner, rng, 0.3)
                track.key(start, value)
                track.key(end, value)
        else:
            _phrase(hands, label, float(start), float(end), following, manner, rng)
    return hands


def _phrase(
    hands: tuple[Track, Track],
    label: str,
    start: float,
    end: float,
    following: str | None,
    manner: Style,
    rng: np.random.Generator,
) -> None:
    figure = FIGURES[label]
    if following is None:  # the end of the record cuts the phrase off, which the actor does not anticipate
        end = max(end, start + UNAWARE_S)
    if label == "perpendicular" and manner.right_handed:
        figure = figure[::-1]
    begin = start + phase_s(PREPARATION, end - start) * rng.uniform(0.85, 1.15)
    leave = phase_s(RETRACTION if following == "rest" else LETS_GO, end - start)
    stop = end if following is None else end - leave * rng.uniform(0.85, 1.15)
    times = turns(begin, stop, manner, rng)
    size = manner.size * rng.lognormal(0.0, 0.2)
    common = rng.normal(0.0, 0.04, 3)
    for track, hand in zip(hands, figure, strict=True):
        if hand is AT_REST:
            value = pose(hand, manner, rng, 0.3)
            times_here, values = [begin, stop], [value, value]
        else:
            times_here, values = _stroke(hand, times, size, pose(hand, manner, rng, 0.4, common))
        if not track.times_s:
            track.key(start, pose(AT_REST, manner, rng, 0.3))
        for time_s, value in zip(times_here, values, strict=True):
            track.key(time_s, value)
        if following == "rest":
            track.key(end, pose(AT_REST, manner, rng, 0.3))


def phase_s(law: tuple[float, float, float], duration_s: float) -> float:
    """Return the duration of a phase: a fraction of the phrase within limits, and at most 42 % of it."""
    share, shortest, longest = law
    return min(max(share * duration_s, shortest), longest, 0.42 * duration_s)


def turns(begin: float, stop: float, manner: Style, rng: np.random.Generator) -> Floats:
    """Return the turning points of the beats from ``begin`` to ``stop``: two per beat, with natural irregularity."""
    pace_s = manner.beat_s / 2 * rng.uniform(1.1, 1.8)
    held = HOLD * (rng.random() < manner.holds)  # in half beats
    halves = max(1, round((stop - begin) / pace_s - held))
    steps = rng.uniform(0.8, 1.2, halves)
    steps[int(rng.integers(halves))] += held
    return begin + (stop - begin) * np.append(0.0, np.cumsum(steps) / steps.sum())


def _stroke(hand: Hand, times: Floats, size: float, base: Floats) -> tuple[list[float], list[Floats]]:
    """Return the keyframes of one hand's beats; a hand with a lag turns between the turning points of the other."""
    late = times.copy()
    if len(times) > 2:
        late[1:-1] += hand.lag * (times[2:] - times[1:-1])
    away = np.zeros(8)
    away[:3] = size * np.array(hand.beat)
    return late.tolist(), [base + (away if turn % 2 else 0.0) for turn in range(len(times))]


def pose(hand: Hand, manner: Style, rng: np.random.Generator, spread: float, common: Floats | None = None) -> Floats:
    """Return the keyframe values of one hand: those of its class in the actor's style, with random variation."""
    value = np.array([*hand.place, *hand.pole, hand.turn_deg, hand.bend_deg])
    value[:3] += rng.normal(0.0, 0.02 * spread, 3)
    value[3:6] += rng.normal(0.0, 0.10 * spread, 3)
    value[6:] += rng.normal(0.0, 12.0 * spread, 2)
    if hand is not AT_REST:
        value[1] += manner.height_m
        value[2] += manner.forward_m
    if common is not None:
        value[:3] += common if hand is not TOUCHING else common * (0.0, 1.0, 1.0)
    return value
