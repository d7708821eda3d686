"""The script: the gesture phrases and intonation phrases of every record.

Gesture phrases are a semi-Markov process; the last one is cut off by the end of the record. Speech is a sequence of
intonation phrases whose durations have the same distribution for all patterns. With probability ``coupling`` a
gesture phrase is coupled: its speech starts with it, samples patterns from the distribution of the gesture, and is
cut off with it. During each run of uncoupled gesture phrases between coupled ones, speech samples its patterns from
the marginal distribution and ignores gesture boundaries. As durations are independent of the pattern, every frame of
gesture i has pattern p with probability exactly (1 - coupling) m(p) + coupling b_i(p); at coupling 0 the two
processes are independent, including their boundaries.

Both processes are defined on the grid of prosody frames, so that the planted durations are exact bins of the
semi-Markov model. Gesture phrases are therefore given in prosody frames, not in motion frames.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.studio.cast import Member
from cospeech.studio.patterns import NAMES

INTONATION_S = (0.4, 1.6)
"""Shortest and longest intonation phrase; all durations on the grid between them are equally likely."""

CLEAR_S = 1.0
"""Minimum duration of a phrase that is a clear example of its class."""


class Sample(NamedTuple):
    """The sampled script of one record.

    First frames and classes of gesture phrases and whether each is coupled, (L,); first frames and patterns of
    intonation phrases, (K,).
    """

    gesture_starts: Integers
    gestures: Integers
    coupled: npt.NDArray[np.bool_]
    prosody_starts: Integers
    patterns: Integers


def sample(member: Member, record: str, n_frames: int, coupling: float, frame_s: float, seed: int) -> Sample:
    """Return a random script of one record of ``n_frames`` prosody frames; gestures do not depend on ``coupling``."""
    starts, labels = gesture_process(member, n_frames, random_source(seed, "gestures", record))
    rng = random_source(seed, "speech", record)
    coupled = rng.random(len(starts)) < coupling
    first, patterns = prosody_process(member, starts, labels, coupled, n_frames, frame_s, rng)
    return Sample(starts, labels, coupled, first, patterns)


def write(
    member: Member, record: str, duration_s: float, coupling: float, frame_s: float, seed: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the script of one record: the segment tables of its gestures and of its prosody."""
    n_frames = round(duration_s / frame_s)
    drawn = sample(member, record, n_frames, coupling, frame_s, seed)
    gestures, patterns = (
        np.array(GESTURES, dtype=object)[drawn.gestures],
        np.array(NAMES, dtype=object)[drawn.patterns],
    )
    return (
        segments.from_starts(record, drawn.gesture_starts, gestures, n_frames, 1.0 / frame_s),
        segments.from_starts(record, drawn.prosody_starts, patterns, n_frames, 1.0 / frame_s),
    )


def gesture_process(member: Member, n_frames: int, rng: np.random.Generator) -> tuple[Integers, Integers]:
    """Sample gesture phrases that cover ``n_frames`` frames; return their first frames (L,) and classes (L,)."""
    rows = _cumulative(np.vstack([member.initial, member.transitions]))
    lasting = _cumulative(member.durations)
    starts, labels = [], []
    frame, row = 0, 0
    while frame < n_frames:
        label = _pick(rows[row], rng)
        starts.append(frame)
        labels.append(label)
        frame += 1 + _pick(lasting[label], rng)
        row = 1 + label
    return np.array(starts), np.array(labels)


def prosody_process(
    member: Member,
    starts: Integers,
    labels: Integers,
    coupled: npt.NDArray[np.bool_],
    n_frames: int,
    frame_s: float,
    rng: np.random.Generator,
) -> tuple[Integers, Integers]:
    """Sample intonation phrases that cover ``n_frames`` frames; return their first frames (K,) and patterns (K,)."""
    shortest, longest = (round(limit / frame_s) for limit in INTONATION_S)
    own, marginal = _cumulative(member.coupled), _cumulative(member.marginal())
    opens = coupled | np.append(True, coupled[:-1])  # a coupled phrase, or the first of a run of uncoupled ones
    blocks = np.flatnonzero(opens)
    ends = np.append(starts[blocks[1:]], n_frames)
    first, patterns = [], []
    for block, end in zip(blocks, ends, strict=True):
        law = own[labels[block]] if coupled[block] else marginal
        frame = int(starts[block])
        while frame < end:
            first.append(frame)
            patterns.append(_pick(law, rng))
            frame += int(rng.integers(shortest, longest + 1))
    return np.array(first), np.array(patterns)


def _cumulative(probability: Floats) -> Floats:
    """Return the cumulative distribution, normalised so that it ends at exactly 1."""
    total = np.cumsum(probability, axis=-1)
    return total / total[..., -1:]


def _pick(distribution: Floats, rng: np.random.Generator) -> int:
    return int(np.searchsorted(distribution, rng.random(), side="right"))


def examples(gestures: pd.DataFrame, count: int, rng: np.random.Generator) -> pd.DataFrame:
    """Return up to ``count`` annotated examples of each class from the records of one actor.

    Examples are complete phrases, never the last one of a record, which is cut off; clear ones are preferred to short
    ones. They are taken from the records in turn, so that a fold that leaves out a record keeps examples of each
    class.

    Parameters
    ----------
    gestures : the segment tables of all records of the actor.
    """
    whole = gestures[gestures["record"].eq(gestures["record"].shift(-1))]
    order = rng.permutation(len(whole))
    shuffled = whole.iloc[order].assign(short=lambda t: t["end_s"] - t["start_s"] < CLEAR_S)
    shuffled = shuffled.sort_values(["label", "short"], kind="stable")
    turn = shuffled.groupby(["label", "record"], sort=False).cumcount()
    chosen = shuffled.assign(turn=turn).sort_values(["label", "turn"], kind="stable").groupby("label").head(count)
    chosen = chosen.sort_values(["record", "start_s"])
    return (
        chosen[["record", "start_s", "end_s"]].assign(gesture=chosen["label"], origin="studio").reset_index(drop=True)
    )
