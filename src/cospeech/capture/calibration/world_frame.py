"""World frame of a self-calibrated rig: metric scale and axes from stated facts, as images determine neither.

Cameras and points are mapped from one frame to another by a similarity: a point X becomes s Q X + b.
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
"""From the axes of a camera (y down, z away from it) to those of a person who faces the camera."""
LEAST_WIDTH = 0.05
"""Minimum extent of the stated positions across their main direction, relative to that along it."""
LEAST_SEEN = 5
"""Minimum number of frames in which two cameras must see the spot at rest."""
STILL_M = 0.01
MOST_FRAMES = 0.9
"""A spot is at rest if it stays within ``STILL_M`` of its median position in this fraction of its frames."""
MISFIT_M = 0.03
"""Largest distance of an estimated position from its stated one; beyond it, the fact is taken to be wrong."""


def from_facts(cameras: Sequence[Camera], facts: Facts, points: Floats, frames: Integers) -> Similarity:
    """Return the similarity to the world frame that the stated facts define.

    Parameters
    ----------
    facts : all of one kind. Either at least three marks, not on a line, that the spot touched (``from_frame`` and
        ``to_frame``, both included, and ``place_m``); or at least three camera positions, not on a line (``camera``,
        ``place_m``); or one distance between two cameras (``between``, ``distance_m``), which sets only the scale:
        the axes are then those of ``facing_camera`` for the first camera.
    points, frames : positions of the spot (N, 3), NaN where no two cameras agree, and their frame numbers (N,).

    Raises
    ------
    UserError : if the facts are of different kinds, do not determine the frame, or contradict the points.
    """
    kinds = {frozenset(fact) for fact in facts}
    if kinds == {frozenset({"from_frame", "to_frame", "place_m"})}:
        return from_touched_points(facts, points, frames)
    if kinds == {frozenset({"camera", "place_m"})}:
        return from_camera_positions(cameras, facts)
    if kinds == {frozenset({"between", "distance_m"})} and len(facts) == 1:
        return from_distance(cameras, facts[0])
    raise UserError(
        "calibration: the facts do not define one metric scale; state touched points (from_frame, to_frame, "
        "place_m), or camera positions (camera, place_m), or one distance (between, distance_m)"
    )


def facing_camera(camera: Camera, scale: float = 1.0) -> Similarity:
    """Return the similarity to the axes of a person who faces the camera, which is the origin.

    x points to the right in the image, y up in the image, and z towards the camera.
    """
    rotation = FACING @ camera.rotation
    return Similarity(scale, rotation, scale * FACING @ np.array(camera.shift_m))


def from_distance(cameras: Sequence[Camera], fact: Mapping[str, Any]) -> Similarity:
    """Return the similarity that sets two cameras the stated distance apart, in the axes facing the first camera.

    Raises
    ------
    UserError : if there is no such camera.
    """
    first, second = _places(cameras, fact["between"])
    return facing_camera(cameras[0], fact["distance_m"] / float(np.linalg.norm(first - second)))


def from_camera_positions(cameras: Sequence[Camera], facts: Facts) -> Similarity:
    """Return the similarity that fits the cameras best to their measured positions.

    Images determine the distance of a camera less precisely than the position of a point in front of it, so touched
    points give a more accurate frame.

    Raises
    ------
    UserError : if fewer than three positions are stated, a camera is unknown, all lie on a line, or one is wrong.
    """
    found = _places(cameras, [fact["camera"] for fact in facts])
    return _fit(found, facts, [f"camera {fact['camera']}" for fact in facts])


def from_touched_points(facts: Facts, points: Floats, frames: Integers) -> Similarity:
    """Return the similarity that fits the marks on which the spot rested best to their stated positions.

    Raises
    ------
    UserError : if fewer than three marks are stated, all lie on a line, the spot moved or was not seen, or one
        position is wrong.
    """
    named = [f"frames {fact['from_frame']} to {fact['to_frame']}" for fact in facts]
    rests = []
    for fact, name in zip(facts, named, strict=True):
        rest = points[(frames >= fact["from_frame"]) & (frames <= fact["to_frame"])]
        rest = rest[~np.isnan(rest[:, 0])]
        if len(rest) < LEAST_SEEN:
            raise UserError(
                f"calibration: {name}: two cameras see the spot in {len(rest)} of these frames, but at least "
                f"{LEAST_SEEN} are needed; state the frames in which it rests, or touch a point that more cameras see"
            )
        rests.append(rest)
    middles = np.array([np.median(rest, axis=0) for rest in rests])
    scale = fit(middles, _stated(facts)).scale
    for rest, middle, name in zip(rests, middles, named, strict=True):
        strayed = scale * float(np.quantile(np.linalg.norm(rest - middle, axis=1), MOST_FRAMES))
        if strayed > STILL_M:
            raise UserError(
                f"calibration: {name}: the spot moves by {1000 * strayed:.0f} mm; state only the frames in which it "
                "rests"
            )
    return _fit(middles, facts, named)


def fit(found: Floats, wanted: Floats) -> Similarity:
    """Return the least-squares similarity from ``found`` (n, 3) to ``wanted`` (n, 3).

    Raises
    ------
    UserError : if there are fewer than three points, or all lie on a line.
    """
    if len(wanted) < 3:
        raise UserError(f"calibration: {len(wanted)} positions are stated, but the axes need at least three")
    spread = np.linalg.svd(wanted - wanted.mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_WIDTH * spread[0]:
        raise UserError(
            "calibration: the stated positions lie on a line, which leaves the rotation about it open; state another"
        )
    return fit_similarity(found, wanted)


def _fit(found: Floats, facts: Facts, named: Sequence[str]) -> Similarity:
    """Return the similarity from ``found`` (n, 3) to the stated positions, all of which must fit."""
    change = fit(found, _stated(facts))
    missed = np.linalg.norm(change.points(found) - _stated(facts), axis=1)
    worst = int(np.argmax(missed))
    if missed[worst] > MISFIT_M:
        raise UserError(
            f"calibration: {named[worst]}: {1000 * missed[worst]:.0f} mm away from the stated position; measure the "
            "positions again, or correct the facts"
        )
    return change


def _stated(facts: Facts) -> Floats:
    return np.array([fact["place_m"] for fact in facts], dtype=float)


def _places(cameras: Sequence[Camera], names: Sequence[str]) -> Floats:
    known = {camera.name: camera.place_m for camera in cameras}
    for name in names:
        if name not in known:
            raise UserError(f"calibration: a fact names camera {name}, but the rig has {', '.join(known)}")
    return np.array([known[name] for name in names])
