"""Where the elbows turn, from how the hands circle them in the range-of-motion take.

The static pose tells an elbow's height by its marker alone, which may sit some millimetres above or below the joint.
In the frame of the upper arm, a forearm that bends carries the hand's marker on a circle about the hinge: its centre
is the elbow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from cospeech.capture.fitting.body_model import NAMES, BodyModel
from cospeech.capture.fitting.inverse_kinematics import solve
from cospeech.capture.fitting.joint_centres import within
from cospeech.data.arrays import Floats
from cospeech.motion import markers

ROUNDS = 3
"""The upper arm's own turn is known by the forearm, and so gets better with the elbow."""

STRAY_M = 0.002
"""Distance from the circle beyond which a sight of the hand counts less and less."""

LEAST_ARC_DEG = 60.0
"""A hand that goes through less of the circle leaves the elbow where the static pose shows it."""


def refined(model: BodyModel, places_m: Floats) -> BodyModel:
    """Return ``model`` with elbows about which the hands turn in the range-of-motion take.

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
            seen = within(poses.turns[:, arm], poses.places_m[:, arm], places_m[:, hand])
            moved = circle(seen[:, 1:], offsets[forearm, 1:]) - offsets[forearm, 1:]
            offsets[forearm, 1:] += moved
            worn[hand, 1:] -= moved  # it stays where the static pose shows it
        model = replace(model, offsets_m=offsets, marker_places_m=worn)
    return model


def circle(points_m: Floats, start_m: Floats) -> Floats:
    """Return the centre (2,) of the circle through points (T, 2), or ``start_m`` where they cover too little of it.

    Least distances with a loss that grows in the end linearly, as hidden hands stray; rows with NaN are left out.
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
