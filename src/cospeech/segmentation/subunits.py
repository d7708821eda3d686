"""Gesture subunits of head, arms and legs, and clusters of similar ones (Levine 2009, 2.2 and 2.3).

The three sections of the body move at different times, so each is segmented by itself. A boundary is where the
weighted sum of squared angular velocities

    z = sum over joints of u_j |omega_j|^2

crosses a threshold; omega_j is the angular velocity of a joint relative to its parent (of the hips, in the world).
The thesis prints no weights u_j, but says that joints of high influence weigh more: here, u_j is the reach of a
joint, the length of the longest chain of bones that it moves. The threshold is relative to the speaker's own motion.
With the minimum length of the demo, 0.1 to 0.3 % of the subunits in the studio's world ``syllables`` have no
syllable; the thesis reports less than 0.4 % (4.2). With 0.2 s, there would be up to 2 %.

Two subunits are compared by their length, their first pose and a summary of their dynamics: a weighted sum of
Euclidean distances, each divided by its root mean square over all pairs. Still subunits have similar summaries;
between two of them the pose weighs more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats, Integers, Singles
from cospeech.geometry import rotation
from cospeech.kernels.jit import njit
from cospeech.motion import skeleton
from cospeech.segmentation import movement, ward

POSED = {
    "arms": ("left_forearm", "left_hand", "right_forearm", "right_hand"),
    "legs": ("left_shin", "left_foot", "right_shin", "right_foot"),
}
"""The joints whose positions relative to the hips are the pose of a section; that of the head is an orientation."""

KEY = {"arms": ("left_hand", "right_hand"), "legs": ("left_foot", "right_foot")}
"""The joints whose displacements are summarised; for the head it is the rotation of the neck."""

LEAST_DEG_S = 10.0
"""Smallest threshold of the root of z. A section at rest turns more slowly, including the noise of a recording."""

STRONG = 4.0
"""A short movement is a subunit if its integral of z is at least this many times that of a movement of the minimum
length at the threshold."""

LARGEST = 20_000
"""Number of subunits that are clustered at most; their distances take 2.4 GB. If there are more, evenly spaced ones
are clustered, and each of the others joins the nearest medoid."""


class Traits(NamedTuple):
    """What N subunits are compared by; the distance of two is the sum of the weighted distances of these vectors.

    Attributes
    ----------
    parts : length (N, 1), pose (N, P), and three vectors that summarise the dynamics, (N, K) each: root mean square
        velocity, displacement of greatest magnitude, and mean displacement along each axis. Each is divided by its
        root mean square distance over all pairs.
    weights : (5,) weight of each part.
    still : (N,) whether a subunit is without movement.
    still_pose : weight of the pose between two still subunits.
    """

    parts: tuple[Floats, ...]
    weights: Floats
    still: Flags
    still_pose: float


def find(motions: Mapping[str, pd.DataFrame], settings: Mapping[str, Any]) -> dict[str, pd.DataFrame]:
    """Return the subunits (schema ``subunits``) of records of one speaker, by section.

    Parameters
    ----------
    motions : motion tables by record. Thresholds, distances and clusters are based on all of them.
    settings : ``segmentation.subunits`` of the configuration: threshold, minimum_s, longest_s, weights,
        members_per_cluster.
    """
    rates = {record: skeleton.frame_rate(motion) for record, motion in motions.items()}
    bodies = {record: movement.body_frame(motion) for record, motion in motions.items()}
    found = {}
    for section in skeleton.SECTIONS:
        turning = {record: angular_speed(motions[record], section, rates[record]) for record in motions}
        limit = movement.threshold(turning.values(), settings["threshold"], LEAST_DEG_S)
        tables, traits = [], []
        for record, fps in rates.items():
            starts, ends, still = boundaries(
                turning[record], limit, fps, settings["minimum_s"], settings["longest_s"]
            )
            tables.append(movement.table(record, "segment", starts, ends, fps).assign(still=still))
            traits.append(_summary(section, *bodies[record], starts, ends, fps))
        table = pd.concat(tables, ignore_index=True)
        compared = _scaled(traits, table["still"].to_numpy(), settings["weights"])
        labels, medoids = _clusters(compared, settings["members_per_cluster"][section])
        table["cluster"] = labels
        table["medoid"] = np.isin(np.arange(len(table)), medoids)
        found[section] = table
    return found


def reach_m() -> dict[str, float]:
    """Return the length of the longest chain of bones that each joint moves, in metres."""
    reach = {joint: float(np.linalg.norm(skeleton.TIPS_M.get(joint, (0.0, 0.0, 0.0)))) for joint in skeleton.JOINTS}
    for joint in reversed(skeleton.BODY):
        if joint.parent is not None:
            reach[joint.parent] = max(reach[joint.parent], reach[joint.name] + float(np.linalg.norm(joint.offset_m)))
    return reach


def angular_speed(motion: pd.DataFrame, section: str, fps: float) -> Floats:
    """Return the root of z of one section, (T,), in degrees per second; the weights u_j of the section sum to 1."""
    joints = skeleton.SECTIONS[section]
    matrices = skeleton.rotations(skeleton.angles(motion, joints))
    smoothed = movement.smooth(matrices, fps)
    change = movement.rate(smoothed, fps)
    # dR/dt R^T is the cross product matrix of omega, whose squared norm is twice that of omega.
    squared = 0.5 * np.degrees(1.0) ** 2 * (change**2).sum(axis=(2, 3))
    reach = reach_m()
    weights = np.array([reach[joint] for joint in joints])
    return np.asarray(np.sqrt(squared @ (weights / weights.sum())), dtype=np.float64)


def boundaries(
    turning: Floats, limit: float, fps: float, minimum_s: float, longest_s: float
) -> tuple[Integers, Integers, Flags]:
    """Return the first frames of subunits, the first frames after them, and whether they are still.

    A subunit has a minimum length, or it is a short movement with a large integral of z. Other short movements
    belong to the stillness around them. A dip below the threshold that is too short for a subunit separates two
    strokes at its slowest frame. A subunit that is longer than ``longest_s`` is divided at the slowest frame of its
    middle third, until no part is too long.

    Parameters
    ----------
    turning : (T,) root of z.
    limit : threshold of ``turning``.
    """
    shortest = minimum_s * fps - 1e-6  # a product of seconds and rate is rounded
    strong = STRONG * limit**2 * minimum_s * fps
    run = np.append(0.0, np.cumsum(turning**2))

    def enough(start: int, end: int) -> bool:
        return bool(end - start >= shortest or run[end] - run[start] >= strong)

    moving = turning > limit
    for start, end in _runs_of(moving, True):
        moving[start:end] = enough(start, end)
    if moving.any():
        for start, end in _runs_of(moving, False):
            moving[start:end] = end - start < shortest
    cuts = [0]
    for start, end in zip(*(frames.tolist() for frames in movement.runs(moving)), strict=True):
        for stroke in _strokes(turning, start, end, limit, enough) if moving[start] else [end]:
            cuts += _divided(turning, cuts[-1], stroke, max(3.0, longest_s * fps))
    first = np.array(cuts[:-1], dtype=np.int64)
    return first, np.array(cuts[1:], dtype=np.int64), ~moving[first]


def _runs_of(flags: Flags, value: bool) -> list[tuple[int, int]]:
    """Return the first frame of each run of ``value``, and the first frame after it."""
    starts, ends = movement.runs(flags)
    chosen = flags[starts] == value
    return list(zip(starts[chosen].tolist(), ends[chosen].tolist(), strict=True))


def _strokes(turning: Floats, start: int, end: int, limit: float, enough: Callable[[int, int], bool]) -> list[int]:
    """Return the ends of the strokes of one movement. The slowest dip between two of them is the first boundary."""
    low = start + np.flatnonzero(turning[start:end] <= limit)
    for cut in low[np.argsort(turning[low], kind="stable")].tolist():
        if enough(start, cut) and enough(cut, end):
            return _strokes(turning, start, cut, limit, enough) + _strokes(turning, cut, end, limit, enough)
    return [end]


def _divided(turning: Floats, start: int, end: int, longest: float) -> list[int]:
    """Return the ends of the parts of one subunit."""
    if end - start <= longest:
        return [end]
    third = (end - start) // 3
    middle = start + third + int(turning[start + third : end - third].argmin())
    return _divided(turning, start, middle, longest) + _divided(turning, middle, end, longest)


def _summary(
    section: str,
    positions: Mapping[str, Floats],
    orientations: Floats,
    starts: Integers,
    ends: Integers,
    fps: float,
) -> tuple[Floats, ...]:
    """Return the ``parts`` of the subunits of one record, before they are scaled."""
    if section == "head":
        chest, head = (orientations[:, skeleton.JOINTS.index(joint)] for joint in ("chest", "head"))
        matrices = np.swapaxes(chest, 1, 2) @ head
        pose = rotation.to_vectors(matrices)
    else:
        pose = np.concatenate([positions[joint] for joint in POSED[section]], axis=1)
        key = np.concatenate([positions[joint] for joint in KEY[section]], axis=1)
    rows = []
    for start, end in zip(starts, ends, strict=True):
        if section == "head":
            moved = rotation.to_vectors(matrices[start].T @ matrices[start:end])
        else:
            moved = key[start:end] - key[start]
        velocity = np.sqrt((movement.rate(moved, fps) ** 2).mean(axis=0))
        furthest = np.take_along_axis(moved, np.abs(moved).argmax(axis=0)[None], axis=0)[0]
        rows.append((velocity, furthest, moved.mean(axis=0)))
    dynamics = (np.array(part) for part in zip(*rows, strict=True))
    return np.log((ends - starts) / fps)[:, None], pose[starts], *dynamics


def _scaled(traits: Sequence[tuple[Floats, ...]], still: Flags, weights: Mapping[str, float]) -> Traits:
    """Return the traits of all subunits, scaled to comparable distances."""
    length, pose, *dynamics = (np.concatenate(part) for part in zip(*traits, strict=True))
    parts = [length, pose, *(_logarithmic(part) for part in dynamics)]
    for index, part in enumerate(parts):
        squared = 2.0 * part.var(axis=0).sum() * len(part) / max(1, len(part) - 1)
        parts[index] = part / np.sqrt(squared) if squared > 0.0 else np.zeros(part.shape)
    return Traits(
        tuple(parts), np.array([weights["length"], weights["pose"], 1.0, 1.0, 1.0]), still, weights["still_pose"]
    )


def _logarithmic(vectors: Floats) -> Floats:
    """Return vectors (N, K) of the same direction with logarithmic lengths, relative to their median length.

    It is the vector of both hands or feet that is rescaled, so that small movements of an unused hand stay small.
    """
    length = np.linalg.norm(vectors, axis=1)
    typical = np.median(length[length > 0.0]) if (length > 0.0).any() else 1.0
    scale = np.log1p(length / typical) / np.where(length > 0.0, length, 1.0)
    return vectors * scale[:, None]


def distances(one: Traits, other: Traits) -> Singles:
    """Return the distances of N subunits from M others, (N, M), in single precision."""
    result = np.empty((len(one.still), len(other.still)), dtype=np.float32)
    sizes = np.array([part.shape[1] for part in one.parts])
    _fill(*(np.hstack(traits.parts) for traits in (one, other)), one.still, other.still, sizes,
          one.weights, one.still_pose, result)  # fmt: skip
    return result


@njit
def _fill(
    one: Any, other: Any, still: Any, other_still: Any, sizes: Any, weights: Any, still_pose: float, result: Any
) -> None:
    """Write the distances between the rows of two matrices, whose columns are the parts of a distance."""
    for a in range(len(one)):
        for b in range(len(other)):
            total, first = 0.0, 0
            for part in range(len(sizes)):
                squared = 0.0
                for column in range(first, first + sizes[part]):
                    squared += (one[a, column] - other[b, column]) ** 2
                first += sizes[part]
                weight = still_pose if part == 1 and still[a] and other_still[b] else weights[part]
                total += weight * np.sqrt(squared)
            result[a, b] = total


def _clusters(traits: Traits, members: float) -> ward.Clusters:
    """Return clusters of subunits, of which each has ``members`` on average."""
    n_all = len(traits.still)
    chosen = np.unique(np.linspace(0, n_all - 1, min(n_all, LARGEST)).round().astype(np.int64))
    clustered = _rows(traits, chosen)
    found = ward.cut(ward.tree(distances(clustered, clustered)), max(1, round(len(chosen) / members)))
    medoids = chosen[found.medoids]
    labels = np.empty(n_all, dtype=np.int64)
    labels[chosen] = found.labels
    others = np.setdiff1d(np.arange(n_all), chosen)
    labels[others] = distances(_rows(traits, others), _rows(traits, medoids)).argmin(axis=1)
    return ward.Clusters(labels, medoids)


def _rows(traits: Traits, rows: Integers) -> Traits:
    return traits._replace(parts=tuple(part[rows] for part in traits.parts), still=traits.still[rows])
