"""The worlds of the studio: what speech tells about motion, and how much of it.

Every method of gesture synthesis assumes something about the relation of speech and motion. Each world plants one
such assumption, so that methods can be compared where their own assumption holds and where it does not:

- ``phrases``: each class of gesture phrases prefers certain prosody patterns (Özkul 2012);
- ``vigour``: a hidden state of arousal drives loudness, pitch range and syllable length, and, somewhat earlier, how
  vigorously the hands move; the form of a gesture does not depend on speech (Levine et al. 2010);
- ``syllables``: strokes end at or before the peaks of syllables, and the next subunit of a gesture depends on the
  current one and on the inflection, loudness and length of a syllable (Levine 2009);
- ``patterns``: head gestures are joined with pitch movements over several syllables (Sargin 2006);
- ``all``: the first three at once.

In every world, the head can also be joined with the pitch movements that its speech contains anyway.

The coupling of a part of a world is the share of time in which the body listens: in random spans of a few seconds, it
follows either the speech of its record or that of an independent sample. Its behaviour has the same distribution
whatever the coupling. At coupling 0, it is independent of the speech that is heard.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats

BODY = ("phrases", "vigour", "syllables")
"""The parts of the world ``all``."""

LISTENING_S, LISTENING_SHAPE = 6.0, 4.0
"""Mean duration and shape of the gamma distribution of the spans in which the body listens or not."""


class Couplings(NamedTuple):
    """The coupling of each part of a world, 0 to 1; None where the world does not contain the part."""

    phrases: float | None
    vigour: float | None
    syllables: float | None
    patterns: float | None = None


def couplings(world: str, coupling: float, own: Mapping[str, float], head: float | None = None) -> Couplings:
    """Return the couplings of the parts of a world.

    Parameters
    ----------
    world : one of ``BODY``, ``patterns``, or ``all``.
    coupling : the coupling of every part that is not in ``own``.
    own : couplings of single parts.
    head : coupling of the head in worlds other than ``patterns``, None where it has no patterns.
    """
    phrases, vigour, syllables = (own.get(part, coupling) if world in (part, "all") else None for part in BODY)
    return Couplings(phrases, vigour, syllables, coupling if world == "patterns" else head)


def listening(duration_s: float, coupling: float, rng: np.random.Generator) -> tuple[Floats, Flags]:
    """Return the starts of random spans in seconds, (K,), and whether the body listens in each, (K,).

    The expected share of time in which it listens is ``coupling``.
    """
    expected = int(2.0 * duration_s / LISTENING_S) + 20
    lengths = rng.gamma(LISTENING_SHAPE, LISTENING_S / LISTENING_SHAPE, expected)
    starts = np.append(0.0, np.cumsum(lengths)[:-1])
    return starts, rng.random(expected) < coupling


def listens(times_s: Floats, spans: tuple[Floats, Flags]) -> Flags:
    """Return whether the body listens at each time, (T,), in spans as returned by ``listening``."""
    starts, flags = spans
    row = np.searchsorted(starts, times_s, side="right") - 1
    return np.asarray(flags[np.clip(row, 0, len(flags) - 1)])
