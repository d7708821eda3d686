"""Body model of a subject: a tree of body parts with joint centres, and the position of each marker on its part.

Thorax and head are free. The upper arm is attached to the thorax by a ball joint, and the elbow is a hinge whose axis
is the x axis of the thorax in the static pose. The legs are attached to hips that stay upright: two hinges at the hip
and one at the knee. These are the degrees of freedom that 15 markers determine; ``observability`` lists all others.

Marker positions and bone lengths come from the static pose once the shoulder centres are known: the elbow lies below
the shoulder at the height of its marker, and the hand marker is where the static pose shows it. (In a T-pose, the
markers of the arms are first rotated about the shoulders until the arms hang.) Hips and knees, which
no functional movement determines here, are taken from ``skeleton.BODY``, scaled by the height of the shoulders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cospeech.capture.fitting import stance
from cospeech.capture.fitting.joint_centres import shoulder_centre
from cospeech.capture.fitting.static_pose import static_pose
from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.geometry.rigid import align
from cospeech.geometry.rotation import from_euler
from cospeech.motion import markers, skeleton

FREE, BALL, HINGE_X, HINGE_Z, UPRIGHT = range(5)
"""Kinds of joints: free, ball joint, hinge about x or z, and translation with the parent while staying upright."""

PARTS = (
    ("thorax", None, FREE),
    ("head", None, FREE),
    ("left_arm", "thorax", BALL),
    ("left_forearm", "left_arm", HINGE_X),
    ("right_arm", "thorax", BALL),
    ("right_forearm", "right_arm", HINGE_X),
    ("hips", "thorax", UPRIGHT),
    ("left_leg", "hips", HINGE_X),
    ("left_thigh", "left_leg", HINGE_Z),
    ("left_shin", "left_thigh", HINGE_X),
    ("right_leg", "hips", HINGE_X),
    ("right_thigh", "right_leg", HINGE_Z),
    ("right_shin", "right_thigh", HINGE_X),
)
"""Name, parent and kind of joint of every part, parents first."""

NAMES = tuple(name for name, _, _ in PARTS)
PARENTS: Integers = np.array([-1 if parent is None else NAMES.index(parent) for _, parent, _ in PARTS])
KINDS: Integers = np.array([kind for _, _, kind in PARTS])

CARRIER = {"chest": "thorax", "left_hand": "left_forearm", "right_hand": "right_forearm",
           "left_foot": "left_shin", "right_foot": "right_shin"}  # fmt: skip
"""The part that carries the markers of a joint that is not a part itself."""

MARKER_PART: Integers = np.array([NAMES.index(CARRIER.get(m.joint, m.joint)) for m in markers.MARKERS])

RIGID_M, HAND_M, LEG_M = 0.001, 0.005, 0.02
"""Tolerance of a marker's position on its part: on a single bone; beyond the wrist; beyond an assumed hip joint."""

TOLERANCES_M: Floats = np.array(
    [HAND_M if "hand" in name else LEG_M if "leg" in name or "foot" in name else RIGID_M for name in markers.NAMES]
)

THORAX = tuple(index for index, marker in enumerate(markers.MARKERS) if marker.joint == "chest")
HEAD = tuple(index for index, marker in enumerate(markers.MARKERS) if marker.joint == "head")

OPTIONAL = tuple(m.name for m in markers.MARKERS if m.joint == "chest" or m.name.endswith(("leg", "foot")))
"""Markers that a subject need not wear: those on legs and feet, and one of the four on the trunk."""


@dataclass(frozen=True)
class BodyModel:
    """The body model of one subject.

    Attributes
    ----------
    offsets_m : (P, 3) position of each part's joint in the frame of its parent; for free parts, in the static pose.
    marker_places_m : (M, 3) position of each marker in the frame of its part; NaN if it is not worn.
    shoulder_errors_m : standard errors of the centres of the left and the right shoulder.
    """

    offsets_m: Floats
    marker_places_m: Floats
    shoulder_errors_m: tuple[float, float]


def body_model(places_m: Floats, fps: float, static_s: float, pose: str = stance.HANGING) -> BodyModel:
    """Return the model of a subject from a range-of-motion take that begins with the static pose.

    Parameters
    ----------
    places_m : (T, M, 3) positions of ``markers.NAMES`` in metres, NaN where lost.
    static_s : duration of the static pose in seconds.
    pose : the static pose, see ``stance``.

    Raises
    ------
    UserError : if the static pose lacks a marker, is not still or is not ``pose``, or if an arm moves too little.
    """
    still = static_pose(places_m, markers.NAMES, fps, static_s, OPTIONAL)
    stance.check_axes(places_m, np.eye(3), "range-of-motion take")
    stance.check_static(still, pose, np.eye(3), "range-of-motion take")
    rigid = [index for index in THORAX if not np.isnan(still[index, 0])]
    if len(rigid) < 3:
        trunk = ", ".join(markers.NAMES[index] for index in THORAX)
        raise UserError(
            f"static pose: {len(rigid)} of the markers {trunk} are seen in the first {static_s:g} s of the "
            "range-of-motion take, but three are needed; begin the take with the static pose in view of the cameras"
        )
    thorax = align(still[rigid], places_m[:, rigid])
    elbows = {side: places_m[:, markers.NAMES.index(f"{side}_elbow")] for side in ("left", "right")}
    shoulders = {side: shoulder_centre(side, elbow, thorax) for side, elbow in elbows.items()}
    if pose == stance.T_POSE:
        still = _with_hanging_arms(still, {side: found.centre_m for side, found in shoulders.items()})
    at = dict(zip(markers.NAMES, still, strict=True))
    centres = {name: np.zeros(3) for name in NAMES}
    middle = (shoulders["left"].centre_m + shoulders["right"].centre_m) / 2.0
    size = middle[1] / sum(skeleton.OFFSET_M[name][1] for name in ("hips", "spine", "chest", "left_arm"))
    centres["thorax"] = middle - (0.0, size * skeleton.OFFSET_M["left_arm"][1], 0.0)
    centres["head"] = still[list(HEAD)].mean(axis=0)
    centres["hips"] = centres["thorax"] - size * (skeleton.OFFSET_M["chest"] + skeleton.OFFSET_M["spine"])
    for side, found in shoulders.items():
        centres[f"{side}_arm"] = found.centre_m
        below = (found.centre_m[0], at[f"{side}_elbow"][1], found.centre_m[2])
        centres[f"{side}_forearm"] = np.array(below)
        hip = centres["hips"] + size * skeleton.OFFSET_M[f"{side}_thigh"]
        centres[f"{side}_leg"] = centres[f"{side}_thigh"] = hip
        centres[f"{side}_shin"] = hip + size * skeleton.OFFSET_M[f"{side}_shin"]
    places = np.array([centres[name] for name in NAMES])
    offsets = places - np.where(PARENTS[:, None] >= 0, places[PARENTS], 0.0)
    errors = (shoulders["left"].error_m, shoulders["right"].error_m)
    return BodyModel(offsets, still - places[MARKER_PART], errors)


def _with_hanging_arms(still_m: Floats, shoulders_m: dict[str, Floats]) -> Floats:
    """Return the markers (M, 3) of a T-pose with each arm rotated about its shoulder until it hangs."""
    hanging = still_m.copy()
    for side, turn_deg in (("left", -90.0), ("right", 90.0)):
        turn = from_euler("Z", np.array([turn_deg]))
        for part in ("elbow", "hand"):
            index = markers.NAMES.index(f"{side}_{part}")
            hanging[index] = shoulders_m[side] + turn @ (still_m[index] - shoulders_m[side])
    return hanging
