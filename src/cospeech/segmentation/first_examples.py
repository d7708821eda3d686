"""First examples of gesture phrases without a person: Table 4.1 of Özkul 2012 read off the joint angles.

Every class has a score a frame, between 0 (no sign of it) and 1 (clear). A phrase is a stretch where the score stays
above ``LOW`` and somewhere reaches ``HIGH``; the clearest stretches of each class become its examples. Hands are
looked at in the frame of the chest, so that leaning and turning do not count, and by their own range of motion in
the records at hand, so that a reserved speaker is read like a lively one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from cospeech.data.arrays import Floats
from cospeech.motion import skeleton

LOW, HIGH = 0.35, 0.6
SHORTEST_S, LONGEST_S = 0.5, 6.0
EXAMPLES = 5
"""Examples proposed of each class."""

WINDOW_S = 0.5
"""Window over which a hand's speed and direction are judged."""

LEAST_RANGE_M, LEAST_SPEED = 0.10, 0.2
"""Smaller ranges of motion in m and speeds in m/s are not stretched to the whole scale: noise is no gesture."""

TOUCHING_M, APART_M = (0.08, 0.20), 0.15
"""Wrists touch at the shortest distance of the records, but within these limits; that much farther they do not."""


class Hands(NamedTuple):
    """Wrists of one record in the frame of the chest, (T, 3) each in metres, and the frame rate."""

    left: Floats
    right: Floats
    fps: float


class Scale(NamedTuple):
    """A quantity's ends over all records: what counts as 0 and what as 1."""

    low: float
    high: float

    def of(self, values: Floats) -> Floats:
        """Return ``values`` on the scale, cut to [0, 1]."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)


def complete(annotations: pd.DataFrame, motions: dict[str, pd.DataFrame], labels: tuple[str, ...]) -> pd.DataFrame:
    """Return the annotations, and proposed examples of each class in ``labels`` that has no annotation.

    Parameters
    ----------
    annotations : labelled examples of the records (schema ``annotations``); nothing is proposed over them.
    motions : motion tables by record.

    Returns
    -------
    At most ``EXAMPLES`` proposals a class, the clearest of all records; none of a class that no record shows.
    """
    missing = [label for label in labels if label not in set(annotations["gesture"])]
    hands = {record: wrists(motion) for record, motion in motions.items()}
    measure = scales(list(hands.values()))
    found = [
        (clarity, record, start, end, label)
        for record, pair in hands.items()
        for label, score in scores(pair, measure).items()
        if label in missing
        for start, end, clarity in stretches(score, pair.fps)
    ]
    rows = list(annotations[["record", "start_s", "end_s", "gesture", "origin"]].itertuples(index=False, name=None))
    for _, record, start, end, label in sorted(found, key=lambda stretch: (-stretch[0], *stretch[1:])):
        start_s, end_s = start / hands[record].fps, end / hands[record].fps
        overlaps = any(row[0] == record and start_s < row[2] and row[1] < end_s for row in rows)
        if not overlaps and sum(row[3] == label for row in rows) < EXAMPLES:
            rows.append((record, start_s, end_s, label, "rule"))
    table = pd.DataFrame(rows, columns=["record", "start_s", "end_s", "gesture", "origin"])
    return table.sort_values(["record", "start_s"], ignore_index=True)


def wrists(motion: pd.DataFrame) -> Hands:
    """Return the wrists of a motion table as they move against the chest."""
    angles = skeleton.angles(motion).copy()
    still = [index for index, joint in enumerate(skeleton.JOINTS) if joint not in skeleton.ARM_JOINTS]
    angles[:, still] = 0.0
    placed = skeleton.forward(np.zeros((len(motion), 3)), angles)
    left, right = (placed[f"{side}_hand"] - placed["chest"] for side in ("left", "right"))
    return Hands(left, right, skeleton.frame_rate(motion))


def scales(hands: list[Hands]) -> dict[str, Scale]:
    """Return what counts as none and as all of each sign, from its range over all records."""
    left, right = (np.concatenate([getattr(pair, side) for pair in hands]) for side in ("left", "right"))
    speed = np.concatenate([_speed(getattr(pair, side), pair.fps) for pair in hands for side in ("left", "right")])
    nearest = np.quantile(np.linalg.norm(left - right, axis=1), 0.02)
    touching = -float(np.clip(nearest, *TOUCHING_M))
    furthest_back = float(np.quantile(-np.maximum(left[:, 2], right[:, 2]), 0.98))
    return {
        "left": _height(left[:, 1]),
        "right": _height(right[:, 1]),
        "back": Scale(0.0, max(furthest_back, LEAST_RANGE_M)),
        "near": Scale(touching - APART_M, touching),
        "speed": Scale(0.0, max(float(np.quantile(speed, 0.9)), LEAST_SPEED)),
    }


def _height(values: Floats) -> Scale:
    low, high = np.quantile(values, [0.1, 0.95])
    return Scale(float(low), float(max(high, low + LEAST_RANGE_M)))


def scores(hands: Hands, scale: dict[str, Scale]) -> dict[str, Floats]:
    """Return the score of every class of Table 4.1 a frame, (T,) each; the weakest of its signs decides."""
    left, right = scale["left"].of(hands.left[:, 1]), scale["right"].of(hands.right[:, 1])
    near = scale["near"].of(-np.linalg.norm(hands.left - hands.right, axis=1))
    back = scale["back"].of(-np.maximum(hands.left[:, 2], hands.right[:, 2]))
    moving = [scale["speed"].of(_speed(hand, hands.fps)) for hand in (hands.left, hands.right)]
    still = 1.0 - np.maximum(*moving)
    crossed = np.abs(_upright(hands.left, hands.fps) - _upright(hands.right, hands.fps)) * np.minimum(*moving) ** 0.5
    level = 1.0 - np.abs(left - right)
    return {
        "raise_both": _weakest(left, right, level, 1.0 - near, 1.0 - back, 1.0 - crossed),
        "rest": _weakest(1.0 - left, 1.0 - right, still, 1.0 - back),
        "left": _weakest(left, 1.0 - right),
        "perpendicular": _weakest(crossed, 1.0 - near),
        "contact": near,
        "open": back,
        "right": _weakest(right, 1.0 - left),
    }


def _weakest(*signs: Floats) -> Floats:
    return np.minimum.reduce(signs)


def _speed(hand: Floats, fps: float) -> Floats:
    """Return the speed of a hand in m/s, (T,), averaged over the window."""
    steps = np.linalg.norm(np.diff(hand, axis=0, prepend=hand[:1]), axis=1) * fps
    return uniform_filter1d(steps, max(1, round(WINDOW_S * fps)), mode="nearest")


def _upright(hand: Floats, fps: float) -> Floats:
    """Return the share of a hand's way that it makes up and down, (T,), over the window."""
    steps = np.abs(np.diff(hand, axis=0, prepend=hand[:1]))
    way = uniform_filter1d(steps, max(1, round(WINDOW_S * fps)), axis=0, mode="nearest")
    level = np.hypot(way[:, 0], way[:, 2])
    return way[:, 1] / np.maximum(way[:, 1] + level, 1e-9)


def stretches(score: Floats, fps: float) -> list[tuple[int, int, float]]:
    """Return first frame, end and mean score of the stretches above ``LOW`` that reach ``HIGH``."""
    above = np.concatenate([[False], score > LOW, [False]])
    edges = np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)
    return [
        (int(start), int(end), float(score[start:end].mean()))
        for start, end in edges
        if score[start:end].max() >= HIGH and SHORTEST_S <= (end - start) / fps <= LONGEST_S
    ]
