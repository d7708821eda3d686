"""Recovery of the planted ground truth: gesture phrases, prosody patterns, pitch, and the planted process.

The delay until syllables are known is reported with it, although no syllables are planted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.rng import random_source
from cospeech.metrics import agreement

Rows = list[dict[str, Any]]

SIMULATIONS = 2000
"""Number of samples of the planted process that the observed counts are compared with."""

COLUMNS = ["quantity", "actor", "record", "clusters", "states", "part", "value", "n"]


def table(rows: Rows) -> pd.DataFrame:
    """Return the rows as one table (schema ``recovery``); columns that a row lacks are null."""
    frame = pd.DataFrame(rows).reindex(columns=COLUMNS)
    return frame.astype({"clusters": "Int64", "states": "Int64"})


def gestures(planted: pd.DataFrame, found: pd.DataFrame, frame_s: float) -> Rows:
    """Return the agreement of the found and the planted gesture phrases of one record, on the prosody time grid.

    Rows: gesture_frames_right (share of frames), gesture_kappa (Cohen's), gesture_phrase_ratio (found / planted).
    """
    n_frames = round(float(planted["end_s"].iloc[-1]) / frame_s)
    true, guess = (segments.resample(table, n_frames, 1.0 / frame_s) for table in (planted, found))
    names = pd.Index(sorted({*true["label"], *guess["label"]}))
    a, b = (names.get_indexer(pd.Index(segments.to_labels(table))).astype(np.int64) for table in (true, guess))
    values = {
        "gesture_frames_right": agreement.share_right(a, b),
        "gesture_kappa": agreement.kappa(a, b),
        "gesture_phrase_ratio": len(guess) / len(true),
    }
    return [{"quantity": quantity, "value": value, "n": n_frames} for quantity, value in values.items()]


def prosody(planted: pd.DataFrame, found: pd.DataFrame, held_out: str) -> Rows:
    """Return the adjusted mutual information of found prosody clusters and planted patterns over frames.

    There is one row for the held-out record of the fold, and one for the records that its clusters were trained on.

    Parameters
    ----------
    planted, found : segments of several records; the records in ``found`` are evaluated.
    held_out : the held-out record of the fold.
    """
    from sklearn.metrics import adjusted_mutual_info_score

    streams: dict[str, list[tuple[npt.NDArray[Any], npt.NDArray[Any]]]] = {"held_out": [], "training": []}
    for record, table in found.groupby("record", sort=False):
        true = planted[planted["record"] == record]
        if len(true) == 0:
            continue
        n_frames = int(table["end_frame"].iloc[-1])
        fps = n_frames / float(table["end_s"].iloc[-1])
        labels = segments.to_labels(segments.resample(true, n_frames, fps))
        streams["held_out" if record == held_out else "training"].append((labels, segments.to_labels(table)))
    rows = []
    for part, pairs in streams.items():
        if pairs:
            true_labels, found_labels = (np.concatenate(side).astype(str) for side in zip(*pairs, strict=True))
            value = float(adjusted_mutual_info_score(true_labels, found_labels))
            rows.append({"quantity": "prosody_ami", "part": part, "value": value, "n": len(true_labels)})
    return rows


def pitch(planted: pd.DataFrame, measured: pd.DataFrame, voiced_gain: float) -> Rows:
    """Return the error of the measured pitch lag, compared with the planted one, in voiced frames of one record.

    Rows: pitch_error (median relative error), pitch_gross_errors (share of errors above 20 %, e.g. octave errors).
    Voiced frames have a planted pitch and a measured gain above ``voiced_gain``.

    Parameters
    ----------
    planted : time_s, lag_s (null in unvoiced frames).
    measured : the prosody table of the record.
    voiced_gain : pitch gain above which a frame is voiced.
    """
    times = planted["time_s"].to_numpy()
    nearest = np.abs(measured["time_s"].to_numpy()[:, None] - times[None, :]).argmin(axis=1)
    true = planted["lag_s"].to_numpy(dtype=float)[nearest]
    found = measured["lag_s"].to_numpy(dtype=float)
    voiced = (measured["pitch_gain"].to_numpy() > voiced_gain) & np.isfinite(true) & np.isfinite(found) & (true > 0)
    if not voiced.any():
        return []
    error = np.abs(found[voiced] / true[voiced] - 1)
    values = {"pitch_error": float(np.median(error)), "pitch_gross_errors": float(np.mean(error > 0.2))}
    return [{"quantity": quantity, "value": value, "n": int(voiced.sum())} for quantity, value in values.items()]


def syllable_delays(found: pd.DataFrame) -> Rows:
    """Return how late a live listener knows the voiced syllables of a record, in seconds after their peaks.

    Rows: syllable_delay (median), syllable_delay_p90 (90th percentile).

    Parameters
    ----------
    found : the syllable table of the record.
    """
    voiced = found[found["f0_hz"].notna()]
    if len(voiced) == 0:
        return []
    delay_s = voiced["known_s"] - voiced["peak_s"]
    return [
        {"quantity": "syllable_delay", "value": float(delay_s.median()), "n": len(voiced)},
        {"quantity": "syllable_delay_p90", "value": float(delay_s.quantile(0.9)), "n": len(voiced)},
    ]


def process(phrases: pd.DataFrame, transitions: pd.DataFrame, durations: pd.DataFrame, seed: int) -> Rows:
    """Test whether the planted phrases of one actor are a plausible sample of the planted process.

    Rows: transitions_p and durations_p, the p-values of Pearson's chi-square statistic. They are estimated from
    simulated samples of the same size, because most cells have an expected count below five. A small value means that
    the planted probabilities cannot be recovered by counting phrases. The last phrase of each record is left out,
    because it is truncated by the end of the record.

    Parameters
    ----------
    phrases : planted gesture segments of the actor's records.
    transitions : from_gesture, to_gesture, probability.
    durations : gesture, bin, duration_s, probability.
    seed : seed of the simulated samples.
    """
    follows = phrases["label"].shift(-1).where(phrases["record"] == phrases["record"].shift(-1))
    whole = phrases.assign(to=follows)[follows.notna()]
    pairs = pd.crosstab(whole["label"], whole["to"])
    planned = transitions.set_index(["from_gesture", "to_gesture"])["probability"].unstack(fill_value=0)  # noqa: PD010
    observed = pairs.reindex(index=planned.index, columns=planned.columns, fill_value=0)

    planned_bins = durations.set_index(["gesture", "bin"])["probability"].unstack(fill_value=0)  # noqa: PD010
    bin_s = float((durations["duration_s"] / durations["bin"]).iloc[0])
    bins = np.ceil((whole["end_s"] - whole["start_s"]) / bin_s - 1e-6).astype(int)
    bins = bins.clip(upper=int(planned_bins.columns.max()))
    counted = pd.crosstab(whole["label"], bins)
    counted = counted.reindex(index=planned_bins.index, columns=planned_bins.columns, fill_value=0)
    return [
        {"quantity": "transitions_p", "value": _simulated_p(observed, planned, seed, "transitions"), "n": len(whole)},
        {"quantity": "durations_p", "value": _simulated_p(counted, planned_bins, seed, "durations"), "n": len(whole)},
    ]


def _simulated_p(observed: pd.DataFrame, planned: pd.DataFrame, seed: int, name: str) -> float:
    """Return the p-value of ``observed`` counts under ``planned`` probabilities; NaN if there are no counts."""
    counts = observed.to_numpy(dtype=np.int64)
    totals = counts.sum(axis=1)
    used = totals > 0
    if not used.any():
        return math.nan
    probability = planned.to_numpy(dtype=float)[used]
    probability /= probability.sum(axis=1, keepdims=True)
    expected = totals[used, None] * probability
    rng = random_source(seed, name)
    simulated = np.stack(
        [rng.multinomial(n, p, SIMULATIONS) for n, p in zip(totals[used], probability, strict=True)], axis=1
    )

    def chi_square(table: npt.NDArray[Any]) -> npt.NDArray[Any]:
        with np.errstate(divide="ignore", invalid="ignore"):
            cells = (table - expected) ** 2 / expected
        cells[..., expected == 0] = np.where(table[..., expected == 0] > 0, np.inf, 0.0)
        return cells.sum(axis=(-2, -1))

    larger = int((chi_square(simulated) >= chi_square(counts[used]) - 1e-9).sum())
    return (larger + 1) / (SIMULATIONS + 1)
