"""Clips for perception studies: the same seconds of a record by each version of its motion, without labels.

The comparisons of Levine et al. 2010 (figure 5) and Levine 2009 (figure 6.2) show viewers the same utterance in two
or three versions, which they must not recognise by anything but the motion. A clip therefore shows no title, no
gesture classes and no name of the record. Clips begin and end where a gesture phrase of the recorded motion begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.motion import skeleton
from cospeech.rendering.video import Panel

SHORTEST_S, LONGEST_S = 8.0, 12.0


class Span(NamedTuple):
    """The part of a record that a clip shows, in seconds."""

    start_s: float
    end_s: float


def spans(boundaries_s: Floats, duration_s: float) -> list[Span]:
    """Return the clips of a record, each of which begins where the one before it ends.

    A clip ends at the boundary that makes it most nearly as long as the middle of the permitted range; if no boundary
    lies in the range, it is as long as permitted. What is left at the end is not shown if it is too short.

    Parameters
    ----------
    boundaries_s : times at which phrases begin, in ascending order.
    duration_s : duration of the record.
    """
    ends_s = np.append(boundaries_s, duration_s)
    found: list[Span] = []
    start_s = 0.0
    while duration_s - start_s >= SHORTEST_S:
        lengths = ends_s - start_s
        possible = lengths[(lengths >= SHORTEST_S) & (lengths <= LONGEST_S)]
        middle = 0.5 * (SHORTEST_S + LONGEST_S)
        length_s = float(possible[np.abs(possible - middle).argmin()]) if len(possible) else LONGEST_S
        found.append(Span(start_s, start_s + length_s))
        start_s += length_s
    return found


def cut(motion: pd.DataFrame, phrases: pd.DataFrame, span: Span) -> Panel:
    """Return the part of a motion as an unlabelled panel; ``phrases`` is any table of segments."""
    fps = skeleton.frame_rate(motion)
    first, end = round(span.start_s * fps), round(span.end_s * fps)
    part = motion.iloc[first:end].reset_index(drop=True)
    part["frame"] = np.arange(len(part))
    part["time_s"] = (part["frame"] + 0.5) / fps
    return Panel("", part, phrases.iloc[:0])


def table(record: str, found: Sequence[Span], versions: Sequence[str]) -> pd.DataFrame:
    """Return the table ``survey_clips`` of a record: one row per clip and version, with the name of its file."""
    rows = [
        {"record": record, "clip": number, "version": version, "start_s": span.start_s, "end_s": span.end_s}
        | {"file": f"{number}~{version}.mp4"}
        for number, span in enumerate(found)
        for version in versions
    ]
    return pd.DataFrame(rows, columns=["record", "clip", "version", "start_s", "end_s", "file"])
