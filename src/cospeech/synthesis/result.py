"""The two tables that every system leaves: the phrases it made, and how it came to them."""

from __future__ import annotations

from typing import NamedTuple

import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.markov import hsmm
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.speech import Speech


class Synthesis(NamedTuple):
    """Phrases of the held-out record (schema segments) and one row on their making (schema decoding)."""

    phrases: pd.DataFrame
    decoding: pd.DataFrame


def of_path(path: hsmm.Path, speech: Speech, weight: float, censoring: hsmm.Censoring) -> Synthesis:
    """Return the tables of a path through a model that heard ``speech``."""
    return Synthesis(
        segments.from_starts(speech.record, path.starts, path.labels, speech.n_frames, 1 / speech.frame_s),
        pd.DataFrame(
            {
                "record": [speech.record],
                "log_score": [path.log_score],
                "emission_weight": [float(weight)],
                "censoring": [censoring],
                "driving_record": [speech.driving_record],
                "shift_s": [speech.shift_s],
            }
        ),
    )


def without_model(fold: Fold, starts: npt.ArrayLike, labels: npt.ArrayLike) -> Synthesis:
    """Return the tables of phrases, (L,), that no model was decoded for: the making has a name and gaps."""
    return Synthesis(
        segments.from_starts(fold.record, starts, labels, fold.n_frames, 1 / fold.frame_s),
        pd.DataFrame(
            {
                "record": [fold.record],
                "log_score": [None],
                "emission_weight": [None],
                "censoring": [None],
                "driving_record": [None],
                "shift_s": [None],
            }
        ),
    )
