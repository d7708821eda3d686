"""Another real record of the actor: real phrases that belong to other speech, the ceiling of S."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.result import Synthesis, without_model

SYSTEM = System(
    name="another",
    title="Another real record",
    role="ceiling",
    order=10,
)


def synthesise(fold: Fold, order: Sequence[str]) -> Synthesis:
    """Return the phrases of the next record, continued by those after it while it is too short, cut to length.

    Parameters
    ----------
    order : the actor's records, the held-out one among them; after the last comes the first.
    """
    place = list(order).index(fold.record)
    following = [name for name in [*order[place + 1 :], *order[:place]] if name in fold.gestures]
    starts, labels, begin = [], [], 0
    while begin < fold.n_frames:
        table = fold.gestures[following[0]]
        starts.append(begin + table["start_frame"].to_numpy())
        labels.append(table["label"].to_numpy(dtype=object))
        begin += int(table["end_frame"].iloc[-1])
        following = [*following[1:], following[0]]
    first = np.concatenate(starts)
    kept = first < fold.n_frames
    return without_model(fold, first[kept], np.concatenate(labels)[kept])
