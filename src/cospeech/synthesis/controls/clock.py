"""The most likely label at each share of a record's time, without speech.

Records begin at rest, and that alone can raise a score.
"""

from __future__ import annotations

import numpy as np

from cospeech.data import segments
from cospeech.synthesis.controls.pool import Pool, from_tables, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis, decoding, phrases_of

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return, for every frame, the label that most training records have at the same share of their time.

    Among labels with equally many records, the one with most training frames wins, then the first by name.
    """
    share = segments.frame_times(speech.n_frames, speech.n_frames)  # frame centres, in a record of length 1
    streams = [segments.to_labels(table) for table in model.values()]
    everywhere = np.concatenate(streams)
    labels = sorted(set(everywhere), key=lambda label: (-np.count_nonzero(everywhere == label), label))
    there = np.stack([stream[(share * len(stream)).astype(np.int64)] for stream in streams])
    votes = np.stack([(there == label).sum(axis=0) for label in labels])
    most_likely = np.array(labels, dtype=object)[votes.argmax(axis=0)]  # the first of equals
    table = segments.from_labels(speech.record, most_likely, 1 / speech.frame_s)
    return Synthesis(decoding(speech), phrases_of(speech, table["start_frame"], table["label"]))
