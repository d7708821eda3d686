"""A head that moves as the melody of speech is heard: labels of melody and head, angles, frames of the motion."""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.synthesis.head.features import MELODY_HZ
from cospeech.synthesis.head.generation import N_AXES, Generator, Noise, patterns_of
from cospeech.synthesis.head.model import Model, labeller
from cospeech.synthesis.head.prediction import Labeller, MelodyLabeller
from cospeech.synthesis.live import Stream


class AtFrames:
    """The label that holds at the centre of each frame of the head, of labels at 100 Hz."""

    def __init__(self, fps: float) -> None:
        self._step = MELODY_HZ / fps
        self._heard = self._made = 0

    def hear(self, labels: Integers) -> Integers:
        """Return the labels of the frames of the head whose centres lie in the next labels (T,)."""
        first, self._heard = self._heard, self._heard + len(labels)
        n_due = max(self._made, math.ceil(self._heard / self._step - 0.5 - 1e-9))
        if n_due == self._made:
            return labels[:0]
        centres = np.floor((np.arange(self._made, n_due) + 0.5) * self._step + 1e-9).astype(np.int64)
        self._made = n_due
        return labels[centres - first]


class Resampled:
    """Frames at another rate, interpolated between the centres of the frames that become known."""

    def __init__(self, fps: float, new_fps: float) -> None:
        self._step = fps / new_fps
        self._known, self._n_spent, self._made = np.empty((0, N_AXES)), 0, 0

    def hear(self, frames: Floats) -> Floats:
        """Return the frames (n, 3) that become certain with the next frames (T, 3)."""
        if self._step == 1.0:
            self._known, self._made = frames[-1:] if len(frames) else self._known, self._made + len(frames)
            return frames
        if len(frames) == 0:
            return frames
        self._known = np.concatenate([self._known, frames])
        last = self._n_spent + len(self._known) - 1
        n_due = max(self._made, int(np.floor((last + 0.5) / self._step - 0.5)) + 1)
        found = self._at(n_due)
        spent = max(0, min(len(self._known) - 1, int((n_due + 0.5) * self._step - 0.5) - self._n_spent))
        self._known, self._n_spent = self._known[spent:], self._n_spent + spent
        return found

    def end(self, n_frames: int) -> Floats:
        """Return the frames that are missing of ``n_frames``: the last known one, or 0."""
        if len(self._known) == 0:
            return np.zeros((n_frames, N_AXES))
        if self._step == 1.0:
            return np.repeat(self._known, max(0, n_frames - self._made), axis=0)
        return self._at(n_frames)

    def _at(self, until: int) -> Floats:
        places = (np.arange(self._made, until) + 0.5) * self._step - 0.5 - self._n_spent
        self._made = max(self._made, until)
        known = np.arange(len(self._known))
        return np.column_stack([np.interp(places, known, axis) for axis in self._known.T]).reshape(-1, N_AXES)


class Performer:
    """The state of a live system.

    Parameters
    ----------
    model : the actor's model.
    labeller : what predicts head patterns from melody patterns.
    noise : noise of the filters ``kept``.
    stream, seed : what is known of the speech, and the seed of the run.
    """

    def __init__(self, model: Model, labeller: Labeller, noise: Noise, stream: Stream, seed: int) -> None:
        rng = random_source(seed, "head", stream.record)
        self._melody = MelodyLabeller(model.stage.melody.hmm, model.lags.melody)
        self._at_frames = AtFrames(model.stage.fps)
        self._labeller = labeller
        self._generator = Generator(patterns_of(model.stage.head), model.style, noise, rng)
        self._resampled = Resampled(model.stage.fps, stream.motion_fps)

    def hear(self, melody: Floats) -> Floats:
        """Return the angles (n, 3) in degrees that become certain with the next frames of the melody (T, 3)."""
        spoken = self._at_frames.hear(self._melody.hear(melody))
        if len(spoken) == 0:  # between two frames of the head
            return np.empty((0, N_AXES))
        return self._resampled.hear(self._generator.hear(self._labeller.hear(spoken)))

    def end(self, n_frames: int) -> Floats:
        """Return the angles that are missing of ``n_frames``; the head stays as it is when nothing more is heard."""
        last = self._labeller.hear(self._at_frames.hear(self._melody.end()))
        parts = [self._generator.hear(last), self._generator.hear(self._labeller.end()), self._generator.end()]
        made = [self._resampled.hear(part) for part in parts]
        made.append(self._resampled.end(n_frames))
        return np.concatenate(made)


def begin(model: Model, system: str, stream: Stream, seed: int) -> Performer:
    """Return the state of ``system`` before anything is heard."""
    return Performer(model, labeller(model, system), model.noise[system], stream, seed)
