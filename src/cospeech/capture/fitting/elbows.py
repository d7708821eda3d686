"""Functional estimation of the elbow centres from the motion of the hands in the range-of-motion take.

The static pose gives the height of an elbow only by its marker, which may sit some millimetres above or below the
joint. In the frame of the upper arm, flexion of the forearm moves the hand marker on a circle about the hinge, and
the centre of this circle is the elbow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from cospeech.capture.fitting.body_model import NAMES, BodyModel
from cospeech.capture.fitting.inverse_kinematics import solve
from cospeech.capture.fitting.joint_centres import to_local
from cospeech.data.arrays import Floats
from cospeech.motion import markers

ROUNDS = 3
"""Number of iterations: the axial rotation of the upper arm depends on the forearm, so it improves with the elbow."""

STRAY_M = 0.002
"""Scale of the robust loss: hand positions farther than this from the circle are down-weighted."""

LEAST_ARC_DEG = 60.0
"""Minimum arc covered by the hand; with less, the elbow stays where the static pose shows it."""


def refine_elbows(model: BodyModel, places_m: Floats) -> BodyModel:
    """Return ``model`` with elbow centres estimated from the motion of the hands in the range-of-motion take.

    Parameters
    ----------
    places_m : (T, M, 3) the markers of the take in metres, NaN where lost.
    """
    for _ in range(ROUNDS):
        poses = solve(model, places_m)
        offsets, worn = model.offsets_m.copy(), model.marker_places_m.copy()
        for side in ("left", "right"):
            arm, forearm = NAMES.index(f"{side}_arm"), NAMES.index(f"{side}_forearm")
            hand = markers.NAMES.index(f"{side}_hand")
            seen = to_local(poses.turns[:, arm], poses.places_m[:, arm], places_m[:, hand])
            moved = circle_centre(seen[:, 1:], offsets[forearm, 1:]) - offsets[forearm, 1:]
            offsets[forearm, 1:] += moved
            worn[hand, 1:] -= moved  # keep its position in the static pose
        model = replace(model, offsets_m=offsets, marker_places_m=worn)
    return model


def circle_centre(points_m: Floats, start_m: Floats) -> Floats:
    """Return the centre (2,) of the circle fitted to points (T, 2), or ``start_m`` if they cover too short an arc.

    Least squares of the distances to the circle with a soft-L1 loss, because positions of hidden hands deviate. Rows
    with NaN are ignored.
    """
    points = points_m[~np.any(np.isnan(points_m), axis=1)]
    away = points - start_m
    angles = np.degrees(np.unwrap(np.arctan2(away[:, 0], -away[:, 1])))
    if len(points) < 3 or np.ptp(np.quantile(angles, [0.02, 0.98])) < LEAST_ARC_DEG:
        return start_m
    first = np.append(start_m, np.median(np.linalg.norm(away, axis=1)))

    def misfit(guess: Floats) -> Floats:
        return np.linalg.norm(points - guess[:2], axis=1) - guess[2]

    return least_squares(misfit, first, loss="soft_l1", f_scale=STRAY_M).x[:2]
