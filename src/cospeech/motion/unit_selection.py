"""Unit selection: the recorded gesture that is played for each synthesised phrase (Özkul 2012, chapter 6).

Every gesture phrase of the training records is a template of its class. The cost of a template is the difference
between its duration and that of the phrase in seconds (6.1), and the jump of the joint angles from the preceding
template in radians (6.2), weighted by alpha (6.3). The sequence of templates with the least total cost is found with
the Viterbi algorithm below equation 6.3; as printed there, the duration penalty of the first phrase is not weighted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.motion import skeleton


@dataclass(frozen=True)
class Templates:
    """The K gesture phrases of the training records that can be played.

    Attributes
    ----------
    table : one row per template: record, segment, label, first_frame and end_frame in its motion, duration_s.
    begin, end : (K, 12) angles of the arm joints in radians in its first and last frame.
    """

    table: pd.DataFrame
    begin: Floats
    end: Floats


class Choice(NamedTuple):
    """A sequence of L templates: indices, penalties (no continuity penalty for the first: NaN), and total cost."""

    template: Integers
    duration_penalty: Floats
    continuity_penalty: Floats
    cost: float


def frame_spans(phrases: pd.DataFrame, n_frames: int, fps: float) -> tuple[Integers, Integers]:
    """Return the first frame of every phrase and the one after its last, (L,) each, on a grid of motion frames.

    A frame belongs to the phrase that contains its centre. For a phrase that contains none, the two are equal.
    """
    owner = segments.at_times(phrases, segments.frame_times(n_frames, fps))
    rows = np.arange(len(phrases))
    return np.searchsorted(owner, rows, side="left"), np.searchsorted(owner, rows, side="right")


def templates(gestures: pd.DataFrame, motions: Mapping[str, pd.DataFrame]) -> Templates:
    """Return the templates of the gesture phrases of the training records.

    Parameters
    ----------
    gestures : segment table of the training records only.
    motions : motion table of each of these records.

    Raises
    ------
    UserError : if a record has no motion, or no phrase contains a frame.
    """
    parts, begins, ends = [], [], []
    for record, rows in gestures.groupby("record", sort=True):
        if record not in motions:
            raise UserError(f"gesture segments name '{record}', which has no motion among the training records")
        motion = motions[str(record)]
        first, end = frame_spans(rows, len(motion), skeleton.frame_rate(motion))
        shown = np.flatnonzero(first < end)
        pose = np.radians(skeleton.angles(motion, skeleton.ARM_JOINTS).reshape(len(motion), -1))
        part = rows.iloc[shown][["record", "segment", "label"]].copy()
        part["first_frame"], part["end_frame"] = first[shown], end[shown]
        part["duration_s"] = (rows["end_s"] - rows["start_s"]).to_numpy()[shown]
        parts.append(part)
        begins.append(pose[first[shown]])
        ends.append(pose[end[shown] - 1])
    if not any(len(part) for part in parts):
        raise UserError("no gesture phrase of the training records holds a motion frame; check their segments")
    return Templates(pd.concat(parts, ignore_index=True), np.concatenate(begins), np.concatenate(ends))


def jumps(ends: Floats, begins: Floats) -> Floats:
    """Return the continuity penalties (6.2) from end poses (J, D) to begin poses (K, D), as (J, K).

    The penalty is the norm of the difference of the joint angles in radians, with each difference in [-pi, pi].
    """
    squares = np.zeros((len(ends), len(begins)))
    for end, begin in zip(ends.T, begins.T, strict=True):
        difference = begin[None, :] - end[:, None]
        squares += (difference - 2 * np.pi * np.round(difference / (2 * np.pi))) ** 2
    return np.sqrt(squares)


def cheapest_path(
    candidates: Sequence[Integers],
    penalties: Sequence[Floats],
    jump: Callable[[Integers, Integers], Floats],
    weight: float,
) -> Choice:
    """Return the sequence of templates with the least accumulated penalty, by steps i to iv below equation 6.3.

    Parameters
    ----------
    candidates : for each of L phrases, the indices (K_l,) of the templates of its class.
    penalties : for each phrase, the duration penalties (K_l,) of these templates in seconds.
    jump : returns the continuity penalties (J, K) in radians from each of J templates to each of K.
    weight : alpha, the weight of continuity.
    """
    value = penalties[0]
    came_from: list[Integers] = []
    for before, here, penalty in zip(candidates, candidates[1:], penalties[1:], strict=False):
        reached = value[:, None] + weight * jump(before, here)
        came_from.append(np.argmin(reached, axis=0))
        value = reached[came_from[-1], np.arange(len(here))] + (1 - weight) * penalty
    best = int(np.argmin(value))
    cost = float(value[best])
    choice = [best]
    for pointers in reversed(came_from):
        choice.append(int(pointers[choice[-1]]))
    choice.reverse()
    path = np.array([options[k] for options, k in zip(candidates, choice, strict=True)], dtype=np.int64)
    return Choice(
        path,
        np.array([penalty[k] for penalty, k in zip(penalties, choice, strict=True)]),
        np.array([np.nan, *(jump(path[[k]], path[[k + 1]])[0, 0] for k in range(len(path) - 1))]),
        cost,
    )


def select(phrases: pd.DataFrame, pool: Templates, n_frames: int, fps: float, weight: float) -> pd.DataFrame:
    """Return the unit of every synthesised phrase as a table of schema ``units``.

    Phrases that contain no motion frame need no template, and phrases of a class that is absent from the training
    records have none: their template and penalties are null, and the units before and after them are consecutive.

    Parameters
    ----------
    phrases : segment table of the synthesised record.
    pool : templates of the training records.
    n_frames, fps : grid of the motion frames that the phrases are to fill.
    weight : alpha of equation 6.3.

    Raises
    ------
    UserError : if no phrase has a template.
    """
    first, end = frame_spans(phrases, n_frames, fps)
    labels = phrases["label"].to_numpy(dtype=object)
    durations = (phrases["end_s"] - phrases["start_s"]).to_numpy(dtype=float)
    shown_classes = pool.table["label"].to_numpy(dtype=object)
    of_class = {label: np.flatnonzero(shown_classes == label) for label in set(labels)}
    shown = [row for row in range(len(phrases)) if first[row] < end[row] and len(of_class[labels[row]])]
    if not shown:
        raise UserError(f"'{phrases['record'].iloc[0]}': no gesture of its phrases occurs in the training records")
    template_s = pool.table["duration_s"].to_numpy()
    candidates = [of_class[labels[row]] for row in shown]
    penalties = [np.abs(durations[row] - template_s[of_class[labels[row]]]) for row in shown]
    path = cheapest_path(candidates, penalties, lambda j, k: jumps(pool.end[j], pool.begin[k]), weight)

    units = pd.DataFrame({"segment": phrases["segment"].to_numpy(), "label": labels})
    units["template_record"] = pd.Series(None, index=units.index, dtype=object)
    units["template_segment"] = pd.Series(pd.NA, index=units.index, dtype="Int64")
    units.loc[shown, "template_record"] = pool.table["record"].to_numpy()[path.template]
    units.loc[shown, "template_segment"] = pool.table["segment"].to_numpy()[path.template]
    for name, penalty in zip(("duration_penalty", "continuity_penalty"), path[1:3], strict=True):
        units[name] = np.nan
        units.loc[shown, name] = penalty
    units["start_frame"], units["end_frame"] = first, end
    return units


def summary(units: pd.DataFrame, weight: float) -> str:
    """Return one line about a table of units: their number, accumulated penalty (6.3), and phrases without one."""
    shown = units[units["template_record"].notna()]
    duration, continuity = shown["duration_penalty"].to_numpy(), shown["continuity_penalty"].to_numpy()
    total = duration[0] + np.sum(weight * continuity[1:] + (1 - weight) * duration[1:])
    line = f"{len(shown)} units at a total penalty of {total:.6f}"
    short = int((units["start_frame"] == units["end_frame"]).sum())
    if short:
        line += f"; {short} phrases are too short for a motion frame"
    unseen = units.loc[units["template_record"].isna() & (units["start_frame"] < units["end_frame"]), "label"]
    if len(unseen):
        line += f"; bridged, as no training record shows their class: {', '.join(unseen)}"
    return line
