"""Examples of gesture phrases without manual annotation: rules that apply Table 4.1 of Özkul 2012 to joint angles.

Each class has a score per frame, between 0 (absent) and 1 (clearly present). A candidate phrase is an interval in
which the score stays above ``LOW`` and reaches ``HIGH`` at least once; the candidates with the highest mean score
become the examples of the class. Hand positions are relative to the chest, so that leaning and turning have no
effect, and are scaled by their range over all records, so that the rules fit reserved and lively speakers alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from cospeech.data.arrays import Floats
from cospeech.motion import skeleton

LOW, HIGH = 0.35, 0.6
MIN_DURATION_S, MAX_DURATION_S = 0.5, 6.0
MAX_EXAMPLES = 5
"""Largest number of examples proposed per class."""

WINDOW_S = 0.5
"""Window over which the speed and direction of a hand are averaged."""

MIN_RANGE_M, MIN_SPEED = 0.10, 0.2
"""Smallest range of motion in m and speed in m/s that a scale spans, so that noise is not mistaken for gesture."""

CONTACT_M, SEPARATION_M = (0.08, 0.20), 0.15
"""The wrist distance that scores 1 for contact is the smallest in the records, clipped to the range ``CONTACT_M``;
a distance larger by ``SEPARATION_M`` scores 0."""


class Hands(NamedTuple):
    """Wrist positions of one record relative to the chest, (T, 3) each in metres, and the frame rate."""

    left: Floats
    right: Floats
    fps: float


class Scale(NamedTuple):
    """Linear scale of a quantity: the values that map to 0 and to 1."""

    low: float
    high: float

    def apply(self, values: Floats) -> Floats:
        """Return the scaled ``values``, clipped to [0, 1]."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)


def add_proposals(
    annotations: pd.DataFrame, motions: dict[str, pd.DataFrame], labels: tuple[str, ...]
) -> pd.DataFrame:
    """Return the annotations together with proposed examples of each class in ``labels`` that has none.

    Parameters
    ----------
    annotations : annotated examples of the records (schema ``annotations``); proposals do not overlap them.
    motions : motion tables by record.
    labels : the gesture classes.

    Returns
    -------
    A table of schema ``annotations``. A class gets the at most ``MAX_EXAMPLES`` proposals with the highest mean score
    over all records, or none if it does not occur.
    """
    missing = [label for label in labels if label not in set(annotations["gesture"])]
    hands = {record: wrists(motion) for record, motion in motions.items()}
    scales = fit_scales(list(hands.values()))
    candidates = [
        (mean_score, record, start, end, label)
        for record, pair in hands.items()
        for label, score in class_scores(pair, scales).items()
        if label in missing
        for start, end, mean_score in intervals(score, pair.fps)
    ]
    rows = list(annotations[["record", "start_s", "end_s", "gesture", "origin"]].itertuples(index=False, name=None))
    for _, record, start, end, label in sorted(candidates, key=lambda candidate: (-candidate[0], *candidate[1:])):
        start_s, end_s = start / hands[record].fps, end / hands[record].fps
        overlaps = any(row[0] == record and start_s < row[2] and row[1] < end_s for row in rows)
        if not overlaps and sum(row[3] == label for row in rows) < MAX_EXAMPLES:
            rows.append((record, start_s, end_s, label, "rule"))
    table = pd.DataFrame(rows, columns=["record", "start_s", "end_s", "gesture", "origin"])
    return table.sort_values(["record", "start_s"], ignore_index=True)


def wrists(motion: pd.DataFrame) -> Hands:
    """Return the wrist positions of a motion table relative to the chest."""
    angles = skeleton.angles(motion).copy()
    others = [index for index, joint in enumerate(skeleton.JOINTS) if joint not in skeleton.ARM_JOINTS]
    angles[:, others] = 0.0
    positions = skeleton.forward(np.zeros((len(motion), 3)), angles)
    left, right = (positions[f"{side}_hand"] - positions["chest"] for side in ("left", "right"))
    return Hands(left, right, skeleton.frame_rate(motion))


def fit_scales(hands: list[Hands]) -> dict[str, Scale]:
    """Return the scale of each cue (hand height, behind the back, contact, speed) from its range in all records."""
    left, right = (np.concatenate([getattr(pair, side) for pair in hands]) for side in ("left", "right"))
    speed = np.concatenate([_speed(getattr(pair, side), pair.fps) for pair in hands for side in ("left", "right")])
    nearest = np.quantile(np.linalg.norm(left - right, axis=1), 0.02)
    contact = -float(np.clip(nearest, *CONTACT_M))
    furthest_back = float(np.quantile(-np.maximum(left[:, 2], right[:, 2]), 0.98))
    return {
        "left": _height(left[:, 1]),
        "right": _height(right[:, 1]),
        "back": Scale(0.0, max(furthest_back, MIN_RANGE_M)),
        "near": Scale(contact - SEPARATION_M, contact),
        "speed": Scale(0.0, max(float(np.quantile(speed, 0.9)), MIN_SPEED)),
    }


def _height(values: Floats) -> Scale:
    low, high = np.quantile(values, [0.1, 0.95])
    return Scale(float(low), float(max(high, low + MIN_RANGE_M)))


def class_scores(hands: Hands, scales: dict[str, Scale]) -> dict[str, Floats]:
    """Return the score per frame, (T,), of each class of Table 4.1: the minimum over the cues of the class."""
    left, right = scales["left"].apply(hands.left[:, 1]), scales["right"].apply(hands.right[:, 1])
    near = scales["near"].apply(-np.linalg.norm(hands.left - hands.right, axis=1))
    back = scales["back"].apply(-np.maximum(hands.left[:, 2], hands.right[:, 2]))
    moving = [scales["speed"].apply(_speed(hand, hands.fps)) for hand in (hands.left, hands.right)]
    still = 1.0 - np.maximum(*moving)
    crossed = (
        np.abs(_vertical_share(hands.left, hands.fps) - _vertical_share(hands.right, hands.fps))
        * np.minimum(*moving) ** 0.5
    )
    level = 1.0 - np.abs(left - right)
    return {
        "raise_both": _minimum(left, right, level, 1.0 - near, 1.0 - back, 1.0 - crossed),
        "rest": _minimum(1.0 - left, 1.0 - right, still, 1.0 - back),
        "left": _minimum(left, 1.0 - right),
        "perpendicular": _minimum(crossed, 1.0 - near),
        "contact": near,
        "open": back,
        "right": _minimum(right, 1.0 - left),
    }


def _minimum(*cues: Floats) -> Floats:
    return np.minimum.reduce(cues)


def _speed(hand: Floats, fps: float) -> Floats:
    """Return the speed of a hand in m/s, (T,), as a moving average over ``WINDOW_S``."""
    steps = np.linalg.norm(np.diff(hand, axis=0, prepend=hand[:1]), axis=1) * fps
    return uniform_filter1d(steps, max(1, round(WINDOW_S * fps)), mode="nearest")


def _vertical_share(hand: Floats, fps: float) -> Floats:
    """Return the vertical share of the path of a hand, (T,), as a moving average over ``WINDOW_S``."""
    steps = np.abs(np.diff(hand, axis=0, prepend=hand[:1]))
    path = uniform_filter1d(steps, max(1, round(WINDOW_S * fps)), axis=0, mode="nearest")
    level = np.hypot(path[:, 0], path[:, 2])
    return path[:, 1] / np.maximum(path[:, 1] + level, 1e-9)


def intervals(score: Floats, fps: float) -> list[tuple[int, int, float]]:
    """Return start frame, end frame and mean score of the intervals above ``LOW`` that reach ``HIGH``."""
    above = np.concatenate([[False], score > LOW, [False]])
    edges = np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)
    return [
        (int(start), int(end), float(score[start:end].mean()))
        for start, end in edges
        if score[start:end].max() >= HIGH and MIN_DURATION_S <= (end - start) / fps <= MAX_DURATION_S
    ]
