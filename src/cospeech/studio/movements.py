"""Pitch movements over several syllables, which head gestures are joined with (Sargin 2006, 4.4.2).

A movement is an intonation phrase whose contour shares no part with another one: a rise, a fall, a high level, a high
accent or a low level. In the world ``patterns``, all speech consists of movements that begin and end between
syllables, and each speaker has habits about which one follows which. In the other worlds, two patterns of intonation
phrases, a rise-fall and a soft aside, are no movements.
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.studio.patterns import NAMES, PAUSE
from cospeech.studio.syllables import stretches

CONTOURS = {"r1": "p4", "r2": "p5", "r3": "p3", "r4": "p7", "r5": "p2"}
"""The prosody pattern whose contour each movement has."""

NONE = "none"
"""The label of pauses, and of intonation phrases that are no movement."""

FEWEST, MOST = 3, 6
"""Range of the number of syllables of a movement; all numbers in it are equally likely."""

ACCENTS = 0.2
"""Factor of the inflections and the loudness of syllables within movements."""

TASTE = 3.0
"""Concentration of the Dirichlet distribution of the next movement; a movement does not follow itself."""


def habits(actor: str, seed: int) -> Floats:
    """Return the probability of the next movement given the current one, (K, K), of ``actor``."""
    n = len(CONTOURS)
    rows = random_source(seed, "movements", actor).dirichlet(np.full(n, TASTE), n)
    np.fill_diagonal(rows, 0.0)
    return np.asarray(rows / rows.sum(axis=1, keepdims=True))


def write(
    prosody: pd.DataFrame, syllables: pd.DataFrame, following: Floats, frame_s: float, rng: np.random.Generator
) -> pd.DataFrame:
    """Return the intonation phrases of a record whose speech consists of movements, as a segment table.

    Parameters
    ----------
    prosody : intonation phrases, of which the pauses are kept.
    syllables : the syllables of the speech between them (see ``syllables.sample``).
    following : (K, K) probability of the next movement given the current one; see ``habits``.
    frame_s : spacing of prosody frames, to which the edges of movements are rounded.
    """
    names = list(CONTOURS.values())
    n_frames = int(prosody["end_frame"].iloc[-1])
    labels = np.full(n_frames, NAMES[PAUSE], dtype=object)
    begins = np.zeros(n_frames, dtype=bool)
    likely = np.cumsum(following, axis=1)
    movement = int(rng.integers(len(names)))
    start_s = syllables["start_s"].to_numpy()
    for begin_s, end_s in stretches(prosody):
        own_s = start_s[(start_s >= begin_s - 1e-9) & (start_s < end_s)]
        edges_s = np.append(own_s[_groups(len(own_s), rng)], end_s)
        edges = np.round(edges_s / frame_s).astype(int)
        for first, end in itertools.pairwise(edges):
            movement = int(np.searchsorted(likely[movement], rng.random() * likely[movement, -1], side="right"))
            labels[first:end], begins[first] = names[movement], True
    return segments.from_labels(str(prosody["record"].iloc[0]), labels, 1.0 / frame_s, begins)


def _groups(n_syllables: int, rng: np.random.Generator) -> list[int]:
    """Return the first syllable of each movement in a stretch of speech; the last one takes a short remainder."""
    firsts, first = [0], 0
    while (first := first + int(rng.integers(FEWEST, MOST + 1))) <= n_syllables - FEWEST:
        firsts.append(first)
    return firsts


def of_phrases(prosody: pd.DataFrame) -> pd.DataFrame:
    """Return the movements of a record as a segment table with the labels of ``CONTOURS`` and ``NONE``.

    Parameters
    ----------
    prosody : its intonation phrases. Successive ones that are no movement are one segment.
    """
    names = {pattern: movement for movement, pattern in CONTOURS.items()}
    labels = prosody["label"].map(names).fillna(NONE).to_numpy(dtype=object)
    kept = np.append(True, (labels[1:] != NONE) | (labels[:-1] != NONE))
    starts = prosody["start_frame"].to_numpy()[kept]
    n_frames = int(prosody["end_frame"].iloc[-1])
    fps = n_frames / float(prosody["end_s"].iloc[-1])
    return segments.from_starts(str(prosody["record"].iloc[0]), starts, labels[kept], n_frames, fps)
