"""Rotations: conversion of Euler angles and rotation vectors to matrices, and back.

scipy.spatial.transform does the same, but importing it takes longer than most jobs run. The tests compare the two.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats

AXES = "XYZ"


def from_euler(order: str, angles_deg: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of intrinsic rotations about the axes of ``order``, first to last.

    Parameters
    ----------
    order : axes, such as "XZY".
    angles_deg : (..., len(order)) angles in degrees, in the order of ``order``.
    """
    turned = np.broadcast_to(np.eye(3), (*angles_deg.shape[:-1], 3, 3))
    for place, axis in enumerate(order):
        turned = turned @ _about(AXES.index(axis), np.radians(angles_deg[..., place]))
    return turned


def _about(axis: int, angle: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of rotations about one axis by angles (...) in radians."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((*angle.shape, 3, 3))
    turn[..., axis, axis] = 1.0
    turn[..., i, i] = turn[..., j, j] = np.cos(angle)
    turn[..., j, i] = np.sin(angle)
    turn[..., i, j] = -turn[..., j, i]
    return turn


def to_euler(order: str, matrices: Floats) -> Floats:
    """Return the intrinsic angles (..., 3) in degrees about three different axes, the second within 90 degrees.

    If the second angle is 90 degrees (gimbal lock), only the sum or difference of the others is determined: the last
    is set to zero.
    """
    i, j, k = (AXES.index(axis) for axis in order)
    sign = 1.0 if (i + 1) % 3 == j else -1.0
    # The arc sine of the third entry would be inaccurate near the gimbal lock.
    cosine = np.hypot(matrices[..., i, i], matrices[..., i, j])
    second = np.arctan2(sign * matrices[..., i, k], cosine)
    locked = cosine < 1e-9
    first = np.where(
        locked,
        np.arctan2(sign * matrices[..., k, j], matrices[..., j, j]),
        np.arctan2(-sign * matrices[..., j, k], matrices[..., k, k]),
    )
    last = np.where(locked, 0.0, np.arctan2(-sign * matrices[..., i, j], matrices[..., i, i]))
    return np.degrees(np.stack([first, second, last], axis=-1))


def from_vectors(turns: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of rotation vectors (..., 3) in radians (Rodrigues' formula)."""
    angle = np.linalg.norm(turns, axis=-1)[..., None, None]
    cross = _cross(np.asarray(turns, dtype=float))
    # sin(a) / a and (1 - cos(a)) / a^2 by way of sinc, which is smooth at 0.
    return np.eye(3) + np.sinc(angle / np.pi) * cross + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (cross @ cross)


def _cross(vectors: Floats) -> Floats:
    """Return the matrices (..., 3, 3) that give the cross product of vectors (..., 3) with another one."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    none = np.zeros_like(x)
    return np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(*none.shape, 3, 3)


def between(start: Floats, end: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of the smallest rotations from the directions of vectors (..., 3) to others.

    The two directions must not be opposite.
    """
    a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (np.asarray(start), np.asarray(end)))
    cross = _cross(np.cross(a, b))
    return np.eye(3) + cross + cross @ cross / (1 + (a * b).sum(axis=-1))[..., None, None]


def to_quaternions(matrices: Floats) -> Floats:
    """Return the unit quaternions (..., 4), w, x, y, z with w >= 0, of matrices (..., 3, 3).

    That of the four formulas is used which divides by the largest number (S. W. Shepperd, Journal of Guidance and
    Control 1, 1978).
    """
    vector, scalar = _quaternions(np.asarray(matrices, dtype=float).reshape(-1, 3, 3))
    whole = np.column_stack([scalar, vector])
    whole /= np.linalg.norm(whole, axis=1, keepdims=True)
    return whole.reshape(*np.shape(matrices)[:-2], 4)


def from_quaternions(quaternions: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of unit quaternions (..., 4) w, x, y, z."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions, dtype=float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _quaternions(flat: Floats) -> tuple[Floats, Floats]:
    """Return the vector (n, 3) and scalar (n,) parts of quaternions of matrices (n, 3, 3), not normalised."""
    diagonal = np.diagonal(flat, axis1=1, axis2=2)
    trace = diagonal.sum(axis=1)
    largest = np.column_stack([diagonal, trace]).argmax(axis=1)
    quaternions = np.empty((len(flat), 4))
    for i in range(3):
        rows = np.flatnonzero(largest == i)
        j, k, m = (i + 1) % 3, (i + 2) % 3, flat[rows]
        quaternions[rows, i] = 1.0 - trace[rows] + 2.0 * m[:, i, i]
        quaternions[rows, j] = m[:, j, i] + m[:, i, j]
        quaternions[rows, k] = m[:, k, i] + m[:, i, k]
        quaternions[rows, 3] = m[:, k, j] - m[:, j, k]
    rows = np.flatnonzero(largest == 3)
    m = flat[rows]
    skew = [m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]]
    quaternions[rows] = np.column_stack([*skew, 1.0 + trace[rows]])
    quaternions *= np.where(quaternions[:, 3:] < 0, -1.0, 1.0)
    return quaternions[:, :3], quaternions[:, 3]


def to_vectors(matrices: Floats) -> Floats:
    """Return the rotation vectors (..., 3) in radians, of length at most pi, of matrices (..., 3, 3)."""
    vector, scalar = _quaternions(np.asarray(matrices, dtype=float).reshape(-1, 3, 3))
    sine = np.linalg.norm(vector, axis=1)
    angle = 2.0 * np.arctan2(sine, scalar)
    # The vector part has the length of sin(angle / 2) times the norm of the quaternion.
    length = np.hypot(sine, scalar)
    scale = np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 2.0 / length)
    return (scale[:, None] * vector).reshape(np.shape(matrices)[:-1])


def angles_deg(matrices: Floats) -> Floats:
    """Return the angles of rotation (...) of matrices (..., 3, 3) in degrees."""
    return np.degrees(np.linalg.norm(to_vectors(matrices), axis=-1))
