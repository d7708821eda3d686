"""What a viewer would see as faults of the motion: jerks, sliding feet, and arms inside the trunk.

Every quantity is computed for the synthesised and for the recorded motion of a record, since recordings have noise
and people do touch themselves: what counts is the difference. Limits come from all recordings of the actor.

- *Acceleration.* A frame is within the limits if no joint of ``JOINTS`` accelerates more than that joint does in
  99.9 % of the actor's recorded frames. A join, where one unit meets the next, is within them if all frames within
  ``JOIN_S`` of it are. The recorded motion has no joins; it is judged at the same moments.
- *Feet.* A foot is on the floor if its ankle is within ``ON_FLOOR_M`` of where the actor's ankles usually are when
  they are low. Its horizontal speed and the largest distance that it moves within a second should then be those of
  the recorded motion. A body whose lower foot is further above or below is off the floor, as nothing that slides
  would be noticed then.
- *Trunk.* The trunk consists of three elliptic cylinders with the proportions of the drawn body. The depth of a point
  is its distance from the surface relative to that of the axis, times the half depth of the trunk. It is measured
  along the midlines of the lower half of the upper arms, of the forearms and of the hands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.errors import UserError
from cospeech.motion import skeleton

ORIGINAL = "original"

JOINTS = ("head", *(f"{side}_{part}" for side in ("left", "right") for part in ("forearm", "hand", "shin", "foot")))
"""Joints whose positions accelerate: base of the head, elbows, wrists, knees and ankles."""

LIMIT_PERCENTILE = 99.9

LEAST_M_S2 = 0.1
"""Smallest limit of an acceleration: a joint that never moves would otherwise be judged by rounding errors."""

JOIN_S = 0.1
"""Frames whose centre is within this time of a join belong to it."""

FEET = ("left_foot", "right_foot")

LOW_PERCENTILE = 5.0
"""The height of the floor below the ankles is this percentile of the heights of an actor's lower ankle."""

ON_FLOOR_M = 0.03

SLIP_S = 1.0
"""Time within which a foot on the floor is followed."""

TRUNK = (
    ("hips", -0.05, 0.10, 0.155, 0.105, 0.0),
    ("spine", 0.0, 0.16, 0.142, 0.100, 0.007),
    ("chest", 0.0, 0.22, 0.165, 0.112, 0.012),
)
"""Elliptic cylinders: joint, lower and upper end in its frame, half width and depth, and z of the axis, in metres."""

ARM_POINTS = (
    ("arm", "forearm", (0.5, 0.75, 1.0)),
    ("forearm", "hand", (0.25, 0.5, 0.75, 1.0)),
    ("hand", "hand_tip", (0.33, 0.67, 1.0)),
)
"""Points on the midline of an arm: from which place to which, and the shares of the way."""

UNITS = {
    "joins_within": "%",
    "frames_within": "%",
    "foot_speed": "m/s",
    "foot_slip": "m",
    "off_floor": "%",
    "trunk_depth": "m",
    "frames_deeper": "%",
}
"""The quantities and their units."""


class Measured(NamedTuple):
    """What is measured in a motion of T frames, before it is compared with the limits of the actor.

    Attributes
    ----------
    acceleration : (T - 2, K) of the joints in m/s^2; row k belongs to frame k + 1.
    feet_m : (T, 2, 3) positions of the ankles.
    depth_m : (T,) greatest depth of the arms in the trunk; 0 outside.
    fps : frame rate.
    """

    acceleration: Floats
    feet_m: Floats
    depth_m: Floats
    fps: float


class Limits(NamedTuple):
    """The limits of one actor: acceleration (K,) in m/s^2, ankle height and depth in metres."""

    acceleration: Floats
    floor_m: float
    depth_m: float


def measure(motion: pd.DataFrame) -> Measured:
    """Return accelerations, feet and depths of a motion table."""
    fps = skeleton.frame_rate(motion)
    root, angles = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float), skeleton.angles(motion)
    turned, placed = skeleton.chain(root, angles)
    at = {name: placed[:, index] for index, name in enumerate(skeleton.JOINTS)}
    joints = np.stack([at[name] for name in JOINTS], axis=1)
    acceleration = np.linalg.norm(np.diff(joints, n=2, axis=0), axis=2) * fps**2
    feet = np.stack([at[name] for name in FEET], axis=1)
    return Measured(acceleration, feet, trunk_depth(turned, placed), fps)


def trunk_depth(turned: Floats, placed: Floats) -> Floats:
    """Return the greatest depth (T,) of the arms in the trunk in metres, 0 where they are outside.

    Parameters
    ----------
    turned, placed : (T, J, 3, 3) orientations and (T, J, 3) positions of ``skeleton.JOINTS`` in the world.
    """
    at = {name: placed[:, index] for index, name in enumerate(skeleton.JOINTS)}
    for side in ("left", "right"):
        hand = skeleton.JOINTS.index(f"{side}_hand")
        at[f"{side}_hand_tip"] = placed[:, hand] + turned[:, hand] @ np.array(skeleton.TIPS_M[f"{side}_hand"])
    points = np.stack(
        [
            at[f"{side}_{start}"] + share * (at[f"{side}_{end}"] - at[f"{side}_{start}"])
            for side in ("left", "right")
            for start, end, shares in ARM_POINTS
            for share in shares
        ],
        axis=1,
    )
    deepest = np.zeros(len(placed))
    for joint, low, high, half_width, half_depth, axis in TRUNK:
        index = skeleton.JOINTS.index(joint)
        local = (points - placed[:, index, None]) @ turned[:, index]
        relative = np.hypot(local[..., 0] / half_width, (local[..., 2] - axis) / half_depth)
        inside = (local[..., 1] >= low) & (local[..., 1] <= high)
        depth = np.where(inside, (1.0 - relative) * half_depth, 0.0)
        deepest = np.maximum(deepest, depth.max(axis=1))
    return deepest


def limits(recorded: list[Measured]) -> Limits:
    """Return the limits of an actor from what is measured in all of the actor's recordings."""
    acceleration = np.concatenate([one.acceleration for one in recorded])
    usual = np.percentile(acceleration, LIMIT_PERCENTILE, axis=0) if len(acceleration) else np.zeros(len(JOINTS))
    lower = np.concatenate([one.feet_m[:, :, 1].min(axis=1) for one in recorded])
    return Limits(
        np.maximum(usual, LEAST_M_S2),
        float(np.percentile(lower, LOW_PERCENTILE)),
        float(max(one.depth_m.max() for one in recorded)),
    )


def qualities(measured: Measured, joins: Integers | None, limit: Limits) -> dict[str, tuple[float, int]]:
    """Return the value of each quantity of ``UNITS`` and the number of observations; NaN if there are none.

    Parameters
    ----------
    joins : first frames of the units after a join; None if unknown.
    """
    within: Flags = np.all(measured.acceleration <= limit.acceleration, axis=1)
    smooth = _smooth_joins(within, joins, measured.fps)
    speeds, slip = _sliding(measured, limit.floor_m)
    lower = measured.feet_m[:, :, 1].min(axis=1)
    n_frames = len(measured.depth_m)
    return {
        "joins_within": (_percentage(smooth), len(smooth)),
        "frames_within": (_percentage(within), len(within)),
        "foot_speed": (float(speeds.mean()) if len(speeds) else math.nan, len(speeds)),
        "foot_slip": (slip, len(speeds)),
        "off_floor": (_percentage(np.abs(lower - limit.floor_m) > ON_FLOOR_M), n_frames),
        "trunk_depth": (float(measured.depth_m.max()), n_frames),
        "frames_deeper": (_percentage(measured.depth_m > limit.depth_m), n_frames),
    }


def joins_between(first_frames: npt.ArrayLike) -> Integers:
    """Return the joins of segments that start at these frames, in order and each once; nothing precedes frame 0."""
    starts = np.unique(np.asarray(first_frames, dtype=np.int64))
    return starts[starts > 0]


def _percentage(flags: Flags) -> float:
    return 100.0 * float(flags.mean()) if len(flags) else math.nan


def _smooth_joins(within: Flags, joins: Integers | None, fps: float) -> Flags:
    """Return whether each join is within the limits; ``within`` (T - 2,) starts with the second frame."""
    if joins is None:
        return np.zeros(0, dtype=bool)
    centres = np.arange(1, len(within) + 1) + 0.5
    near = [within[np.abs(centres - join) <= JOIN_S * fps + 1e-9] for join in joins]
    return np.array([frames.all() for frames in near if len(frames)], dtype=bool)


def _sliding(measured: Measured, floor_m: float) -> tuple[Floats, float]:
    """Return the horizontal speeds in m/s of feet on the floor, and how far one moves there within ``SLIP_S``."""
    on_floor = np.abs(measured.feet_m[:, :, 1] - floor_m) <= ON_FLOOR_M
    places = measured.feet_m[:, :, [0, 2]]
    both = on_floor[1:] & on_floor[:-1]
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=2)[both] * measured.fps
    span = min(max(round(SLIP_S * measured.fps), 1), len(places) - 1)
    lifted = np.cumsum(np.concatenate([np.zeros((1, 2), dtype=np.int64), ~on_floor]), axis=0)
    stays = lifted[span + 1 :] == lifted[: -span - 1]
    moved = np.linalg.norm(places[span:] - places[:-span], axis=2) if span else np.zeros((0, 2))
    return speeds, float(moved[stays[: len(moved)]].max(initial=0.0)) if len(speeds) else math.nan


def table(
    motions: Mapping[tuple[str, str], pd.DataFrame],
    joins: Mapping[tuple[str, str], Integers],
    actors: Mapping[str, str],
) -> pd.DataFrame:
    """Return the quality of synthesised and recorded motion (schema ``motion_quality``).

    A system that made no motion of one record (it failed) is left out altogether, as in the scores.

    Parameters
    ----------
    motions : motion tables by (system, record); the recorded motion is the system ``original``.
    joins : first frames of units after a join, by (system, record), of the systems that join units.
    actors : the actor of each record.

    Raises
    ------
    UserError : if a motion has another frame rate than the recorded motion of its record, because accelerations
        would not be comparable.
    """
    failed = {system for (system, _), motion in motions.items() if motion.empty}
    measured = {key: measure(motion) for key, motion in motions.items() if key[0] not in failed}
    for (system, record), one in measured.items():
        own = measured[ORIGINAL, record].fps
        if one.fps != own:
            raise UserError(
                f"motion of record '{record}' ({system}) has {one.fps:g} frames/s, but its recorded motion has "
                f"{own:g}: resample all motions to one rate"
            )
    known = {
        actor: limits([measured[ORIGINAL, record] for record in actors if actors[record] == actor])
        for actor in set(actors.values())
    }
    rows = []
    for (system, record), one in measured.items():
        limit, at = known[actors[record]], joins.get((system, record))
        recorded = qualities(measured[ORIGINAL, record], at, limit)
        for quantity, (value, n) in qualities(one, at, limit).items():
            rows.append(
                {"system": system, "actor": actors[record], "record": record, "quantity": quantity}
                | {"unit": UNITS[quantity], "fps": one.fps, "value": value, "recorded": recorded[quantity][0]}
                | {"limit": limit.depth_m if quantity in ("trunk_depth", "frames_deeper") else math.nan, "n": n}
            )
    return pd.DataFrame(rows)
