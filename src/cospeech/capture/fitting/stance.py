"""Checks that the markers of a take agree with what is declared about them: unit, axes, sides and static pose.

The static pose defines which way the actor faces and where all joint angles are zero. A wrong declaration would
therefore not show in the fit: the angles would be wrong by up to 180 degrees, with small residuals.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.data.units import METRES
from cospeech.errors import UserError
from cospeech.motion.markers import MARKERS, NAMES

HANGING, T_POSE = "hanging", "t_pose"
"""Static poses: upright with arms hanging and palms to the thighs, or with arms to the sides and palms down."""

UPPER_ARM_M = (0.12, 0.6)
"""Plausible range of the distance from shoulder to elbow marker; outside it, the unit is wrong."""

LIKELY = {unit: METRES[unit] for unit in ("m", "cm", "mm")}
"""Units that are mistaken for one another; more of them would explain any length."""

MAX_LEAN_DEG = 50.0
"""Largest angle between the line from shoulders to head and the vertical, as a median over the take."""

MAX_HEADING_DEG = 30.0
"""Largest angle between the heading in the static pose and the declared one."""

MAX_ARM_DEG, MAX_FOREARM_DEG = 25.0, 35.0
"""Largest angle between the line of an arm's markers and its direction in the declared static pose.

As markers lie next to the bone, this angle is about 10 degrees in a perfect pose, and relaxed forearms hang slightly
bent.
"""

HEAD = [index for index, marker in enumerate(MARKERS) if marker.joint == "head"]
CHEST, BACK = NAMES.index("chest"), NAMES.index("back")
LEFT, RIGHT = NAMES.index("left_shoulder"), NAMES.index("right_shoulder")


def check_unit(places_m: Floats, where: str) -> None:
    """Raise UserError if the arms of a take (T, M, 3) do not have the size of a person's arms."""
    for side in ("left", "right"):
        shoulder, elbow = (places_m[:, NAMES.index(f"{side}_{part}")] for part in ("shoulder", "elbow"))
        lengths = np.linalg.norm(shoulder - elbow, axis=1)
        if np.isnan(lengths).all():
            continue
        length = float(np.nanmedian(lengths))
        if not UPPER_ARM_M[0] <= length <= UPPER_ARM_M[1]:
            raise UserError(
                f"{where}: the markers of the {side} shoulder and elbow are {length:.3g} m apart"
                f"{_likely_units(length)}; correct the unit in the file, or corpus.markers.names"
            )


def _likely_units(length_m: float) -> str:
    """Return which wrong unit explains an impossible length, or an empty string."""
    for declared, wrong in LIKELY.items():
        for actual, right in LIKELY.items():
            if UPPER_ARM_M[0] <= length_m * right / wrong <= UPPER_ARM_M[1]:
                return f", as in a file in {actual} that states the unit {declared}"
    return ""


def check_axes(places_m: Floats, to_world: Floats, where: str) -> None:
    """Raise UserError if the actor of a take is not upright, or if left and right are exchanged.

    Parameters
    ----------
    places_m : (T, M, 3) positions of ``markers.NAMES`` in the world, metres, NaN where lost.
    to_world : (3, 3) rotation from the axes of the file to the world, to name the axes of the file.
    where : name of the take for error messages.
    """
    left, up, front = _trunk(places_m)
    seen = ~np.isnan(left + up).any(axis=1)
    if not seen.any():
        return
    lean = np.degrees(np.arccos(np.clip(up[seen, 1] / np.linalg.norm(up[seen], axis=1), -1.0, 1.0)))
    if np.median(lean) > MAX_LEAN_DEG:
        axis = _axis(np.median(up[seen], axis=0) @ to_world)
        raise UserError(
            f"{where}: the head is not above the chest, but {np.median(lean):.0f} degrees from the vertical, in the "
            f"direction {axis}; correct corpus.markers.up"
        )
    ahead = (np.cross(left, up) * front).sum(axis=1)
    if np.nanmedian(ahead[seen]) < 0:
        raise UserError(
            f"{where}: the marker 'left_shoulder' is on the actor's right, judging by the head and the front of the "
            "trunk; swap left and right (or chest and back, if those are exchanged) in corpus.markers.names"
        )


def check_static(still_m: Floats, pose: str, to_world: Floats, where: str) -> None:
    """Raise UserError if the static pose contradicts the declared one.

    Parameters
    ----------
    still_m : (M, 3) mean positions of ``markers.NAMES`` in the static pose in the world, metres, NaN if not worn.
    pose : the declared pose, ``HANGING`` or ``T_POSE``.
    to_world, where : as in ``check_axes``.
    """
    left, up, _ = _trunk(still_m[None])
    ahead = np.cross(left[0], up[0]) * (1.0, 0.0, 1.0)
    heading = np.degrees(np.arctan2(ahead[0], ahead[2]))
    if abs(heading) > MAX_HEADING_DEG:
        raise UserError(
            f"{where}: in the static pose, the actor faces {_axis(ahead @ to_world)}, {abs(heading):.0f} degrees off "
            "the declared direction; correct corpus.markers.facing, or record the static pose again facing it"
        )
    for part in ("head", "shoulder", "elbow", "hand", "leg", "foot"):
        names = (f"head_{side}" if part == "head" else f"{side}_{part}" for side in ("left", "right"))
        ours, theirs = (NAMES.index(name) for name in names)
        if still_m[ours, 0] < still_m[theirs, 0]:
            raise UserError(
                f"{where}: in the static pose, the marker '{NAMES[ours]}' is to the right of '{NAMES[theirs]}'; swap "
                "them in corpus.markers.names"
            )
    for side in ("left", "right"):
        _check_arm(side, still_m, pose, where)


def _check_arm(side: str, still_m: Floats, pose: str, where: str) -> None:
    """Raise UserError if an arm does not point as in the declared static pose."""
    outward = np.array([1.0 if side == "left" else -1.0, 0.0, 0.0])
    down = np.array([0.0, -1.0, 0.0])
    shoulder, elbow, hand = (still_m[NAMES.index(f"{side}_{part}")] for part in ("shoulder", "elbow", "hand"))
    for part, bone, limit in (
        ("upper arm", elbow - shoulder, MAX_ARM_DEG),
        ("forearm", hand - elbow, MAX_FOREARM_DEG),
    ):
        from_down, from_side = (
            float(np.degrees(np.arccos(np.clip(bone @ axis / np.linalg.norm(bone), -1.0, 1.0))))
            for axis in (down, outward)
        )
        off, other = (from_down, from_side) if pose == HANGING else (from_side, from_down)
        if off <= limit:
            continue
        advice = (
            f"set corpus.markers.static to {T_POSE if pose == HANGING else HANGING}"
            if other <= limit
            else "record the take again, with hanging arms or a T-pose at its start (an A-pose is not accepted)"
        )
        raise UserError(
            f"{where}: in the static pose, the {side} {part} is {from_down:.0f} degrees from hanging and "
            f"{from_side:.0f} degrees from a T-pose, but the static pose is declared to be {pose}; {advice}"
        )


def _trunk(places_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Return vectors (T, 3) from right to left shoulder, from shoulders to head, and to the front of the trunk."""
    left, right = places_m[:, LEFT], places_m[:, RIGHT]
    middle = (left + right) / 2.0
    chest, back = places_m[:, CHEST], places_m[:, BACK]
    front = np.where(np.isnan(chest), middle, chest) - np.where(np.isnan(back), middle, back)
    return left - right, places_m[:, HEAD].mean(axis=1) - middle, front


def _axis(direction: Floats) -> str:
    """Return the name of the axis that is closest to a direction (3,)."""
    axis = int(np.argmax(np.abs(direction)))
    return ("-" if direction[axis] < 0 else "") + "xyz"[axis]
