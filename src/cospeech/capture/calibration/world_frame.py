"""Metre and axes of a self-calibrated rig, from stated facts: films alone tell neither.

Every function takes cameras and points of one frame to another by a similarity: a point X becomes s Q X + b.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.geometry.rigid import Similarity, fit_similarity

Facts = Sequence[Mapping[str, Any]]

FACING = np.diag([1.0, -1.0, -1.0])
"""From the axes of a camera, y down and z away from it, to those of someone who faces it."""
LEAST_ACROSS = 0.05
"""Smallest width of the triangle of stated places, relative to its length, that fixes a rotation."""
LEAST_SEEN = 5
"""Fewest frames in which two cameras must see the spot at rest."""
STILL_M = 0.01
"""How far from the middle of its frames a spot at rest may be found, in most of them."""
MOST = 0.9
MISFIT_M = 0.03
"""How far from its stated place a fact may come to lie: beyond it, something else was measured."""


def stated(cameras: Sequence[Camera], facts: Facts, points: Floats, frames: Integers) -> Similarity:
    """Return the similarity that the stated facts of a rig give.

    Parameters
    ----------
    facts : of one kind: at least three marks on which the spot rested (``from_frame``, ``to_frame``, both included,
        and ``place_m``) or places of cameras (``camera``, ``place_m``), not on a line; or one distance of two cameras
        (``between``, ``distance_m``), which gives the metre, with the axes ``before`` the first camera.
    points, frames : where the spot was found (N, 3), NaN where no two cameras agree, and in which frames (N,).

    Raises
    ------
    UserError : where the facts are of several kinds, do not determine the change, or contradict what was found.
    """
    kinds = {frozenset(fact) for fact in facts}
    if kinds == {frozenset({"from_frame", "to_frame", "place_m"})}:
        return by_touched(facts, points, frames)
    if kinds == {frozenset({"camera", "place_m"})}:
        return by_places(cameras, facts)
    if kinds == {frozenset({"between", "distance_m"})} and len(facts) == 1:
        return by_distance(cameras, facts[0])
    raise UserError(
        "calibration: the facts give no one metre; state touched points (from_frame, to_frame, place_m), "
        "or places of cameras (camera, place_m), or one distance (between, distance_m)"
    )


def before(camera: Camera, scale: float = 1.0) -> Similarity:
    """Return the change to the axes of someone who faces the camera: x to its right, y up in its picture, z to it.

    The camera is the origin.
    """
    rotation = FACING @ camera.rotation
    return Similarity(scale, rotation, scale * FACING @ np.array(camera.shift_m))


def by_distance(cameras: Sequence[Camera], fact: Mapping[str, Any]) -> Similarity:
    """Return the change that puts two named cameras the stated distance apart, in the axes ``before`` the first one.

    Raises
    ------
    UserError : where there is no such camera.
    """
    first, second = _places(cameras, fact["between"])
    return before(cameras[0], fact["distance_m"] / float(np.linalg.norm(first - second)))


def by_places(cameras: Sequence[Camera], facts: Facts) -> Similarity:
    """Return the similarity that brings the cameras nearest to their measured places.

    Films tell the depth of a camera less well than the place of a point before it: touched points are more exact.

    Raises
    ------
    UserError : where fewer than three places are stated, one is of no camera, all lie on a line, or one is wrong.
    """
    found = _places(cameras, [fact["camera"] for fact in facts])
    return _fit(found, facts, [f"camera {fact['camera']}" for fact in facts])


def by_touched(facts: Facts, points: Floats, frames: Integers) -> Similarity:
    """Return the similarity that brings the marks on which the spot rested nearest to their stated places.

    Raises
    ------
    UserError : where fewer than three marks are stated, all lie on a line, the spot moved or was not seen, or one
        place is wrong.
    """
    named = [f"frames {fact['from_frame']} to {fact['to_frame']}" for fact in facts]
    rests = []
    for fact, name in zip(facts, named, strict=True):
        rest = points[(frames >= fact["from_frame"]) & (frames <= fact["to_frame"])]
        rest = rest[~np.isnan(rest[:, 0])]
        if len(rest) < LEAST_SEEN:
            raise UserError(
                f"calibration: {name}: two cameras see the spot in {len(rest)} of them, at least {LEAST_SEEN} are "
                "needed; state when it rests, or touch a point that more cameras see"
            )
        rests.append(rest)
    middles = np.array([np.median(rest, axis=0) for rest in rests])
    scale = fit(middles, _wanted(facts)).scale
    for rest, middle, name in zip(rests, middles, named, strict=True):
        strayed = scale * float(np.quantile(np.linalg.norm(rest - middle, axis=1), MOST))
        if strayed > STILL_M:
            raise UserError(
                f"calibration: {name}: the spot moves by {1000 * strayed:.0f} mm; state just the frames "
                "in which it rests"
            )
    return _fit(middles, facts, named)


def fit(found: Floats, wanted: Floats) -> Similarity:
    """Return the similarity that takes ``found`` (n, 3) to ``wanted`` (n, 3) with the least sum of squares.

    Raises
    ------
    UserError : where there are fewer than three points, or all lie on a line.
    """
    if len(wanted) < 3:
        raise UserError(f"calibration: {len(wanted)} places are stated, at least three fix the axes")
    spread = np.linalg.svd(wanted - wanted.mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_ACROSS * spread[0]:
        raise UserError("calibration: the stated places lie on a line, which leaves a rotation open; state another")
    return fit_similarity(found, wanted)


def _fit(found: Floats, facts: Facts, named: Sequence[str]) -> Similarity:
    """Return the similarity that takes ``found`` (n, 3) to the stated places; none may be far from its own."""
    change = fit(found, _wanted(facts))
    missed = np.linalg.norm(change.points(found) - _wanted(facts), axis=1)
    worst = int(np.argmax(missed))
    if missed[worst] > MISFIT_M:
        raise UserError(
            f"calibration: {named[worst]}: found {1000 * missed[worst]:.0f} mm from the stated place; measure the "
            "places again, or correct the facts"
        )
    return change


def _wanted(facts: Facts) -> Floats:
    return np.array([fact["place_m"] for fact in facts], dtype=float)


def _places(cameras: Sequence[Camera], names: Sequence[str]) -> Floats:
    known = {camera.name: camera.place_m for camera in cameras}
    for name in names:
        if name not in known:
            raise UserError(f"calibration: a fact is stated of camera {name}, the rig has {', '.join(known)}")
    return np.array([known[name] for name in names])
