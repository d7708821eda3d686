"""Scores of the motion of a system, which need no gesture classes: they apply to every system and every corpus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.evaluation import beat_alignment, frechet, hand_speed
from cospeech.motion import skeleton

COLUMNS = ("draw", "measure", "part", "duration_s", "value", "recorded")


class Hands(NamedTuple):
    """What is measured in a motion of T frames: positions (T, 2, 3) and speeds (T, 2) of the wrists, frame rate."""

    places: Floats
    speed: Floats
    fps: float


def measure(motion: pd.DataFrame) -> Hands:
    """Return the positions and speeds of the wrists relative to the hips."""
    places, fps = hand_speed.wrists(motion), skeleton.frame_rate(motion)
    return Hands(places, hand_speed.speeds(places, fps), fps)


def table(
    named: Mapping[str, Any],
    original: pd.DataFrame,
    draws: Sequence[pd.DataFrame],
    syllables: pd.DataFrame | None,
    head_s: float,
    tail_s: float,
) -> pd.DataFrame:
    """Return the table ``motion_scores`` of what one system made of one record.

    Parameters
    ----------
    named : system, variant and record.
    original : motion table of the record.
    draws : motion table of each draw; one that a system failed to make is empty, and is left out.
    syllables : those of the record (schema ``syllables``); without them there is no beat alignment.
    head_s, tail_s : the ends that the interior of the record leaves out.
    """
    own, onsets_s = measure(original), None
    if syllables is not None:
        onsets_s = syllables.loc[syllables["f0_hz"].notna(), "peak_s"].to_numpy(dtype=float)
    n_frames, frame_s = len(own.speed), 1.0 / own.fps
    parts = {"whole": (0, n_frames), "interior": segments.interior(n_frames, frame_s, head_s, tail_s)}
    recorded = {part: _recorded(own, onsets_s, *ends) for part, ends in parts.items()}
    rows = []
    for draw, motion in enumerate(draws):
        if motion.empty:
            continue
        made = measure(motion)
        for part, (low, high) in parts.items():
            common = {**named, "draw": draw, "part": part, "duration_s": (high - low) * frame_s}
            for name, value in _values(made, own, onsets_s, low, high).items():
                rows.append(common | {"measure": name, "value": value, "recorded": recorded[part][name]})
    return pd.DataFrame(rows, columns=[*named, *COLUMNS])


def _values(made: Hands, own: Hands, onsets_s: Floats | None, low: int, high: int) -> dict[str, float]:
    """Return each measure of motion, in the frames ``low`` to ``high``, compared with the recorded motion ``own``."""
    one, other = (hand_speed.smoothed(hands.speed, own.fps)[low:high] for hands in (own, made))
    values = {"hand_speed_r": hand_speed.correlation(one, other)}
    if onsets_s is not None:
        values["beat_alignment"] = beat_alignment.score(onsets_s, made.speed, made.fps, low, high)
    real, like = _features(own, low, high), _features(made, low, high)
    scale = _scale(real)
    return values | {"frechet_distance": frechet.distance(like / scale, real / scale)}


def _recorded(own: Hands, onsets_s: Floats | None, low: int, high: int) -> dict[str, float]:
    """Return what the recorded motion itself reaches; for the Fréchet distance, one half compared with the other."""
    real = _features(own, low, high)
    return _values(own, own, onsets_s, low, high) | {"frechet_distance": frechet.between_halves(real / _scale(real))}


def _features(hands: Hands, low: int, high: int) -> Floats:
    return frechet.features(hands.places[low:high], hands.speed[low:high], hands.fps)


def _scale(real: Floats) -> Floats:
    """Return the standard deviations of the features of the recorded motion; 1 where a feature is constant."""
    deviation = real.std(axis=0) if len(real) else np.ones(real.shape[1])
    return np.where(deviation > 0.0, deviation, 1.0)
