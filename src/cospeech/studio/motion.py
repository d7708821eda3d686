"""Motion of the whole body: joint angles from the choreography of the hands.

The trunk sways slowly, breathes and turns towards the gesturing hand; the head sways and nods with the voice; the
hips shift the weight from leg to leg while the feet stay in place. Arms and legs follow by two-bone inverse
kinematics.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.motion import skeleton
from cospeech.motion.skeleton import JOINTS, OFFSET_M
from cospeech.studio.choreography import SIDES, Style, style, tracks
from cospeech.studio.limbs import reach
from cospeech.studio.patterns import PATTERNS

UPPER_ARM_M, FOREARM_M = (float(-OFFSET_M[f"left_{bone}"][1]) for bone in ("forearm", "hand"))
THIGH_M, SHIN_M = (float(-OFFSET_M[f"left_{bone}"][1]) for bone in ("shin", "foot"))
KNEES_SOFT_M = 0.008
"""How much softly flexed knees lower the hips."""

NOD = {"p3": 2.0, "p4": 2.5, "p5": 3.5, "p6": 4.5, "p7": 6.0}
"""Depth in degrees of the nod with each prosody pattern."""


def perform(
    actor: str, record: str, gestures: pd.DataFrame, prosody: pd.DataFrame, fps: float, seed: int
) -> pd.DataFrame:
    """Return the noise-free motion table of one record.

    Parameters
    ----------
    gestures, prosody : the segment tables of the record in the script.
    fps : frame rate of the motion.
    """
    rng = random_source(seed, "motion", record)
    manner = style(actor, seed)
    duration_s = float(gestures["end_s"].iloc[-1])
    times_s = frame_times(round(duration_s * fps), fps)
    hands = tracks(gestures, manner, rng)
    moving = [track.at(times_s) for track in hands]
    degrees = dict.fromkeys(JOINTS, np.zeros((len(times_s), 3)))

    def nod(generator: np.random.Generator) -> Floats:
        return np.outer(_nods(times_s, prosody, generator), (1.0, 0.0, 0.0))

    degrees |= trunk(times_s, moving, nod, manner, rng)
    for side, values in zip(SIDES, moving, strict=True):
        degrees |= arm(side, values, times_s, rng)
    return table(degrees, standing(times_s, rng), fps)


def table(degrees: dict[str, Floats], root_m: Floats, fps: float, step_m: float = 0.0) -> pd.DataFrame:
    """Return the motion table of joint angles (T, 3) in degrees, with legs whose feet stay flat and in place.

    Parameters
    ----------
    degrees : the angles of all joints but those of the legs, which are replaced.
    root_m : (T, 3) displacement of the hips.
    step_m : distance of the feet in front of their place below a standing actor, as they are in front of a chair.
    """
    whole = degrees | legs(root_m, degrees["hips"], step_m)
    angles = skeleton.unwrap(np.stack([whole[joint] for joint in JOINTS], axis=1))
    return skeleton.motion_table(root_m, angles, fps)


def with_sensor_noise(motion: pd.DataFrame, noise_deg: float, record: str, seed: int) -> pd.DataFrame:
    """Return the motion as from motion capture, with white noise on every joint angle."""
    columns = skeleton.angle_columns()
    noise = random_source(seed, "sensor", record).normal(0.0, noise_deg, (len(motion), len(columns)))
    return motion.assign(**{column: motion[column] + noise[:, k] for k, column in enumerate(columns)})


def wander(times_s: Floats, slow_hz: float, fast_hz: float, rng: np.random.Generator) -> Floats:
    """Return a smooth random signal (T,) of unit variance: a few sines between two frequencies."""
    hertz = rng.uniform(slow_hz, fast_hz, 5)
    phase = rng.uniform(0.0, 2.0 * np.pi, 5)
    return np.sin(2.0 * np.pi * hertz * times_s[:, None] + phase).sum(axis=1) / np.sqrt(2.5)


def trunk(
    times_s: Floats,
    moving: list[Floats],
    head: Callable[[np.random.Generator], Floats],
    manner: Style,
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """Return the angles (T, 3) in degrees of hips, spine, chest, neck and head.

    Parameters
    ----------
    moving : values (T, 8) of both hands, towards which the trunk turns.
    head : returns the turn of the head about x, y and z, (T, 3) in degrees, to which sway is added.
    """
    lifted = [np.clip((values[:, 1] + 0.5) / 0.4, 0.0, 1.0) for values in moving]
    towards = 5.0 * (lifted[0] - lifted[1])  # positive turns to the left
    spread = np.clip((moving[0][:, 0] + moving[1][:, 0]) / 2 - 0.3, 0.0, 0.2) / 0.2
    breath = np.sin(2.0 * np.pi * rng.uniform(0.22, 0.30) * times_s + rng.uniform(0.0, 6.0))
    chest = 1.0 + 0.5 * breath - 3.0 * spread

    def sway(degrees: float, slow_hz: float = 0.03, fast_hz: float = 0.25) -> Floats:
        return manner.sway * degrees * wander(times_s, slow_hz, fast_hz, rng)

    turn = head(rng)
    return {
        "hips": np.column_stack([sway(0.4), sway(0.8), sway(0.4)]),
        "spine": np.column_stack([1.0 + sway(0.7), 0.4 * towards + sway(0.8), sway(0.7)]),
        "chest": np.column_stack([chest + sway(0.6), 0.6 * towards + sway(0.8), sway(0.6)]),
        "neck": 0.3 * turn + np.column_stack([sway(0.8), sway(2.0, 0.05, 0.5), sway(0.8)]),
        "head": 0.7 * turn + np.column_stack([sway(1.5, 0.05, 0.6), sway(3.5, 0.05, 0.5), sway(1.5, 0.05, 0.5)]),
    }


def _nods(times_s: Floats, prosody: pd.DataFrame, rng: np.random.Generator) -> Floats:
    """Return the head nods (T,) in degrees: down and up once in each spoken intonation phrase."""
    nods = np.zeros(len(times_s))
    speaking = [pattern.name for pattern in PATTERNS if pattern.speaks]
    for start, end, label in zip(prosody["start_s"], prosody["end_s"], prosody["label"], strict=True):
        if label in speaking:
            length = min(end - start, 0.7)
            depth = NOD.get(label, 1.0) * rng.uniform(0.6, 1.4) * min(1.0, length / 0.5) ** 2
            first, last = np.searchsorted(times_s, [start, start + length])
            nods[first:last] += depth * np.sin(np.pi * (times_s[first:last] - start) / length) ** 2
    return nods


def arm(side: str, values: Floats, times_s: Floats, rng: np.random.Generator) -> dict[str, Floats]:
    """Return the angles of arm, forearm and hand that follow the interpolated ``values`` (T, 8) of one hand."""
    mirror = 1.0 if side == "left" else -1.0
    outward = np.array([mirror, 1.0, 1.0])
    shoulder = OFFSET_M[f"{side}_arm"]
    idle = 0.004 * np.column_stack([wander(times_s, 0.1, 0.6, rng) for _ in range(3)])
    target = (values[:, :3] + idle) * outward - (shoulder[0], 0.0, 0.0)
    turned, elbow = reach(target, values[:, 3:6] * outward, UPPER_ARM_M, FOREARM_M, "forward")
    still = np.zeros(len(values))
    drop = -8.0 + 2.0 * wander(times_s, 0.2, 1.0, rng)
    return {
        f"{side}_arm": skeleton.euler(turned),
        f"{side}_forearm": np.column_stack([elbow, mirror * values[:, 6], still]),
        f"{side}_hand": np.column_stack([drop, still, -mirror * values[:, 7]]),
    }


def standing(times_s: Floats, rng: np.random.Generator) -> Floats:
    """Return the displacement of the hips (T, 3) in metres of an actor who shifts the weight from leg to leg."""
    aside, ahead = 0.012 * wander(times_s, 0.03, 0.15, rng), 0.006 * wander(times_s, 0.03, 0.2, rng)
    return np.column_stack([aside, np.full(len(times_s), -KNEES_SOFT_M), ahead])


def legs(root_m: Floats, hips_deg: Floats, step_m: float = 0.0) -> dict[str, Floats]:
    """Return the angles (T, 3) in degrees of the legs, which keep the feet flat and in place; see ``table``."""
    turned = skeleton.rotations(hips_deg)
    upright = np.swapaxes(turned, 1, 2)
    forward = np.broadcast_to([0.0, 0.0, 1.0], root_m.shape)
    angles: dict[str, Floats] = {}
    for side in SIDES:
        thigh = OFFSET_M[f"{side}_thigh"]
        floor_spot = thigh - (0.0, THIGH_M + SHIN_M, -step_m)
        target = np.einsum("tij,tj->ti", upright, floor_spot - root_m) - thigh
        rotation, knee = reach(target, forward, THIGH_M, SHIN_M, "backward")
        still = np.zeros(len(knee))
        shin = np.column_stack([knee, still, still])
        stands = turned @ rotation @ skeleton.rotations(shin)
        angles |= {
            f"{side}_thigh": skeleton.euler(rotation),
            f"{side}_shin": shin,
            f"{side}_foot": skeleton.euler(np.swapaxes(stands, 1, 2)),
        }
    return angles
