"""Which joint angles 15 markers can tell, and why the others stay at zero: the table ``observability``.

One marker on a part beyond a known joint tells two angles, a third only through the next part, and only while that
one is bent. This follows from where the markers are (``cospeech.markers``); only the share of frames is counted.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats
from cospeech.motion import markers, skeleton

MEASURED, BENT_ONLY, LOCKED = "measured", "flexion_dependent", "locked"

BENT_DEG = 30.0
"""Bend of the elbow from which the hand tells the upper arm's turn about itself to a degree or two."""

ONE_TRUNK = "one rigid group of markers on the trunk: its whole rotation stands at the chest"
ONE_HEAD = "no marker on the neck: the head's whole rotation relative to the chest stands at the head"
WRIST = "one marker beyond the elbow cannot tell a turn of the forearm from a bent wrist"
VARUS = "one marker beyond the elbow cannot tell it from the turn of the upper arm; an elbow is a hinge"
ONE_LEG = "one marker on the thigh and one on the foot tell its direction and the knee's flexion, no turn of the bone"
NO_MARKER = "its markers are not in the static pose"

AXES = {
    "hips": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "spine": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "chest": (MEASURED, MEASURED, MEASURED, "three markers or more on the trunk"),
    "neck": (LOCKED, LOCKED, LOCKED, ONE_HEAD),
    "head": (MEASURED, MEASURED, MEASURED, "three markers on the head"),
    "arm": (MEASURED, BENT_ONLY, MEASURED, "direction by the elbow's marker, the turn by the hand of a bent arm"),
    "forearm": (MEASURED, LOCKED, LOCKED, f"x: flexion; y: {WRIST}; z: {VARUS}"),
    "hand": (LOCKED, LOCKED, LOCKED, "one marker beyond the elbow: forearm and hand are seen as one"),
    "thigh": (MEASURED, LOCKED, MEASURED, ONE_LEG),
    "shin": (MEASURED, LOCKED, LOCKED, ONE_LEG),
    "foot": (LOCKED, LOCKED, LOCKED, "one marker beyond the knee: shin and foot are seen as one"),
}
"""State of x, y and z, and the reason, of every joint (either side)."""

NEEDED = {"arm": ("elbow",), "forearm": ("elbow", "hand"), "thigh": ("leg",), "shin": ("leg", "foot")}
"""The markers of a limb that tell the angles of a part."""


def observability(marker_places_m: Floats, seen_m: Floats, motion: pd.DataFrame) -> pd.DataFrame:
    """Return the table: joint, axis, state, share of frames in which the markers told it, reason.

    Parameters
    ----------
    marker_places_m : (M, 3) of the body model, NaN for a marker that the subject does not wear.
    seen_m : (T, M, 3) markers of the record, NaN where lost.
    motion : the record's motion table.
    """
    worn = ~np.any(np.isnan(marker_places_m), axis=1)
    seen = worn & ~np.any(np.isnan(seen_m), axis=2)
    rows = []
    for joint in skeleton.JOINTS:
        side, _, part = joint.rpartition("_")
        *states, reason = AXES[part]
        for axis, state in zip("xyz", states, strict=True):
            told = _told(side, part, axis, seen, motion)
            if state != LOCKED and not _told(side, part, "x", worn[None], motion).any():
                state, why = LOCKED, NO_MARKER
            else:
                why = reason
            rows.append((joint, axis, state, 0.0 if state == LOCKED else float(told.mean()), why))
    return pd.DataFrame(rows, columns=["joint", "axis", "state", "share", "reason"])


def _told(side: str, part: str, axis: str, seen: Flags, motion: pd.DataFrame) -> Flags:
    """Return in which frames (T,) the markers seen (T, M) tell an angle that is not locked."""
    if part in ("chest", "head"):
        group = [marker.joint == part for marker in markers.MARKERS]
        return np.asarray(seen[:, group].sum(axis=1) >= 3)
    turn = (part, axis) == ("arm", "y")
    needed = ("elbow", "hand") if turn else NEEDED.get(part, ())
    told = np.all(seen[:, [markers.NAMES.index(f"{side}_{name}") for name in needed]], axis=1)
    return np.asarray(told & (motion[f"{side}_forearm_x_deg"].to_numpy() < -BENT_DEG)) if turn else np.asarray(told)
