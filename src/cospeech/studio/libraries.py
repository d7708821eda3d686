"""Motion libraries without speech, in the situations of Levine et al. 2010, table 1.

An actor stands, sits, holds a phone to the ear, holds a mug and drinks from it, or sits and eats with a fork. The
free hands gesture with changing arousal. ``creature`` makes the library of a body that is not human.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.motion.skeleton import JOINTS
from cospeech.studio import motion, performance, scenes
from cospeech.studio.choreography import REST, SIDES, Place, Track, style
from cospeech.studio.worlds import Couplings

FRAME_S, MAX_DURATION_S = 0.025, 10.0
"""Time step and longest gesture phrase of the script."""

LONGEST_S = 60.0
"""Longest recording of a library, which consists of recordings of about equal length."""


@dataclass(frozen=True)
class Held:
    """What the right hand holds.

    Attributes
    ----------
    place : where it is held, as in ``choreography``.
    turn_deg : rotation of the forearm.
    mouth : where it is brought from time to time, None if it stays.
    every_s : shortest and longest time between two of these movements.
    """

    place: Place
    turn_deg: float
    mouth: Place | None = None
    every_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Situation:
    """Whether the actor sits, what the right hand holds, and how far the head is tilted to the right in degrees."""

    seated: bool = False
    held: Held | None = None
    tilt_deg: float = 0.0


SITUATIONS = {
    "standard": Situation(),
    "seated": Situation(seated=True),
    "phone": Situation(held=Held((0.11, 0.21, 0.07), -30.0), tilt_deg=8.0),
    "mug": Situation(held=Held((0.13, -0.20, 0.33), 0.0, (0.04, 0.09, 0.19), (7.0, 14.0))),
    "fork": Situation(seated=True, held=Held((0.09, -0.30, 0.34), 20.0, (0.03, 0.09, 0.18), (2.5, 5.0))),
}

SEAT_M, STEP_M = -0.42, 0.42
"""Displacement of the hips of an actor who sits, and how far the feet are in front of them."""

THIGH: Place = (0.15, -0.36, 0.26)
LAP_M = 0.25
"""Place of a resting hand of an actor who sits, and the height above it from which a hand gestures freely."""

ELBOW: Place = (0.6, -0.9, 0.2)
"""Direction in which the elbow of the right arm points when the hand is near the head."""

TO_MOUTH_S, AT_MOUTH_S = 0.7, (0.4, 1.2)
"""Duration of the way to the mouth or back, and range of the time between the two."""


def durations_s(total_s: float) -> list[float]:
    """Return the lengths of the recordings of a library of ``total_s`` seconds, whole seconds but for the last."""
    edges = np.linspace(0.0, total_s, int(np.ceil(total_s / LONGEST_S)) + 1)
    edges[:-1] = edges[:-1].round()
    return np.diff(edges).tolist()


def perform(library: str, record: str, duration_s: float, fps: float, seed: int) -> pd.DataFrame:
    """Return the noise-free motion table of one recording.

    Parameters
    ----------
    library : a key of ``SITUATIONS``; it is also the name of the actor.
    record : name of the recording, from which, with the seed, all of its motion follows.
    """
    situation, manner = SITUATIONS[library], style(library, seed)
    rng = random_source(seed, "library", record)
    own = scenes.player(library, "vigour", seed, FRAME_S, MAX_DURATION_S)
    scene = scenes.write(own, record, duration_s + FRAME_S, Couplings(None, 0.0, None), FRAME_S, seed)
    times_s = frame_times(round(duration_s * fps), fps)
    moving = performance.hands(scene, None, manner, times_s, rng)
    if situation.seated:
        for values in moving:
            free = np.clip((values[:, 1] - REST[1]) / LAP_M, 0.0, 1.0)
            values[:, :3] += np.outer(1.0 - free, np.subtract(THIGH, REST))
    if situation.held is not None:
        moving[SIDES.index("right")] = _holding(situation.held, times_s, rng)
    tilt = np.tile([0.0, 0.0, situation.tilt_deg], (len(times_s), 1))
    degrees = dict.fromkeys(JOINTS, np.zeros((len(times_s), 3)))
    degrees |= motion.trunk(times_s, moving, lambda _: tilt, manner, rng)
    for side, values in zip(SIDES, moving, strict=True):
        degrees |= motion.arm(side, values, times_s, rng)
    root_m = motion.standing(times_s, rng)
    if situation.seated:
        root_m = 0.2 * root_m + (0.0, SEAT_M, 0.0)
    return motion.table(degrees, root_m, fps, STEP_M if situation.seated else 0.0)


def _holding(held: Held, times_s: Floats, rng: np.random.Generator) -> Floats:
    """Return the values (T, 8) of a hand that holds something (see ``choreography.Track``)."""
    track = Track()
    here, there = (np.array([*place, *ELBOW, held.turn_deg, 0.0]) for place in (held.place, held.mouth or REST))
    track.key(0.0, here)
    while held.mouth is not None and track.times_s[-1] < times_s[-1]:
        leaves_s = track.times_s[-1] + rng.uniform(*held.every_s)
        back_s = leaves_s + TO_MOUTH_S + rng.uniform(*AT_MOUTH_S)
        for time_s, value in ((leaves_s, here), (leaves_s + TO_MOUTH_S, there), (back_s, there)):
            track.key(time_s, value)
        track.key(back_s + TO_MOUTH_S, here)
    values = track.at(times_s)
    values[:, :3] += 0.012 * np.column_stack([motion.wander(times_s, 0.1, 0.7, rng) for _ in range(3)])
    return values
