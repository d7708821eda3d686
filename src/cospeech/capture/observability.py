"""Which joint angles 15 markers can tell, and why the others stay at zero: the table ``observability``.

One marker on a part beyond a known joint tells two angles, a third only through the next part, and only while that
one is bent. Nothing here is measured; it follows from where the markers are (``cospeech.markers``).
"""

from __future__ import annotations

import pandas as pd

from cospeech import skeleton

MEASURED, BENT_ONLY, LOCKED = "measured", "flexion_dependent", "locked"

ONE_TRUNK = "one rigid group of markers on the trunk: its whole rotation stands at the chest"
ONE_HEAD = "no marker on the neck: the head's whole rotation relative to the chest stands at the head"
WRIST = "one marker beyond the elbow cannot tell a turn of the forearm from a bent wrist"
VARUS = "one marker beyond the elbow cannot tell it from the turn of the upper arm; an elbow is a hinge"
ONE_LEG = "one marker on the thigh and one on the foot tell its direction and the knee's flexion, no turn of the bone"

AXES = {
    "hips": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "spine": (LOCKED, LOCKED, LOCKED, ONE_TRUNK),
    "chest": (MEASURED, MEASURED, MEASURED, "four markers on the trunk"),
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


def observability() -> pd.DataFrame:
    """Return the table: joint, axis, state (measured, flexion_dependent, locked), reason."""
    rows = []
    for joint in skeleton.JOINTS:
        *states, reason = AXES[joint.removeprefix("left_").removeprefix("right_")]
        rows += [(joint, axis, state, reason) for axis, state in zip("xyz", states, strict=True)]
    return pd.DataFrame(rows, columns=["joint", "axis", "state", "reason"])
