"""The HSMM with the parameters that the virtual studio planted, under the prosody phrases that it planted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from cospeech.data import segments
from cospeech.markov import hsmm
from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.hsmm_weighted import best_weight

SYSTEM = System(
    name="oracle",
    title="HSMM with the planted parameters",
    role="ceiling",
    order=20,
    studio_only=True,
)


def planted_model(truth: Mapping[str, pd.DataFrame], actor: str, floor: float) -> hsmm.SemiMarkov:
    """Return the planted model of ``actor``, floored like a trained one.

    Parameters
    ----------
    truth : planted ``semi.TABLES``, with a column ``actor``.
    """
    return hsmm.floored(
        hsmm.from_tables({name: table[table["actor"] == actor] for name, table in truth.items()}), floor
    )


def planted_prosody(planted: pd.DataFrame, found: pd.DataFrame, frame_s: float) -> pd.DataFrame:
    """Return the planted prosody segments of the records of ``found``, on the same frames.

    Parameters
    ----------
    planted : planted prosody segments of all records at any rate.
    found : prosody segments that were found in the sound; of them only the records and their lengths count.
    """
    lengths = found.groupby("record", sort=False)["end_frame"].max()
    return pd.concat(
        [
            segments.resample(planted[planted["record"] == name], int(n_frames), 1 / frame_s)
            for name, n_frames in lengths.items()
        ],
        ignore_index=True,
    )


def choose_weight(fold: Fold, model: hsmm.SemiMarkov, weights: Sequence[float], censoring: hsmm.Censoring) -> float:
    """Return the weight that serves the training records best, as ``hsmm_weighted`` chooses its own.

    Parameters
    ----------
    fold : of planted phrases and planted prosody. model : the planted one, which no record was counted for.
    """
    return best_weight(fold, dict.fromkeys(fold.gestures, model), weights, censoring)
