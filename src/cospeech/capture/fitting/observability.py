"""Which joint angles 15 markers determine, and why the others are fixed at zero: the table ``observability``.

One marker on a part beyond a known joint determines two angles of the joint. The third, axial rotation, is observable
only through the next part, and only while the joint between them is flexed. All of this follows from the marker
placement (``cospeech.motion.markers``); only the fraction of frames is counted.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats
from cospeech.motion import markers, skeleton

MEASURED, BENT_ONLY, LOCKED = "measured", "flexion_dependent", "locked"

BENT_DEG = 30.0
"""Elbow flexion from which the hand marker determines the axial rotation of the upper arm to one or two degrees."""

ONE_TRUNK = "one rigid group of markers on the trunk: the whole rotation is assigned to the chest"
ONE_HEAD = "no marker on the neck: the whole rotation of the head relative to the chest is assigned to the head"
WRIST = "one marker beyond the elbow cannot distinguish forearm rotation from wrist flexion"
VARUS = "one marker beyond the elbow cannot distinguish it from axial rotation of the upper arm; the elbow is a hinge"
ONE_LEG = (
    "one marker on the thigh and one on the foot determine its direction and knee flexion, but no axial rotation"
)
NO_MARKER = "its markers are not visible in the static pose"

AXES = {
    "hips": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "spine": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "chest": (MEASURED, MEASURED, MEASURED, "three markers or more on the trunk"),
    "neck": (LOCKED, LOCKED, LOCKED, ONE_HEAD),
    "head": (MEASURED, MEASURED, MEASURED, "three markers on the head"),
    "arm": (MEASURED, BENT_ONLY, MEASURED, "direction from the elbow marker, axial rotation from the hand if flexed"),
    "forearm": (MEASURED, LOCKED, LOCKED, f"x: flexion; y: {WRIST}; z: {VARUS}"),
    "hand": (LOCKED, LOCKED, LOCKED, "one marker beyond the elbow: forearm and hand are one rigid part"),
    "thigh": (MEASURED, LOCKED, MEASURED, ONE_LEG),
    "shin": (MEASURED, LOCKED, LOCKED, ONE_LEG),
    "foot": (LOCKED, LOCKED, LOCKED, "one marker beyond the knee: shin and foot are one rigid part"),
}
"""States of the x, y and z angles of every joint (either side), and the reason."""

NEEDED = {"arm": ("elbow",), "forearm": ("elbow", "hand"), "thigh": ("leg",), "shin": ("leg", "foot")}
"""The markers of a limb that determine the angles of a part."""


def observability(marker_places_m: Floats, seen_m: Floats, motion: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``observability``.

    Its columns are joint, axis, state, the fraction of frames in which the markers determine the angle, and a reason.

    Parameters
    ----------
    marker_places_m : (M, 3) marker positions of the body model, NaN for markers that the subject does not wear.
    seen_m : (T, M, 3) markers of the record, NaN where lost.
    motion : the motion table of the record.
    """
    worn = ~np.any(np.isnan(marker_places_m), axis=1)
    seen = worn & ~np.any(np.isnan(seen_m), axis=2)
    rows = []
    for joint in skeleton.JOINTS:
        side, _, part = joint.rpartition("_")
        *states, reason = AXES[part]
        for axis, state in zip("xyz", states, strict=True):
            measured = _measured(side, part, axis, seen, motion)
            if state != LOCKED and not _measured(side, part, "x", worn[None], motion).any():
                state, why = LOCKED, NO_MARKER
            else:
                why = reason
            rows.append((joint, axis, state, 0.0 if state == LOCKED else float(measured.mean()), why))
    return pd.DataFrame(rows, columns=["joint", "axis", "state", "share", "reason"])


def _measured(side: str, part: str, axis: str, seen: Flags, motion: pd.DataFrame) -> Flags:
    """Return in which frames (T,) the visible markers (T, M) determine an angle that is not locked."""
    if part in ("chest", "head"):
        group = [marker.joint == part for marker in markers.MARKERS]
        return np.asarray(seen[:, group].sum(axis=1) >= 3)
    turn = (part, axis) == ("arm", "y")
    needed = ("elbow", "hand") if turn else NEEDED.get(part, ())
    measured = np.all(seen[:, [markers.NAMES.index(f"{side}_{name}") for name in needed]], axis=1)
    return (
        np.asarray(measured & (motion[f"{side}_forearm_x_deg"].to_numpy() < -BENT_DEG))
        if turn
        else np.asarray(measured)
    )
