"""Recovery of virtual heads: captured poses, patterns of head and melody, and the lag between the two.

The lag is found without any truth: it is the shift at which the labels of the head tell most about those of the
melody, in bits.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Integers
from cospeech.geometry import rotation
from cospeech.markov import labelled_hmm
from cospeech.motion import head

Rows = list[dict[str, Any]]

POSITIONS = ["tx_m", "ty_m", "tz_m"]

MELODY_HZ = 100.0
"""Frame rate of melodies."""

GRID_HZ = 50.0
"""Rate at which labels of the head and of the melody are compared."""

LONGEST_LAG_S = 1.0
"""Largest lag that is considered, in either direction."""

COLUMNS = ["quantity", "actor", "record", "source", "lag_s", "value", "n"]


def captured(planted: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of the captured poses of one record (schema ``head_capture`` without actor and record).

    Both are compared relative to their first frame, the reference of the capture.

    Parameters
    ----------
    planted, found : true and captured poses of the same frames (schema ``head_pose``).
    """
    n_frames = min(len(planted), len(found))
    true, own = planted.iloc[:n_frames], found.iloc[:n_frames]
    turned, measured = (
        rotation.from_euler(head.EULER_ORDER, table[head.COLUMNS].to_numpy(dtype=float)) for table in (true, own)
    )
    turned = turned @ turned[0].T
    known = np.isfinite(own[head.COLUMNS].to_numpy(dtype=float).sum(axis=1))
    moved, placed = (
        table[POSITIONS].to_numpy(dtype=float) - table[POSITIONS].to_numpy(dtype=float)[0] for table in (true, own)
    )
    by_axis = np.abs(
        rotation.to_euler(head.EULER_ORDER, turned[known]) - own[head.COLUMNS].to_numpy(dtype=float)[known]
    )
    errors = {
        **{axis: by_axis[:, place] for place, axis in enumerate("xyz")},
        "rotation": rotation.angles_deg(np.swapaxes(turned[known], -1, -2) @ measured[known]),
        "position": 1000.0 * np.linalg.norm((moved - placed)[known], axis=1),
    }
    status = own["status"].value_counts()
    counts = {f"n_{name}": int(status.get(name, 0)) for name in ("tracked", "predicted")}
    rows = [
        {"quantity": name, "unit": "mm" if name == "position" else "deg", **_spread(values), "n_frames": n_frames}
        | counts
        for name, values in errors.items()
    ]
    return pd.DataFrame(rows)


def _spread(errors: Floats) -> dict[str, float]:
    known = errors[np.isfinite(errors)]
    if not len(known):
        return dict.fromkeys(("mean", "p95", "largest"), np.nan)
    return {"mean": float(known.mean()), "p95": float(np.quantile(known, 0.95)), "largest": float(known.max())}


def agreement(quantity: str, planted: pd.DataFrame, found: pd.DataFrame) -> Rows:
    """Return the adjusted mutual information of the found and the planted patterns of one record.

    Parameters
    ----------
    quantity : name of the row, ``head_ami`` or ``melody_ami``.
    planted, found : segment tables of the record.
    """
    from sklearn.metrics import adjusted_mutual_info_score

    (true, own), n_frames = _streams(planted, found)
    value = float(adjusted_mutual_info_score(true, own))
    return [{"quantity": quantity, "source": "found", "value": value, "n": n_frames}]


def head_segments(model: pd.DataFrame, record: str, angles: pd.DataFrame) -> pd.DataFrame:
    """Return the segments (schema ``segments``) of the patterns of the head that a model finds in a record.

    Parameters
    ----------
    model : a parallel HMM of angles and their first differences (schema ``hmm_model``; Sargin 2006, eq. 4.1).
    angles : angles of the head (schema ``head``).
    """
    filled = head.at_times(angles, angles["time_s"].to_numpy())
    frames = pd.DataFrame(filled, columns=head.COLUMNS)
    differences = frames.diff().bfill().add_prefix("d_")
    found = labelled_hmm.from_table(model)
    return labelled_hmm.phrases(found, record, frames.join(differences), head.frame_rate(angles))


def melody_segments(model: pd.DataFrame, record: str, melody: pd.DataFrame) -> pd.DataFrame:
    """Return the segments of the patterns that a model finds in the melody of a record (schema ``melody``)."""
    return labelled_hmm.phrases(labelled_hmm.from_table(model), record, melody, MELODY_HZ)


def lags(source: str, heads: Mapping[str, pd.DataFrame], melodies: Mapping[str, pd.DataFrame]) -> Rows:
    """Return the information in the head about the melody over the lag, and the lag at which it is greatest.

    Parameters
    ----------
    source : where the patterns come from, ``planted`` or ``found``.
    heads, melodies : segment tables of the patterns of head and melody, by record.
    """
    farthest = round(LONGEST_LAG_S * GRID_HZ)
    steps = np.arange(-farthest, farthest + 1)
    pairs = [_streams(heads[record], melodies[record])[0] for record in heads]
    names = [np.unique(np.concatenate([pair[side] for pair in pairs])) for side in (0, 1)]
    coded = [tuple(np.searchsorted(names[side], pair[side]).astype(np.int64) for side in (0, 1)) for pair in pairs]
    bits = np.array([_information(coded, int(step), [len(known) for known in names]) for step in steps])
    n_frames = sum(len(pair[0]) for pair in pairs)
    rows: Rows = [
        {"quantity": "information", "source": source, "lag_s": step / GRID_HZ, "value": value, "n": n_frames}
        for step, value in zip(steps.tolist(), bits.tolist(), strict=True)
    ]
    return [*rows, {"quantity": "lag", "source": source, "value": _peak(steps, bits) / GRID_HZ, "n": n_frames}]


def planted_lag(joints: pd.DataFrame) -> Rows:
    """Return the mean lag of the planted joint patterns (schema ``head_joints``) in which the head listens."""
    coupled = joints[joints["coupled"]]
    mean = float(coupled["lag_s"].mean()) if len(coupled) else np.nan
    return [{"quantity": "lag", "source": "planted", "value": mean, "n": len(coupled)}]


def table(rows: Rows) -> pd.DataFrame:
    """Return rows as one table (schema ``head_recovery``); columns that a row lacks are null."""
    return pd.DataFrame(rows).reindex(columns=COLUMNS)


def _streams(one: pd.DataFrame, other: pd.DataFrame) -> tuple[tuple[Any, Any], int]:
    """Return the labels of two segment tables on one grid, (T,) each, and T."""
    n_frames = int(min(float(part["end_s"].iloc[-1]) for part in (one, other)) * GRID_HZ + 1e-6)
    times_s = segments.frame_times(n_frames, GRID_HZ)
    first, second = (
        part["label"].to_numpy(dtype=object)[segments.at_times(part, times_s)].astype(str) for part in (one, other)
    )
    return (first, second), n_frames


def _information(pairs: list[tuple[Integers, ...]], step: int, sizes: list[int]) -> float:
    """Return the mutual information in bits of head labels and the melody labels ``step`` frames later."""
    counts = np.zeros(sizes)
    for heads, melodies in pairs:
        first, second = (
            (heads[: len(heads) - step], melodies[step:]) if step >= 0 else (heads[-step:], melodies[:step])
        )
        np.add.at(counts, (first, second), 1.0)
    joint = counts / max(counts.sum(), 1.0)
    apart = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    seen = joint > 0
    return float((joint[seen] * np.log2(joint[seen] / apart[seen])).sum())


def _peak(steps: Integers, values: Floats) -> float:
    """Return where a curve is greatest, between its points by a parabola through the greatest and its neighbours."""
    best = int(np.argmax(values))
    if best in (0, len(values) - 1):
        return float(steps[best])
    before, top, after = values[best - 1 : best + 2]
    bend = before - 2.0 * top + after
    return float(steps[best] + (0.5 * (before - after) / bend if bend < 0 else 0.0))
