"""The shape of a face from its own motion, where a single camera leaves it unknown.

An ellipsoid instead of the face is wrong by several millimetres and slightly turned, which puts the angles off by a
degree or two. When the head turns, points that are nearer to the camera than supposed move further than expected. The
depths of the points and the poses that explain all positions best are found together by Gauss-Newton steps.

Reference: B. Triggs, P. McLauchlan, R. Hartley and A. Fitzgibbon, Bundle adjustment - a modern synthesis, Vision
Algorithms: Theory and Practice, 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cospeech.capture.head.estimate import THRESHOLD, Estimator, Matches, Measurement
from cospeech.capture.head.optics import Optics
from cospeech.data.arrays import Floats
from cospeech.geometry.rotation import from_vectors

MOST_FRAMES = 90
"""Number of frames, evenly spaced among those that show the head, that determine the shape."""

STEPS = 12
"""Number of Gauss-Newton steps."""

DEPTH_SD_M = 0.01
"""Standard deviation of the depths from those supposed, for positions with a standard deviation of one pixel."""

DAMPING = 1e-4
"""Share of the diagonal that is added to it, so that what the film does not determine stays as it was supposed."""


def measured_again(measured: Sequence[Measurement], estimator: Estimator) -> list[Measurement]:
    """Return the measurements of a film by a single camera with the shape of the face on which they agree.

    Parameters
    ----------
    measured : one per frame; those with a pose have ``seen``.
    estimator : with the supposed shape.
    """
    telling = chosen(measured, MOST_FRAMES)
    if not telling:
        return list(measured)
    points = refined_points(estimator.reference.points_m, telling, estimator.optics)
    own = replace(estimator, reference=replace(estimator.reference, points_m=points), tolerance=THRESHOLD)
    return [_again(one, own) for one in measured]


def chosen(measured: Sequence[Measurement], most: int) -> list[Measurement]:
    """Return up to ``most`` of the measurements that have a pose, evenly spaced."""
    known = [one for one in measured if one.pose is not None]
    return [known[k] for k in np.linspace(0, len(known) - 1, min(len(known), most)).round().astype(int)]


def _again(one: Measurement, estimator: Estimator) -> Measurement:
    """Return a measurement with the points of an estimator, or as it was if too few of them agree."""
    if one.pose is None or one.seen is None:
        return one
    found = np.isfinite(one.seen[:, 0])
    seen = np.column_stack([one.seen[found], np.full(found.sum(), np.nan)])
    again = estimator.measure(Matches(estimator.reference.points_m[found], seen, len(seen)), one.pose)
    return one if again.pose is None else again


def refined_points(points_m: Floats, measured: Sequence[Measurement], optics: Optics) -> Floats:
    """Return the points (n, 3) on the same rays at the depths that, with the best poses, explain where they are seen.

    Parameters
    ----------
    points_m : (n, 3) supposed places in the reference frame.
    measured : poses, which are the start of the search, and where they were seen.
    """
    middle = points_m.mean(axis=0)
    scale = np.ones(len(points_m))
    rotations = np.array([one.pose.rotation for one in measured if one.pose is not None])
    places = np.array([one.pose.points(middle) for one in measured if one.pose is not None])
    seen = np.array([one.seen for one in measured if one.seen is not None], dtype=float)
    prior = (points_m[:, 2] / DEPTH_SD_M) ** 2
    for _ in range(STEPS):
        turns, shifts, stretch = _step(points_m, scale, prior, rotations, places, seen, optics)
        rotations, places, scale = from_vectors(turns) @ rotations, places + shifts, scale + stretch
    return points_m * scale[:, None]


def _step(
    points_m: Floats, scale: Floats, prior: Floats, rotations: Floats, places: Floats, seen: Floats, optics: Optics
) -> tuple[Floats, Floats, Floats]:
    """Return the changes of rotations (K, 3), places (K, 3) and depths (n,) of a Gauss-Newton step.

    The depths are eliminated from the normal equations (Schur complement), because each is a single unknown.
    """
    middle = points_m.mean(axis=0)
    rays = points_m @ rotations.transpose(0, 2, 1)
    arms = scale[:, None] * rays - (rotations @ middle)[:, None]
    now = arms + places[:, None]
    off = seen - optics.pixels(now)
    # Of x = f X / Z and y = -f Y / Z with Z = -z (see ``Optics.pixels``).
    slopes = np.zeros((*off.shape, 3))
    slopes[..., 0, 0], slopes[..., 1, 1] = optics.focal_px[0], -optics.focal_px[1]
    slopes[..., 2] = slopes[..., [0, 1], [0, 1]] * (now[..., :2] / -now[..., 2:])
    slopes /= -now[..., None, 2:]
    of_pose = np.concatenate([np.cross(arms[..., None, :], slopes), slopes], axis=-1)
    of_depth = np.einsum("knai,kni->kna", slopes, rays)
    weight = _weights(off)
    off = np.where(np.isfinite(off), off, 0.0)
    poses = np.einsum("kn,knai,knaj->kij", weight, of_pose, of_pose)
    mixed = np.einsum("kn,knai,kna->kin", weight, of_pose, of_depth).reshape(-1, len(points_m))
    depths = np.einsum("kn,kna,kna->n", weight, of_depth, of_depth) + prior
    right_poses = np.einsum("kn,knai,kna->ki", weight, of_pose, off).ravel()
    right_depths = np.einsum("kn,kna,kna->n", weight, of_depth, off) - prior * (scale - 1.0)
    matrix = -(mixed / depths) @ mixed.T
    for k, own in enumerate(poses):
        matrix[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] += own + DAMPING * np.diag(np.diag(own))
    change = np.linalg.solve(matrix, right_poses - mixed @ (right_depths / depths))
    stretch = (right_depths - mixed.T @ change) / depths
    turns, shifts = np.split(change.reshape(-1, 6), 2, axis=1)
    return turns, shifts, stretch


def _weights(off: Floats) -> Floats:
    """Return the weights (K, n) of points by their distance (K, n, 2) from where they should be; 0 if not seen."""
    square = (off**2).sum(axis=-1)
    typical = max(1.0, float(np.nanmedian(square)))
    return np.where(np.isfinite(square), 1.0 / (1.0 + square / typical), 0.0)
