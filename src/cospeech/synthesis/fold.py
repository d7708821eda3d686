"""What a fold knows: phrases and speech of its training records, and of the held-out record the length alone."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.synthesis.speech import Labels, frame_labels


@dataclass(frozen=True)
class Fold:
    """One held-out record, and the actor's other records to learn from; all on the prosody frame.

    Attributes
    ----------
    record : the held-out record.
    n_frames : its length.
    frame_s : distance of frames in seconds.
    gestures : segment table of the gesture phrases of each training record.
    speech : (T,) prosody label of every frame, of each training record.
    """

    record: str
    n_frames: int
    frame_s: float
    gestures: dict[str, pd.DataFrame]
    speech: dict[str, Labels]


def fold(record: str, gestures: pd.DataFrame, prosody: pd.DataFrame, frame_s: float) -> Fold:
    """Return the fold that holds out ``record``.

    Parameters
    ----------
    gestures : gesture segments of the actor's records at any rate; the held-out record's, if there, are left out.
    prosody : prosody segments of all the actor's records on the prosody frame.
    frame_s : distance of prosody frames in seconds.

    Raises
    ------
    UserError : where nothing is left to train on, a record lacks its speech, or segments have gaps.
    """
    speech = frame_labels(prosody)
    if record not in speech:
        raise UserError(f"record {record}: has no prosody segments; delete results of its fold and run again")
    phrases = {}
    for key, table in gestures[gestures["record"] != record].groupby("record", sort=False):
        name = str(key)
        if name not in speech:
            raise UserError(f"record {name}: has gesture segments but no prosody segments in the fold of {record}")
        segments.check(table, f"gesture segments of record {name}")
        phrases[name] = segments.resample(table, len(speech[name]), 1 / frame_s)
    if not phrases:
        raise UserError(f"record {record}: its actor has no other record to learn from; add one")
    return Fold(record, len(speech[record]), frame_s, phrases, {name: speech[name] for name in phrases})
