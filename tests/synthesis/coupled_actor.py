"""An actor with planted gestures and speech, and a knob for how much the speech tells about the gestures."""

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.vocabulary import GESTURES, prosody_labels
from cospeech.markov import hsmm

FRAME_S = 0.025
CLUSTERS = 8
PATTERNS = np.array(prosody_labels(CLUSTERS), dtype=object)
INTONATION_S = (0.4, 1.5)


class CoupledActor:
    """Gestures: a semi-Markov process of seven classes. Speech: intonation phrases of eight patterns."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n = len(GESTURES)
        self.initial = rng.dirichlet(np.ones(n))
        self.transitions = rng.dirichlet(np.full(n, 0.8), n)
        self.mean_s = rng.uniform(0.8, 3.0, n)
        self.own_patterns = rng.dirichlet(np.full(CLUSTERS, 0.5), n)
        self.patterns = rng.dirichlet(np.full(CLUSTERS, 3.0))

    def gestures(self, rng, n_frames):
        """First frames and classes of the gesture phrases, each at least 0.2 s and mostly 0.5 to 6 s long."""
        starts, classes = [], []
        frame, probability = 0, self.initial
        while frame < n_frames:
            classes.append(rng.choice(len(probability), p=probability))
            starts.append(frame)
            frame += max(8, round(rng.gamma(6, self.mean_s[classes[-1]] / 6) / FRAME_S))
            probability = self.transitions[classes[-1]]
        return np.array(starts), np.array(classes)

    def speech(self, rng, n_frames, probability):
        """The pattern of every frame of a process of intonation phrases."""
        shortest, longest = (round(limit / FRAME_S) for limit in INTONATION_S)
        lengths = rng.integers(shortest, longest + 1, size=n_frames // shortest + 1)
        return np.repeat(rng.choice(CLUSTERS, p=probability, size=len(lengths)), lengths)[:n_frames]

    def record(self, name, seed, duration_s, coupling):
        """Segment tables of gestures and prosody of one record, drawn from the whole numbers ``seed``.

        A gesture phrase is coupled with probability ``coupling``: then its speech starts and ends with it, and draws
        the patterns of the gesture. During all other phrases the speech is independent of the gestures.
        """
        n_frames = round(duration_s / FRAME_S)
        starts, classes = self.gestures(np.random.default_rng([*seed, 1]), n_frames)
        rng = np.random.default_rng([*seed, 2])
        spoken = self.speech(rng, n_frames, self.patterns)
        for start, end, gesture in zip(starts, np.append(starts[1:], n_frames), classes, strict=True):
            if rng.random() < coupling:
                spoken[start:end] = self.speech(rng, end - start, self.own_patterns[gesture])
        labels = np.array(GESTURES, dtype=object)[classes]
        return (
            segments.from_starts(name, starts, labels, n_frames, 1 / FRAME_S),
            segments.from_labels(name, PATTERNS[spoken], 1 / FRAME_S),
        )

    def process(self, coupling):
        """The planted process as a semi-Markov model; its durations are approximate."""
        durations_s = np.arange(1, 401) * FRAME_S
        planted = hsmm.HSMM(
            GESTURES,
            tuple(PATTERNS),
            self.initial,
            self.transitions,
            (1 - coupling) * self.patterns + coupling * self.own_patterns,
            np.exp(-0.5 * ((durations_s - self.mean_s[:, None]) / 0.5) ** 2),
        )
        return hsmm.floored(planted, 0.0)


def corpus(seed, n_records, duration_s, coupling):
    """Gesture and prosody segments of all records of one actor, r0, r1, ..., on the prosody frame."""
    actor = CoupledActor(seed)
    records = [actor.record(f"r{r}", [seed, r], duration_s, coupling) for r in range(n_records)]
    gestures, prosody = zip(*records, strict=True)
    return pd.concat(gestures, ignore_index=True), pd.concat(prosody, ignore_index=True)
