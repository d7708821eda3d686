"""The planted prosody patterns: pitch and intensity contours of one intonation phrase.

Pitch is in semitones re the speaker's base pitch, intensity in decibels re the speaker's level, both over the
relative time u in [0, 1] of the phrase. The forms are those that studies of intonation distinguish: level tones of
two heights, a soft rise, a strong fall, a rise-fall, an emphatic accent, and the low soft voice of an aside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cospeech.data.arrays import Floats


@dataclass(frozen=True)
class Pattern:
    """One pattern: knots of the pitch and intensity contours, evenly spaced over the phrase; a pause has none."""

    name: str
    meaning: str
    pitch_st: tuple[float, ...] = ()
    intensity_db: tuple[float, ...] = ()

    @property
    def speaks(self) -> bool:
        """Whether the pattern is speech and not a pause."""
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
    """Return the smooth contour through the knots ``corners`` at relative times ``u`` in [0, 1].

    Interpolation is by half cosines, so that the contour is flat at each knot, as spoken tones are.
    """
    if len(corners) == 1:
        return np.full_like(u, corners[0])
    place = np.clip(u, 0.0, 1.0) * (len(corners) - 1)
    left = np.minimum(place.astype(int), len(corners) - 2)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - left))
    values = np.asarray(corners)
    return values[left] + (values[left + 1] - values[left]) * share
