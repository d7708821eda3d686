"""How fast the hands and elbows move: histograms of speed, acceleration and jerk, and how far they differ."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion import skeleton

JOINTS = ("left_forearm", "left_hand", "right_forearm", "right_hand")
"""Elbows and wrists, as the joints where forearm and hand begin."""

UNITS = {"speed": "m/s", "acceleration": "m/s^2", "jerk": "m/s^3"}
"""The quantities, each the magnitude of one more time derivative of the position in the world."""

ORIGINAL = "original"
ANOTHER = "another original"

Quantities = dict[tuple[str, str], Floats]
"""Magnitudes (T - order,) by quantity and joint."""

_MAXIMUM_SHARE = 0.995


def magnitudes(motion: pd.DataFrame) -> Quantities:
    """Return speed, acceleration and jerk of every joint of ``JOINTS``, by forward differences at the motion's rate.

    Nothing is smoothed: noise on the angles shows, most in the jerk, and more of it at a higher frame rate.
    """
    fps = skeleton.frame_rate(motion)
    root = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float)
    positions = skeleton.forward(root, skeleton.angles(motion))
    result: Quantities = {}
    for joint in JOINTS:
        derivative = positions[joint]
        for quantity in UNITS:
            derivative = np.diff(derivative, axis=0) * fps
            result[quantity, joint] = np.linalg.norm(derivative, axis=1)
    return result


def bin_edges(originals: list[Quantities], n_bins: int) -> dict[str, Floats]:
    """Return the edges (n_bins + 1,) of the bins of each quantity, from 0 in equal steps, the same for every joint.

    All but the fastest 0.5 % of the original motion lies below the last edge; the last bin holds what is beyond.
    """
    edges = {}
    for quantity in UNITS:
        values = np.concatenate([table[quantity, joint] for table in originals for joint in JOINTS])
        top = float(np.quantile(values, _MAXIMUM_SHARE)) if len(values) else 0.0
        edges[quantity] = np.linspace(0.0, top if top > 0 else 1.0, n_bins + 1)
    return edges


def shares(values: Floats, edges: Floats) -> Floats:
    """Return the share of the values in each bin, shape (n_bins,), values beyond the last edge in the last bin."""
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return np.bincount(bins, minlength=len(edges) - 1) / max(1, len(values))


def hellinger(p: Floats, q: Floats) -> float:
    """Return the Hellinger distance of two discrete distributions: 0 for equal ones, 1 for disjoint ones."""
    return math.sqrt(max(0.0, 1.0 - float(np.sqrt(p * q).sum())))


def statistics(
    motions: dict[tuple[str, str], pd.DataFrame], actors: dict[str, str], n_bins: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return how the motion of each system compares with the original motion.

    Parameters
    ----------
    motions : motion tables by (system, record); the original motion is the system ``original``.
    actors : the actor of each record.
    n_bins : bins of the histograms.

    Returns
    -------
    The statistics, one row a system, record, quantity and joint: mean, hellinger (to the record's original; null
    for the original itself), fps, unit, n_frames. Rows of the system ``another original`` compare each record with
    the actor's other original records (the mean distance): what a person differs from themselves.
    The histograms, one row a system, actor, quantity, joint and bin, pooled over the actor's records.

    Raises
    ------
    UserError : motions of different frame rate, whose accelerations do not compare.
    """
    _check_rates(motions)
    measured = {key: magnitudes(table) for key, table in motions.items()}
    fps = skeleton.frame_rate(next(iter(motions.values())))
    edges = bin_edges([table for (system, _), table in measured.items() if system == ORIGINAL], n_bins)
    return _distances(measured, actors, edges, fps), _histograms(measured, actors, edges, fps)


def _check_rates(motions: dict[tuple[str, str], pd.DataFrame]) -> None:
    rates = {key: skeleton.frame_rate(table) for key, table in motions.items()}
    (first_system, first_record), first = next(iter(rates.items()))
    for (system, record), fps in rates.items():
        if fps != first:
            raise UserError(
                f"motion of record '{record}' ({system}) has {fps:g} frames/s, that of '{first_record}' "
                f"({first_system}) {first:g}: speeds compare at one rate only; resample the motion to one rate"
            )


def _distances(
    measured: dict[tuple[str, str], Quantities], actors: dict[str, str], edges: dict[str, Floats], fps: float
) -> pd.DataFrame:
    rows = []
    for quantity, unit in UNITS.items():
        for joint in JOINTS:
            share = {key: shares(table[quantity, joint], edges[quantity]) for key, table in measured.items()}
            common = {"quantity": quantity, "joint": joint, "fps": fps, "unit": unit}
            for (system, record), table in measured.items():
                values = table[quantity, joint]
                distance = hellinger(share[system, record], share[ORIGINAL, record])
                rows.append(
                    {"system": system, "actor": actors[record], "record": record, **common}
                    | {"mean": values.mean(), "n_frames": len(values)}
                    | {"hellinger": math.nan if system == ORIGINAL else distance}
                )
            for record, others in _others(actors).items():
                distances = [hellinger(share[ORIGINAL, other], share[ORIGINAL, record]) for other in others]
                speeds = [measured[ORIGINAL, other][quantity, joint] for other in others]
                rows.append(
                    {"system": ANOTHER, "actor": actors[record], "record": record, **common}
                    | {"mean": np.mean([v.mean() for v in speeds]), "n_frames": sum(map(len, speeds))}
                    | {"hellinger": float(np.mean(distances))}
                )
    return pd.DataFrame(rows)


def _others(actors: dict[str, str]) -> dict[str, list[str]]:
    others: dict[str, list[str]] = {}
    for record, other in permutations(actors, 2):
        if actors[record] == actors[other]:
            others.setdefault(record, []).append(other)
    return others


def _histograms(
    measured: dict[tuple[str, str], Quantities], actors: dict[str, str], edges: dict[str, Floats], fps: float
) -> pd.DataFrame:
    tables = []
    for system in dict.fromkeys(system for system, _ in measured):
        for actor in dict.fromkeys(actors.values()):
            pooled = [table for (s, record), table in measured.items() if s == system and actors[record] == actor]
            for quantity, unit in UNITS.items():
                for joint in JOINTS:
                    values = np.concatenate([table[quantity, joint] for table in pooled])
                    upper = np.append(edges[quantity][1:-1], np.nan)
                    tables.append(
                        pd.DataFrame(
                            {"system": system, "actor": actor, "quantity": quantity, "joint": joint, "fps": fps}
                            | {"unit": unit, "bin": np.arange(1, len(upper) + 1)}
                            | {"low": edges[quantity][:-1], "high": upper, "share": shares(values, edges[quantity])}
                        )
                    )
    return pd.concat(tables, ignore_index=True)
