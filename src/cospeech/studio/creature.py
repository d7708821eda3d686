"""A creature with eight limbs, and its motion: a library of gestures that no human body makes (Levine 2010, 9.2).

The limbs lie around a mantle and have four joints each. At rest they droop to the ground. In a gesture, several of
them rise, sway and curl one after the other, stroke by stroke. Arousal changes how fast and how far, as in an actor.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.studio import arousal
from cospeech.studio.choreography import minimum_jerk
from cospeech.studio.motion import wander

N_LIMBS = 8
BONES_M = (0.16, 0.15, 0.13, 0.11)
"""Lengths of the bones of a limb; the last one ends in its tip."""

MANTLE_M = (0.0, 0.45, 0.0)
RIM_M, RIM_HEIGHT_M = 0.12, -0.04
HEAD_M, CROWN_M = (0.0, 0.10, 0.0), (0.0, 0.22, 0.0)
"""Position of the mantle above the ground, of the first joints of the limbs around it, and of the head above it."""

AT_REST = (-24.0, 0.0, -9.0)
LIFT_DEG, SWAY_DEG, CURL_DEG = (20.0, 75.0), (-35.0, 35.0), (-12.0, 40.0)
"""Angles of a limb (lift of its first joint, sway, and bend of the others) at rest, and their ranges in a stroke."""

LOWEST_DEG, HIGHEST_DEG = (-24.0, -60.0, -12.0), (85.0, 60.0, 50.0)
"""Limits of these angles; a limb that was lower would enter the ground."""

REST_S, STROKE_S, HOLD_S = (0.8, 2.5), (0.35, 0.8), (0.0, 0.4)
N_STROKES = (2, 6)
MOVING = 0.6
DELAY_S = 0.06
"""Durations of rests, strokes and holds; strokes per gesture; share of the limbs that move in a gesture; delay from
one limb to the next."""

FRAME_S = 0.025
"""Time step of the arousal."""


def skeleton() -> tuple[tuple[str, ...], tuple[int, ...], Floats, dict[int, Floats]]:
    """Return joint names (J,), parents (J,), offsets (J, 3) in metres, and the tips of the last bones by joint."""
    names, parents, offsets = ["mantle", "head"], [-1, 0], [np.array(MANTLE_M), np.array(HEAD_M)]
    tips = {1: np.array(CROWN_M)}
    for limb, outward in enumerate(_outward()):
        for bone in range(len(BONES_M)):
            names.append(f"limb{limb + 1}_{bone + 1}")
            parents.append(len(names) - 2 if bone else 0)
            rim = RIM_M * outward + (0.0, RIM_HEIGHT_M, 0.0)
            offsets.append(BONES_M[bone - 1] * outward if bone else rim)
        tips[len(names) - 1] = BONES_M[-1] * outward
    return tuple(names), tuple(parents), np.array(offsets), tips


def _outward() -> Floats:
    """Return the directions (8, 3) in which the limbs lie."""
    angle = 2.0 * np.pi * (np.arange(N_LIMBS) + 0.5) / N_LIMBS
    return np.column_stack([np.sin(angle), np.zeros(N_LIMBS), np.cos(angle)])


def perform(record: str, duration_s: float, fps: float, seed: int) -> Clip:
    """Return the motion of the creature in metres, y up.

    Parameters
    ----------
    record : name of the recording, from which, with the seed, all of its motion follows.
    """
    rng = random_source(seed, "creature", record)
    times_s = frame_times(round(duration_s * fps), fps)
    own = arousal.model("creature", seed, FRAME_S)
    shown = arousal.write(own, record, int(duration_s / FRAME_S) + 1, 0.0, FRAME_S, seed)[1]
    pace, size = (arousal.effect(shown, effect, times_s) for effect in (arousal.PACE, arousal.SIZE))
    names, parents, offsets, tips = skeleton()
    limbs = _limbs(times_s, pace, size, rng)
    rotations = np.tile(np.eye(3), (len(times_s), len(names), 1, 1))
    for limb, outward in enumerate(_outward()):
        across = np.cross(outward, (0.0, 1.0, 0.0))
        lift, sway, curl = limbs[limb].T
        for bone in range(len(BONES_M)):
            raised = np.outer(np.radians(curl if bone else lift), across)
            aside = np.outer(np.radians(sway / len(BONES_M)), (0.0, 1.0, 0.0))
            turned = rotation.from_vectors(aside) @ rotation.from_vectors(raised)
            rotations[:, names.index(f"limb{limb + 1}_{bone + 1}")] = turned
    leaning = np.column_stack([4.0 * wander(times_s, 0.05, 0.4, rng) for _ in range(3)])
    rotations[:, 1] = rotation.from_vectors(np.radians(leaning))
    bobbing = np.column_stack(
        [np.zeros(len(times_s)), 0.012 * wander(times_s, 0.2, 0.6, rng), np.zeros(len(times_s))]
    )
    return Clip(names, parents, rotations, {0: MANTLE_M + bobbing}, fps, offsets, tips)


def _limbs(times_s: Floats, pace: Floats, size: Floats, rng: np.random.Generator) -> Floats:
    """Return the angles (8, T, 3) of the limbs in degrees: lift, sway and curl."""
    rest = np.array(AT_REST)
    keys_s: list[list[float]] = [[0.0] for _ in range(N_LIMBS)]
    values: list[list[Floats]] = [[rest] for _ in range(N_LIMBS)]
    time_s, end_s = 0.0, float(times_s[-1])
    while time_s < end_s:
        time_s += rng.uniform(*REST_S)
        moving = np.flatnonzero(rng.random(N_LIMBS) < MOVING)
        n_strokes = int(rng.integers(*N_STROKES, endpoint=True))
        for stroke in range(n_strokes + 1):
            now = min(int(np.searchsorted(times_s, time_s)), len(times_s) - 1)
            lasting = rng.uniform(*STROKE_S) / pace[now]
            drawn = np.array([rng.uniform(*limits) for limits in (LIFT_DEG, SWAY_DEG, CURL_DEG)])
            for place, limb in enumerate(moving):
                varied = rest + size[now] * (drawn - rest) * rng.uniform(0.7, 1.1, 3)
                target = rest if stroke == n_strokes else np.clip(varied, LOWEST_DEG, HIGHEST_DEG)
                start = max(time_s + DELAY_S * place, keys_s[limb][-1])
                keys_s[limb] += [start, start + lasting]
                values[limb] += [values[limb][-1], target]
            time_s += lasting + DELAY_S * len(moving) + rng.uniform(*HOLD_S)
    courses = [
        minimum_jerk(np.array(key_s), np.array(value), times_s) for key_s, value in zip(keys_s, values, strict=True)
    ]
    idle = [[2.0 * wander(times_s, 0.1, 0.5, rng) for _ in AT_REST] for _ in range(N_LIMBS)]
    return np.array(courses) + np.moveaxis(np.array(idle), 1, 2)
