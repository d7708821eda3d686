"""One actor's model of the head driven by another actor's voice (Sargin 2006, 4.4.3).

Nobody recorded how this head would have moved, so nothing is compared frame by frame. What can be said is how fast
and how far a head moves, how often its patterns change, whether it shows the patterns in the shares of the recorded
heads that its model was learnt from, and whether both models find the same patterns in the melody of the voice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.evaluation import head_recovery
from cospeech.evaluation.head import speed
from cospeech.motion import head


def row(angles: pd.DataFrame, model: pd.DataFrame, recorded: Sequence[pd.DataFrame]) -> dict[str, float]:
    """Return how a head moves.

    Parameters
    ----------
    angles : angles of the head (schema ``head``).
    model : the patterns of the head that a model has learnt (schema ``hmm_model``).
    recorded : the recorded heads that it was learnt from (schema ``head``).

    Returns
    -------
    speed_deg_s, the mean angular speed; spread_deg, the standard deviation of the angles (root mean square over the
    axes); patterns_per_minute; and pattern_distance, the total variation distance between the shares of time of the
    patterns in ``angles`` and in ``recorded``, from 0 (equal) to 1 (disjoint).
    """
    known = angles[head.COLUMNS].dropna()
    found = head_recovery.head_segments(model, "made", angles)
    patterns = list(dict.fromkeys(model["branch"]))
    own = _shares([found], patterns)
    learnt = _shares([head_recovery.head_segments(model, "recorded", table) for table in recorded], patterns)
    return {
        "speed_deg_s": float(np.nanmean(speed(angles[head.COLUMNS].to_numpy(dtype=float), head.frame_rate(angles)))),
        "spread_deg": float(np.sqrt(known.var(ddof=0).mean())),
        "patterns_per_minute": 60.0 * len(found) / float(found["end_s"].iloc[-1]),
        "pattern_distance": 0.5 * float(np.abs(own - learnt).sum()),
    }


def _shares(found: Sequence[pd.DataFrame], patterns: list[str]) -> Floats:
    """Return the share of time (M,) of each pattern in some segment tables."""
    table = pd.concat(found)
    lasting = (table["end_s"] - table["start_s"]).groupby(table["label"]).sum().reindex(patterns, fill_value=0.0)
    return np.asarray(lasting / lasting.sum(), dtype=float)


def melody_agreement(melody: pd.DataFrame, own: pd.DataFrame, other: pd.DataFrame) -> float:
    """Return the adjusted mutual information over frames of the patterns that two models find in a melody.

    Parameters
    ----------
    melody : pitch and intensity of the voice (schema ``melody``).
    own, other : the patterns of the melody that the models of two actors have learnt (schema ``hmm_model``).
    """
    from sklearn.metrics import adjusted_mutual_info_score  # takes half a second to import

    one, another = (
        segments.to_labels(head_recovery.melody_segments(model, "voice", melody)) for model in (own, other)
    )
    return float(adjusted_mutual_info_score(one, another))
