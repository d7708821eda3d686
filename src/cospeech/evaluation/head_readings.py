"""What some equations of Sargin 2006 give as printed, and as they are read here, on the records of a run.

The equations for the pose of a head are tried in ``capture.head.readings``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from cospeech.evaluation import head as scoring
from cospeech.motion import head

PRINTED = {
    "B.2": ("t = m − m_r", "t = m − R m_r"),
    "B.10, B.15": ("H = −2 (…), K'HK a = K'D", "H = +2 (…), K'HK a = −K'D"),
    "4.4": ("arctangent of a quotient", "arctangent of two arguments"),
    "4.5": ("Euler angles are added", "rotations are composed"),
    "4.6, 4.7": ("Kalman filter", "the same with a smoother"),
    "4.1.1": ("flow to the reference image, from 25° on between images", "flow to the warped reference image"),
    "4.1.2": ("noise of unit variance in gaps", "the same, after pitch is divided by its deviation"),
    "4.3": ("occupancies from the diagonal of A^d", "shares of the expected durations 1 / (1 − a)"),
    "4.14–4.16": ("β chooses the number of patterns", "β and BIC are reported, and choose nothing"),
    "4.20": ("a sum over frames", "their mean"),
    "4.21": ("compared between two models", "compared with the mean head"),
}
"""Each equation as printed, and as it is read."""

COLUMNS = ["equation", "printed", "read", "quantity", "unit", "as_printed", "as_read"]


def readings(patterns: pd.DataFrame, melody: pd.DataFrame, original: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the readings of 4.1.2, 4.3, 4.20 and 4.21 for a record, one row each.

    Parameters
    ----------
    patterns : the patterns of the head that a model has learnt (schema ``hmm_model``).
    melody : pitch and intensity of the record (schema ``melody``).
    original : the recorded head (schema ``head``).
    """
    active = melody["active"].to_numpy()
    hertz = float(np.nanstd(melody.loc[active, "f0_hz"]))
    noise = float(melody.loc[~active, "pitch"].std() / melody.loc[active, "pitch"].std())
    still = head.table(np.zeros((len(original), 3)), head.frame_rate(original))
    distance = scoring.scores(original, still).set_index("measure")["value"]["normalised"]
    known = original[head.COLUMNS].dropna().to_numpy(dtype=float)
    mean = scoring.distances(known, np.tile(known.mean(axis=0), (len(known), 1)))["mahalanobis"]
    return [
        _row("4.1.2", "deviation of the noise relative to that of the pitch", "", 1.0 / hertz, noise),
        _row("4.3", "share of a pattern's frames in its last state", "%", *_last_state(patterns)),
        _row("4.20", "distance of a head that does not move", "", float(distance) * len(known), float(distance)),
        _row("4.21", "distance of the mean head", "", np.nan, mean),
    ]


def choices(curves: pd.DataFrame) -> list[dict[str, Any]]:
    """Return how many patterns β (as printed) and BIC choose (schema ``head_curves``; 4.14-4.16)."""
    rows = []
    for stream in ("head", "melody"):
        own = curves[curves["stream"] == stream].set_index("n_patterns")
        counts = own.index.to_numpy(dtype=float)
        chosen = float(counts[own["beta"].argmax()]), float(counts[own["bic"].argmin()])
        rows.append(_row("4.14–4.16", f"patterns of the {stream} that β and BIC choose", "", *chosen))
    return rows


def flows(accuracy: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the error of captured poses by both kinds of optical flow (schema ``head_accuracy``; 4.1.1).

    It is the mean over the axes in the first of the films, which has the largest images and the least noise.
    """
    film = ["width_px", "contrast", "noise", "depth"]
    own = accuracy.merge(accuracy[film].head(1), on=film)
    errors = own.groupby("flow")["mean_deg"].mean()
    return [_row("4.1.1", "mean error of captured poses within ±30°", "°", errors["printed"], errors["warped"])]


def table(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Return rows with the equations as printed and as read (schema ``head_readings``)."""
    found = pd.DataFrame(rows)
    equations = found["equation"].map(PRINTED)
    return found.assign(printed=equations.str[0], read=equations.str[1])[COLUMNS]


def _row(equation: str, quantity: str, unit: str, as_printed: float, as_read: float) -> dict[str, Any]:
    return {"equation": equation, "quantity": quantity, "unit": unit, "as_printed": as_printed, "as_read": as_read}


def _last_state(patterns: pd.DataFrame) -> tuple[float, float]:
    """Return the mean share of frames in the last state of a pattern in percent, by both readings of section 4.3.

    Within a pattern, nothing leaves its last state, whose probability to stay is therefore 1 as printed.
    """
    shares = []
    for _, own in patterns.drop_duplicates(["branch", "state"]).groupby("branch"):
        stay = own.sort_values("state")["stay_probability"].to_numpy(dtype=float)
        lasting = 1.0 / (1.0 - stay)
        diagonal = np.append(stay[:-1], 1.0) ** round(lasting.sum())
        shares.append((100.0 * diagonal[-1] / diagonal.sum(), 100.0 * lasting[-1] / lasting.sum()))
    printed, read = np.mean(shares, axis=0)
    return float(printed), float(read)
