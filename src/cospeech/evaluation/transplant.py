"""One actor's model driven by another actor's voice (Özkul 2012, chapter 8; Sargin 2006, 4.4.3).

There is no actual record to compare a transplant with. What can be said is how its phrases differ from those that the
voice's own actor's model made for the same speech.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.metrics import agreement


def row(phrases: pd.DataFrame, reference: pd.DataFrame | None, frame_s: float) -> dict[str, Any]:
    """Return what one sequence of phrases is like.

    Parameters
    ----------
    phrases : segment table of the record.
    reference : the phrases of the own actor's model, or None for these themselves.
    frame_s : length of the frames on which agreement is measured, in seconds.

    Returns
    -------
    n_phrases, phrases_per_minute, mean_phrase_s, share_rest, and kappa: the agreement of the frames with
    ``reference`` (None without one).
    """
    lengths = (phrases["end_s"] - phrases["start_s"]).to_numpy()
    total_s = float(lengths.sum())
    return {
        "n_phrases": len(phrases),
        "phrases_per_minute": 60 * len(phrases) / total_s,
        "mean_phrase_s": float(lengths.mean()),
        "share_rest": float(lengths[(phrases["label"] == "rest").to_numpy()].sum() / total_s),
        "kappa": None if reference is None else _kappa(phrases, reference, frame_s),
    }


def _kappa(one: pd.DataFrame, other: pd.DataFrame, frame_s: float) -> float:
    n_frames = round(min(one["end_s"].iloc[-1], other["end_s"].iloc[-1]) / frame_s)
    streams = [segments.to_labels(segments.resample(table, n_frames, 1 / frame_s)) for table in (one, other)]
    codes = np.unique(np.concatenate(streams).astype(str), return_inverse=True)[1]
    return agreement.kappa(codes[:n_frames], codes[n_frames:])
