"""Gesture phases and their kinematic parameters (Levine et al. 2010, 5.1).

Phases are the active and passive parts of gesture units: strokes and retractions, holds and pauses. A boundary is
where the mean speed of the two hands crosses a threshold. The paper does not say which; here it is relative to the
speaker's own speeds and has hysteresis: a phase is active if the speed stays above the low threshold and exceeds the
high one, which is twice as high. With one threshold, the phases flicker where the speed stays close to it.

The six parameters are logarithms. With p, v and a the position, velocity and acceleration of both hands in frame i of
n (6-vectors), h the sum of their heights, and mean(...) over the frames of the phase, they are

    T = log(duration)               D = log |mean(p_i - p_1)|       V = log mean |v_i|
    A = log mean |a_i|              C = log mean |v_i x a_i|        H = log mean h_i

This differs from the printed formulas:

- These divide the sums by T itself, which is a logarithm and negative for every phase of less than a second. It
  stands for the duration; here, the sums are divided by the number of frames, which has the same effect and does not
  depend on the frame rate.
- Printed are norms of sums for V, A and C. The sum of the velocities is the net displacement, and that of the
  accelerations is the difference of two velocities, both close to the threshold; divided by the duration, it measures
  little but the duration. Measured on 63 s of BEAT2 (73 phases), the correlation of A with T is -0.95 as printed and
  0.00 as above, and that of the two versions of A is 0.11. T is negative for 68 % of these phases.
- The cross product is that of each hand. Its norm is the cube of the speed times the curvature.

The weights B and W, which bring the parameters to a common range, depend on the records that a system is trained on
and are not applied here: W = 1 / sd and B = exp(-mean) standardise the parameters. Positions are relative to the body
(see ``movement.body_frame``); heights count from the floor below a standing actor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.motion import skeleton
from cospeech.segmentation import movement

HANDS = ("left_hand", "right_hand")

PARAMETERS = ("temporal_extent", "spatial_extent", "velocity", "acceleration", "curvature", "height")

HYSTERESIS = 2.0
"""Ratio of the high and the low threshold."""

LEAST_M_S = 0.05
"""Smallest low threshold. Hands at rest are slower, including the noise of a recording."""

RESOLUTION = (1e-3, 1e-4, 1e-3, 1e-2, 1e-5, 1e-2)
"""Smallest values of the parameters in s, m, m/s, m/s^2, m^2/s^3 and m; the logarithm of zero would be infinite."""

STANDING_M = float(skeleton.OFFSET_M["hips"][1])
"""Height of the hips of a standing actor."""


def hands(motion: pd.DataFrame) -> Floats:
    """Return the positions of the hands relative to the body in metres, (T, 2, 3)."""
    positions, _ = movement.body_frame(motion)
    return np.stack([positions[name] for name in HANDS], axis=1)


def speed(hands_m: Floats, fps: float) -> Floats:
    """Return the mean speed of hands (T, H, 3) in metres per second, (T,)."""
    velocity = movement.rate(movement.smooth(hands_m, fps), fps)
    return np.asarray(np.linalg.norm(velocity, axis=2).mean(axis=1), dtype=np.float64)


def find(motions: Mapping[str, pd.DataFrame], settings: Mapping[str, Any]) -> pd.DataFrame:
    """Return the phases (schema ``phases``) of records of one speaker.

    Parameters
    ----------
    motions : motion tables by record. The thresholds are relative to the speeds in all of them.
    settings : ``segmentation.phases`` of the configuration: threshold, minimum_s.
    """
    rates = {record: skeleton.frame_rate(motion) for record, motion in motions.items()}
    return of_hands({record: hands(motion) for record, motion in motions.items()}, rates, settings)


def of_hands(places: Mapping[str, Floats], rates: Mapping[str, float], settings: Mapping[str, Any]) -> pd.DataFrame:
    """Return the phases (schema ``phases``) of recordings of one body, which may have any number of hands.

    Parameters
    ----------
    places : by record, positions of the hands in metres relative to the root, (T, H, 3).
    rates : frames per second of each record.
    settings : see ``find``.
    """
    speeds = {record: speed(places[record], rates[record]) for record in places}
    low = movement.threshold(speeds.values(), settings["threshold"], LEAST_M_S)
    tables = []
    for record, fps in rates.items():
        active = movement.moving(speeds[record], low, HYSTERESIS * low)
        active = movement.without_short(active, settings["minimum_s"] * fps)
        starts, ends = movement.runs(active)
        table = movement.table(record, "phase", starts, ends, fps)
        table["active"] = active[starts]
        table[list(PARAMETERS)] = parameters(places[record], starts, ends, fps)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def parameters(hands_m: Floats, starts: Integers, ends: Integers, fps: float) -> Floats:
    """Return the kinematic ``PARAMETERS`` of phases, (n, 6).

    Those of bodies with more or fewer than two hands are averages over the hands, in the unit of two (Levine et al.
    2010, 9.2).

    Parameters
    ----------
    hands_m : (T, H, 3) positions of the hands in metres relative to the hips.
    starts, ends : (n,) first frames of the phases, and first frames after them.
    """
    share = len(HANDS) / hands_m.shape[1]
    position = movement.smooth(hands_m, fps)
    velocity = movement.rate(position, fps)
    acceleration = movement.rate(velocity, fps)
    bent = np.cross(velocity, acceleration)
    heights = share * (hands_m[:, :, 1] + STANDING_M).sum(axis=1)
    values = np.empty((len(starts), len(PARAMETERS)))
    for row, (start, end) in enumerate(zip(starts, ends, strict=True)):
        values[row, 0] = (end - start) / fps
        values[row, 1] = np.sqrt(share) * np.linalg.norm((position[start:end] - position[start]).mean(axis=0))
        for column, vectors in enumerate((velocity, acceleration, bent), start=2):
            values[row, column] = np.sqrt(share * (vectors[start:end] ** 2).sum(axis=(1, 2))).mean()
        values[row, 5] = heights[start:end].mean()
    return np.log(np.maximum(values, RESOLUTION))
