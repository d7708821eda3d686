"""The most likely label at each share of a record's time, no speech at all: records open at rest, and that alone
fools a score."""

from __future__ import annotations

import numpy as np

from cospeech.data import segments
from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.result import Synthesis, without_model

SYSTEM = System(
    name="clock",
    title="Clock",
    role="control",
    order=30,
)


def synthesise(fold: Fold) -> Synthesis:
    """Return, for every frame, the label that most training records have at the same share of their time.

    Among labels of equally many records the one with most training frames wins, then the first by name.
    """
    share = segments.frame_times(fold.n_frames, fold.n_frames)  # centres of the frames, on a record of length 1
    streams = [segments.to_labels(table) for table in fold.gestures.values()]
    everywhere = np.concatenate(streams)
    labels = sorted(set(everywhere), key=lambda label: (-np.count_nonzero(everywhere == label), label))
    there = np.stack([stream[(share * len(stream)).astype(np.int64)] for stream in streams])
    votes = np.stack([(there == label).sum(axis=0) for label in labels])
    most_likely = np.array(labels, dtype=object)[votes.argmax(axis=0)]  # of equals the first
    table = segments.from_labels(fold.record, most_likely, 1 / fold.frame_s)
    return without_model(fold, table["start_frame"], table["label"])
