"""Finding and classifying labelled events in recordings by a network of left-to-right HMMs, one for each label."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import mixture_hmm
from cospeech.markov.mixture_hmm import MixtureHMM, Training
from cospeech.markov.word_hmm import Clips


class Segment(NamedTuple):
    """A labelled stretch of a recording: frames [first, end)."""

    recording: str
    first: int
    end: int
    label: str


class Size(NamedTuple):
    """Numbers of states of a model and of Gaussians of each state."""

    states: int
    components: int


class Spotter(NamedTuple):
    """A network: the models of labels, and (M,) the probability that the next event has each label."""

    labels: tuple[str, ...]
    models: tuple[MixtureHMM, ...]
    prior: Floats

    def spot(self, recording: str, frames: Floats) -> list[Segment]:
        """Return the most likely sequence of events in a recording (T, D)."""
        path = mixture_hmm.decode(self.models, self.prior, frames)
        first = np.flatnonzero(path.begins)
        end = [*first[1:].tolist(), len(frames)]
        return [
            Segment(recording, start, stop, self.labels[path.branch[start]])
            for start, stop in zip(first.tolist(), end, strict=True)
        ]

    def classify(self, frames: Floats) -> str:
        """Return the label under which a clip (T, D) is most likely; priors do not count.

        Raises
        ------
        UserError : if the clip has fewer frames than every model has states.
        """
        found = [mixture_hmm.log_likelihood(model, frames) for model in self.models]
        if max(found) == -np.inf:
            raise UserError(f"a clip of {len(frames)} frames is shorter than every model; set fewer states")
        return self.labels[int(np.argmax(found))]


def train(
    recordings: Mapping[str, Floats],
    segments: Sequence[Segment],
    sizes: Mapping[str, Size],
    training: Training,
    rng: np.random.Generator,
) -> Spotter:
    """Return a network of models, each trained on the segments with its label.

    Parameters
    ----------
    recordings : (T, D) frames of each recording.
    segments : training segments.
    sizes : size of the model of each label.

    Raises
    ------
    UserError : if a label has no segment that is long enough.
    """
    lengths = [len(frames) for frames in recordings.values()]
    offset = dict(zip(recordings, np.cumsum([0, *lengths[:-1]]).tolist(), strict=True))
    frames = np.concatenate(list(recordings.values()))
    models, counts = [], []
    for label, size in sizes.items():
        own = [segment for segment in segments if segment.label == label]
        if not any(segment.end - segment.first >= size.states for segment in own):
            raise UserError(
                f"no training segment of '{label}' has {size.states} frames, the number of states of its model; "
                "record more, or set fewer states"
            )
        clips = Clips(
            frames,
            np.array([offset[segment.recording] + segment.first for segment in own]),
            np.array([segment.end - segment.first for segment in own]),
        )
        models.append(training.train(clips, size.states, size.components, rng))
        counts.append(len(own))
    return Spotter(tuple(sizes), tuple(models), np.array(counts) / sum(counts))


def between(recording: str, segments: Iterable[Segment], n_frames: int, shortest: int, label: str) -> list[Segment]:
    """Return what lies between the segments of a recording as further segments, if not shorter than ``shortest``.

    Parameters
    ----------
    segments : of this recording, in order.
    n_frames : length of the recording.
    label : of the stretches between.
    """
    bounds = [(0, 0), *((segment.first, segment.end) for segment in segments), (n_frames, n_frames)]
    return [
        Segment(recording, end, first, label)
        for (_, end), (first, _) in itertools.pairwise(bounds)
        if first - end >= shortest
    ]
