"""Initial models for Baum-Welch: a parallel HMM from labelled segments, or from clusters of random segments."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.markov.parallel import LEAST_STAY, MOST_STAY, ParallelHMM


def variance_floor(sequences: list[Floats], features: tuple[str, ...], share: float) -> Floats:
    """Return the minimum variance of each feature, (D,), as a share of its variance over all frames.

    Raises
    ------
    UserError : if a feature, named in ``features``, has no variance.
    """
    frames = np.concatenate(sequences)
    spread = frames.std(axis=0)
    dead = np.flatnonzero(spread <= 1e-12 * np.abs(frames).max(axis=0))
    if len(dead):
        raise UserError(
            f"feature '{features[dead[0]]}' never changes over the {len(frames)} training frames, and a feature "
            "without variance cannot be modelled; check the recordings that it comes from"
        )
    return share * spread**2


def from_segments(groups: list[list[Floats]], states: int, floor: Floats) -> ParallelHMM:
    """Return the model whose branch m is estimated from the segments ``groups[m]``, each split evenly into states.

    A segment (T, D) has at least ``states`` frames.
    """
    n_branches, sizes = len(groups), np.array([len(group) for group in groups])
    segments = [segment for group in groups for segment in group]
    lengths = np.array([len(segment) for segment in segments])
    edges = np.arange(states + 1) * lengths[:, None] // states
    state_of_part = np.repeat(np.arange(n_branches), sizes)[:, None] * states + np.arange(states)
    state, frames = np.repeat(state_of_part.ravel(), np.diff(edges).ravel()), np.concatenate(segments)
    occupied = np.bincount(state, minlength=n_branches * states)

    def mean_of(values: Floats) -> Floats:
        return np.column_stack([np.bincount(state, weights=column) for column in values.T]) / occupied[:, None]

    mean = mean_of(frames)
    variance = np.maximum(mean_of((frames - mean[state]) ** 2), floor)
    stay = 1.0 - np.repeat(sizes, states) / (occupied + 1.0)
    shape = (n_branches, states)
    return ParallelHMM(
        sizes / sizes.sum(),
        np.clip(stay, LEAST_STAY, MOST_STAY).reshape(shape),
        mean.reshape(*shape, -1),
        variance.reshape(*shape, -1),
    )


def from_clusters(
    sequences: list[Floats], n_branches: int, states: int, length: int, floor: Floats, rng: np.random.Generator
) -> ParallelHMM:
    """Return a model whose branches are clusters of random segments of ``length`` frames on average.

    Segments are clustered by the means of their ``states`` parts, each feature divided by its standard deviation, so
    that clusters differ in their course over time and not only in their level.

    Raises
    ------
    UserError : if the sequences are too short for one segment per branch.
    """
    cuts = [_cut(len(frames), max(length, states), states, rng) for frames in sequences]
    segments = [piece for frames, cut in zip(sequences, cuts, strict=True) for piece in np.split(frames, cut[1:])]
    if len(segments) < n_branches:
        n_frames = sum(len(frames) for frames in sequences)
        raise UserError(
            f"{n_frames} training frames are too few for {n_branches} clusters of {states} states; "
            "choose fewer clusters or give longer recordings"
        )
    spread = np.concatenate(sequences).std(axis=0)
    course = np.concatenate([_means(frames, cut, states) for frames, cut in zip(sequences, cuts, strict=True)])
    labels = k_means((course / spread).reshape(len(segments), -1), n_branches, rng)
    groups = [[segments[i] for i in np.flatnonzero(labels == m)] for m in range(n_branches)]
    return from_segments(groups, states, floor)


def _cut(n_frames: int, length: int, shortest: int, rng: np.random.Generator) -> Integers:
    """Return the first frames (L,) of segments of 0.5 to 1.5 times ``length`` frames, at least ``shortest``."""
    steps = rng.uniform(0.5, 1.5, size=2 * n_frames // length + 2) * length
    edges = np.cumsum(np.maximum(np.round(steps).astype(np.int64), shortest))
    return np.append(0, edges[edges <= n_frames - shortest])


def _means(frames: Floats, cut: Integers, states: int) -> Floats:
    """Return the means of the ``states`` parts of each segment, (L, states, D)."""
    lasting = np.diff(np.append(cut, len(frames)))[:, None]
    first = (cut[:, None] + np.arange(states) * lasting // states).ravel()
    n_of_part = np.diff(np.append(first, len(frames)))
    part = np.repeat(np.arange(len(first)), n_of_part)
    sums = np.column_stack([np.bincount(part, weights=feature) for feature in frames.T])
    return np.asarray(sums / n_of_part[:, None]).reshape(len(cut), states, -1)


def k_means(points: Floats, n_clusters: int, rng: np.random.Generator, rounds: int = 30) -> Integers:
    """Return the cluster of every point, (n,), by Lloyd's algorithm with k-means++ seeds; no cluster is empty."""
    centres = points[rng.integers(len(points))][None]
    nearest = ((points - centres[0]) ** 2).sum(axis=1)
    while len(centres) < n_clusters:
        # Points that coincide with a centre have no weight; if all do, any point is drawn.
        weights = nearest / nearest.sum() if nearest.sum() > 0 else None
        centres = np.vstack([centres, points[rng.choice(len(points), p=weights)]])
        nearest = np.minimum(nearest, ((points - centres[-1]) ** 2).sum(axis=1))
    labels = np.full(len(points), -1)
    for _ in range(rounds):
        # The squared norm of a point is the same in all its distances and can be left out.
        found = ((centres**2).sum(axis=1) - 2.0 * points @ centres.T).argmin(axis=1)
        own = ((points - centres[found]) ** 2).sum(axis=1)
        for empty in np.setdiff1d(np.arange(n_clusters), found):
            # An empty cluster gets the point that is farthest from its centre, of clusters with several points.
            crowded = np.bincount(found, minlength=n_clusters)[found] > 1
            taken = int(np.where(crowded, own, -1.0).argmax())
            found[taken], own[taken] = empty, 0.0
        if (found == labels).all():
            break
        labels = found
        centres = np.array([points[labels == k].mean(axis=0) for k in range(n_clusters)])
    return labels.astype(np.int64)
