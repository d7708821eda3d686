"""The planted prosody patterns: what the voice does in one intonation phrase.

Pitch is counted in semitones from the speaker's own base, intensity in decibels from the speaker's own level, both
over the phrase's relative time u in [0, 1]. The forms are those that studies of intonation tell apart: level tones of
two heights, a soft rise, a strong fall, rise-fall, an emphatic accent, and the low soft voice of an aside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cospeech.data.arrays import Floats


@dataclass(frozen=True)
class Pattern:
    """One pattern: corner values of pitch and intensity, evenly spaced over the phrase; a pause has none."""

    name: str
    meaning: str
    pitch_st: tuple[float, ...] = ()
    intensity_db: tuple[float, ...] = ()

    @property
    def speaks(self) -> bool:
        """Whether there is a voice in it."""
        return bool(self.pitch_st)


PATTERNS = (
    Pattern("p1", "pause"),
    Pattern("p2", "low level", (-4.0, -5.0), (0.5, -0.5)),
    Pattern("p3", "high level", (5.0, 4.0), (-0.5, -1.5)),
    Pattern("p4", "soft rise", (-1.0, 1.0, 7.0), (-9.0, -8.0, -6.0)),
    Pattern("p5", "strong fall", (6.0, 1.0, -5.0), (6.0, 5.0, 2.0)),
    Pattern("p6", "rise-fall", (-4.0, 5.0, -4.0), (-3.0, 1.0, -3.0)),
    Pattern("p7", "loud high accent", (8.0, 9.0, 8.0), (8.0, 9.0, 8.0)),
    Pattern("p8", "soft low aside", (-6.0, -6.5), (-13.0, -14.0)),
)
NAMES = tuple(pattern.name for pattern in PATTERNS)
PAUSE = NAMES.index("p1")


def contour(corners: tuple[float, ...], u: Floats) -> Floats:
    """Return the values at relative times ``u`` in [0, 1] of the smooth line through the corners.

    Between two corners the line runs as a half cosine, so that it is flat at each corner, as spoken tones are.
    """
    if len(corners) == 1:
        return np.full_like(u, corners[0])
    place = np.clip(u, 0.0, 1.0) * (len(corners) - 1)
    left = np.minimum(place.astype(int), len(corners) - 2)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - left))
    values = np.asarray(corners)
    return values[left] + (values[left + 1] - values[left]) * share
