"""Another recorded head of the actor: real gestures that belong to other speech."""

from __future__ import annotations

import numpy as np

from cospeech.synthesis.head import pool
from cospeech.synthesis.head.pool import Pool, from_tables, shown, to_tables, train
from cospeech.synthesis.interface import Speech, Synthesis

__all__ = ["from_tables", "synthesise", "to_tables", "train"]


def synthesise(model: Pool, speech: Speech, seed: int) -> Synthesis:
    """Return the head of the next record, continued by those of later records if necessary, and cut to length.

    The last record is followed by the first. A record of another actor gets the records in their order.
    """
    place = model.order.index(speech.record) if speech.record in model.order else -1
    order = [*model.order[place + 1 :], *model.order[: place + 1]]
    following = [name for name in order if name in model.heads and name != speech.record]
    times_s, parts, begin_s = pool.times_s(speech), [], 0.0
    while len(times_s):
        head = model.heads[following[0]]
        end_s = begin_s + pool.duration_s(head)
        within = times_s < end_s
        parts.append(pool.angles(head, times_s[within] - begin_s))
        times_s, begin_s, following = times_s[~within], end_s, [*following[1:], following[0]]
    return shown(speech, np.concatenate(parts))
