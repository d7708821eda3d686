"""Gesture subunits that follow syllables: head, arms and legs each form a stream of their own (Levine 2009,
4.2-4.3).

At each syllable peak, the syllable before it is known. The current subunit i then goes on with the probability
f_i(tau) = 1 / (1 + exp(a_i (tau - b_i))), where tau is the share of its duration that has elapsed. Otherwise the next
subunit j begins, with a probability proportional to T_ij times the weights that j gives to the inflection, loudness
and length of the syllable. A stroke that the next subunit interrupts ends just before the syllable peak at which that
one begins; one that is not interrupted ends earlier, and the section is still until then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.studio.syllables import FEATURES

BEATS = ("hold", "small", "large", "sideways")
"""Subunits of the arms where the class of a gesture has causes of its own; elsewhere it is the subunit."""

KINDS = {
    "head": ("front", "down", "left", "right", "tilted"),
    "arms": GESTURES,
    "legs": ("centre", "left", "right"),
}

FIRST = {"head": "front", "arms": "rest", "legs": "centre"}
"""The subunit with which a record starts; for beats, it is ``hold``."""

NOMINAL_S = {"head": (0.32, 0.5), "arms": (0.45, 0.75), "legs": (0.8, 1.3)}
SLOPE = (7.0, 11.0)
MIDDLE = (0.7, 1.0)
"""Ranges of the duration of subunits and of the parameters of f, the same for all sections."""

PREFERRED, OTHERWISE = 5.0, 1.0
"""Weights of the preferred level of a feature and of the other levels."""

REPEATS = 0.12
"""Probability that a subunit follows itself, before the weights of the syllable."""

LEAD_S = 0.04
"""Longest time by which an interrupted stroke ends before the syllable peak."""


@dataclass(frozen=True)
class Stream:
    """The planted stream of one section of an actor's body, with K kinds of subunits.

    Attributes
    ----------
    kinds : (K,) names.
    nominal_s, slope, middle : (K,) durations, and parameters a and b of f.
    transitions : (K, K) matrix T.
    weights : (3, K, 3) weight of each feature by kind and level, in the order of ``FEATURES``.
    first : index of the kind with which a record starts.
    """

    kinds: tuple[str, ...]
    nominal_s: Floats
    slope: Floats
    middle: Floats
    transitions: Floats
    weights: Floats
    first: int

    def goes_on(self, kind: int, elapsed: float) -> float:
        """Return f of a kind of subunit at the elapsed share of its duration."""
        return 1.0 / (1.0 + math.exp(min(self.slope[kind] * (elapsed - self.middle[kind]), 700.0)))

    def following(self) -> Floats:
        """Return the probability of the next kind given the current one and the levels of a syllable's features.

        The array (3, 3, 3, K, K) has the levels of inflection, loudness and length, the current kind, and the next.
        """
        one, two, three = (np.moveaxis(self.weights[feature], 0, 1) for feature in range(3))
        liking = one[:, None, None] * two[None, :, None] * three[None, None, :]
        joint = self.transitions * liking[..., None, :]
        return np.asarray(joint / joint.sum(axis=-1, keepdims=True))


def streams(actor: str, world: str, seed: int) -> dict[str, Stream]:
    """Return the streams of ``actor`` by section, sampled from the seed and the actor's name."""
    names = KINDS | ({"arms": BEATS} if world == "all" else {})
    return {
        section: _law(section, kinds, random_source(seed, "subunits", actor, section))
        for section, kinds in names.items()
    }


def _law(section: str, kinds: tuple[str, ...], rng: np.random.Generator) -> Stream:
    n = len(kinds)
    transitions = rng.dirichlet(np.full(n, 6.0), n)
    np.fill_diagonal(transitions, 0.0)
    transitions *= (1.0 - REPEATS) / transitions.sum(axis=1, keepdims=True)
    np.fill_diagonal(transitions, REPEATS)
    number = rng.permutation(n)
    preferred = np.array([number, number // 3, number + number // 3]) % 3
    orders = np.array([rng.permutation(3) for _ in FEATURES])
    weights = np.full((len(FEATURES), n, 3), OTHERWISE)
    for feature in range(len(FEATURES)):
        weights[feature, np.arange(n), orders[feature][preferred[feature]]] = PREFERRED
    return Stream(
        kinds=kinds,
        nominal_s=rng.uniform(*NOMINAL_S[section], n),
        slope=rng.uniform(*SLOPE, n),
        middle=rng.uniform(*MIDDLE, n),
        transitions=transitions,
        weights=weights,
        first=kinds.index(FIRST[section]) if FIRST[section] in kinds else 0,
    )


def follow(stream: Stream, heard: pd.DataFrame, duration_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return the random subunits of one section that follow the syllables of a record.

    Parameters
    ----------
    heard : the syllables in order of time: peak_s, and the level of each of ``FEATURES``.
    duration_s : duration of the record.

    Returns
    -------
    A table with the columns start_s, stroke_end_s, end_s, subunit and nominal_s, and the levels of the syllable that
    each subunit depends on, which are null in the first one.
    """
    likely = np.cumsum(stream.following(), axis=-1)
    levels = np.array([[FEATURES[name].index(level) for level in heard[name]] for name in FEATURES], dtype=int).T
    peaks_s = heard["peak_s"].tolist()
    rows: list[dict[str, Any]] = []
    kind, start, cause = stream.first, 0.0, -1
    for known, now in enumerate(peaks_s[1:]):
        elapsed = (now - start) / stream.nominal_s[kind]
        if rng.random() < stream.goes_on(kind, elapsed):
            continue
        end = now - rng.uniform(0.0, LEAD_S)
        rows.append(_row(stream, kind, start, min(start + stream.nominal_s[kind], end), now, cause))
        distribution = likely[tuple(levels[known])][kind]
        kind = int(np.searchsorted(distribution, rng.random() * distribution[-1], side="right"))
        start, cause = now, known
    rows.append(_row(stream, kind, start, min(start + stream.nominal_s[kind], duration_s), duration_s, cause))
    table = pd.DataFrame(rows)
    causes = table.pop("cause").to_numpy()
    for name in FEATURES:
        table[name] = heard[name].to_numpy(dtype=object)[causes] if len(heard) else None
    table.loc[causes < 0, list(FEATURES)] = None
    return table


def _row(stream: Stream, kind: int, start_s: float, stroke_end_s: float, end_s: float, cause: int) -> dict[str, Any]:
    return {
        "start_s": start_s,
        "stroke_end_s": stroke_end_s,
        "end_s": end_s,
        "subunit": stream.kinds[kind],
        "nominal_s": stream.nominal_s[kind],
        "cause": cause,
    }


def write(own: dict[str, Stream], record: str, heard: pd.DataFrame, duration_s: float, seed: int) -> pd.DataFrame:
    """Return the subunits of all sections in one record (schema ``planted_subunits``)."""
    tables = []
    for section, stream in own.items():
        table = follow(stream, heard, duration_s, random_source(seed, "subunits of record", record, section))
        numbered = table.assign(record=record, section=section, segment=np.arange(len(table)))
        tables.append(numbered[["record", "section", "segment", *table.columns]])
    return pd.concat(tables, ignore_index=True)


def phrases(record: str, arms: pd.DataFrame, n_frames: int, frame_s: float) -> pd.DataFrame:
    """Return the gesture phrases that subunits of the arms form, as a segment table on prosody frames.

    Successive subunits of the same kind are beats of one phrase.

    Parameters
    ----------
    arms : the subunits of the arms in the record, whose kinds are classes of gestures.
    """
    labels = arms["subunit"].to_numpy(dtype=object)
    first = np.append(True, labels[1:] != labels[:-1])
    starts = np.round(arms["start_s"].to_numpy()[first] / frame_s).astype(np.int64)
    lasts = np.diff(np.append(starts, n_frames)) > 0
    return segments.from_starts(record, starts[lasts], labels[first][lasts], n_frames, 1.0 / frame_s)


def tables(cast: dict[str, dict[str, Stream]]) -> dict[str, pd.DataFrame]:
    """Return the planted streams of all actors: subunit_kinds, subunit_transitions and subunit_preferences."""
    kinds, transitions, preferences = [], [], []
    for actor, sections in cast.items():
        for section, stream in sections.items():
            named = {"actor": actor, "section": section}
            parameters = {"nominal_s": stream.nominal_s, "slope": stream.slope, "middle": stream.middle}
            kinds.append(pd.DataFrame(named | {"subunit": stream.kinds} | parameters))
            n = len(stream.kinds)
            pairs = {"from_subunit": np.repeat(stream.kinds, n), "to_subunit": np.tile(stream.kinds, n)}
            transitions.append(pd.DataFrame(named | pairs | {"probability": stream.transitions.ravel()}))
            for feature, (name, levels) in enumerate(FEATURES.items()):
                cells = {"subunit": np.repeat(stream.kinds, 3), "feature": name, "level": np.tile(levels, n)}
                preferences.append(pd.DataFrame(named | cells | {"weight": stream.weights[feature].ravel()}))
    return {
        "subunit_kinds": pd.concat(kinds, ignore_index=True),
        "subunit_transitions": pd.concat(transitions, ignore_index=True),
        "subunit_preferences": pd.concat(preferences, ignore_index=True),
    }
