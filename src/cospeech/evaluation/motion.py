"""Kinematics of hands and elbows: histograms of speed, acceleration and jerk, and Hellinger distances of them."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion import skeleton

JOINTS = ("left_forearm", "left_hand", "right_forearm", "right_hand")
"""Elbows and wrists, named after the body parts that begin there."""

UNITS = {"speed": "m/s", "acceleration": "m/s^2", "jerk": "m/s^3"}
"""Units of the quantities: magnitudes of the first, second and third time derivative of the world position."""

ORIGINAL = "original"
OTHER_ORIGINAL = "another original"

Quantities = dict[tuple[str, str], Floats]
"""Magnitudes by quantity and joint, (T - order of the derivative,) each."""

_MAX_QUANTILE = 0.995


def magnitudes(motion: pd.DataFrame) -> Quantities:
    """Return speed, acceleration and jerk of each joint in ``JOINTS``, by forward differences at the frame rate.

    The motion is not smoothed, so noise in the angles affects the result: most of all the jerk, and more at higher
    frame rates.
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
    """Return the edges (n_bins + 1,) of equal-width bins from 0 for each quantity, the same for all joints.

    The last edge is the 99.5th percentile of the original motion; the last bin also contains all larger values.
    """
    edges = {}
    for quantity in UNITS:
        values = np.concatenate([table[quantity, joint] for table in originals for joint in JOINTS])
        top = float(np.quantile(values, _MAX_QUANTILE)) if len(values) else 0.0
        edges[quantity] = np.linspace(0.0, top if top > 0 else 1.0, n_bins + 1)
    return edges


def histogram(values: Floats, edges: Floats) -> Floats:
    """Return the share of values in each bin, (n_bins,); values beyond the last edge are counted in the last bin."""
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return np.bincount(bins, minlength=len(edges) - 1) / max(1, len(values))


def hellinger(p: Floats, q: Floats) -> float:
    """Return the Hellinger distance between two discrete distributions: 0 if equal, 1 if disjoint."""
    return math.sqrt(max(0.0, 1.0 - float(np.sqrt(p * q).sum())))


def statistics(
    motions: dict[tuple[str, str], pd.DataFrame], actors: dict[str, str], n_bins: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the motion of each system with the original motion.

    A system that made no motion of one record (it failed) is left out altogether, as in the scores.

    Parameters
    ----------
    motions : motion tables by (system, record); the original motion is the system ``original``.
    actors : the actor of each record.
    n_bins : number of histogram bins.

    Returns
    -------
    The statistics (schema ``motion_statistics``), one row per system, record, quantity and joint. The Hellinger
    distance is to the original motion of the record, and null for the original itself. Rows of the system ``another
    original`` compare each record with the actor's other original records (mean distance), i.e. they show how much a
    person's motion varies between records.
    The histograms (schema ``motion_histograms``), one row per system, actor, quantity, joint and bin, pooled over the
    actor's records.

    Raises
    ------
    UserError : if the motions differ in frame rate, because their accelerations would not be comparable.
    """
    failed = {system for (system, _), table in motions.items() if table.empty}
    motions = {key: table for key, table in motions.items() if key[0] not in failed}
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
                f"({first_system}) {first:g}: resample all motions to one rate"
            )


def _distances(
    measured: dict[tuple[str, str], Quantities], actors: dict[str, str], edges: dict[str, Floats], fps: float
) -> pd.DataFrame:
    rows = []
    for quantity, unit in UNITS.items():
        for joint in JOINTS:
            share = {key: histogram(table[quantity, joint], edges[quantity]) for key, table in measured.items()}
            common = {"quantity": quantity, "joint": joint, "fps": fps, "unit": unit}
            for (system, record), table in measured.items():
                values = table[quantity, joint]
                distance = hellinger(share[system, record], share[ORIGINAL, record])
                rows.append(
                    {"system": system, "actor": actors[record], "record": record, **common}
                    | {"mean": values.mean(), "n_frames": len(values)}
                    | {"hellinger": math.nan if system == ORIGINAL else distance}
                )
            for record, others in _other_records(actors).items():
                distances = [hellinger(share[ORIGINAL, other], share[ORIGINAL, record]) for other in others]
                speeds = [measured[ORIGINAL, other][quantity, joint] for other in others]
                rows.append(
                    {"system": OTHER_ORIGINAL, "actor": actors[record], "record": record, **common}
                    | {"mean": np.mean([v.mean() for v in speeds]), "n_frames": sum(map(len, speeds))}
                    | {"hellinger": float(np.mean(distances))}
                )
    return pd.DataFrame(rows)


def _other_records(actors: dict[str, str]) -> dict[str, list[str]]:
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
                            | {
                                "low": edges[quantity][:-1],
                                "high": upper,
                                "share": histogram(values, edges[quantity]),
                            }
                        )
                    )
    return pd.concat(tables, ignore_index=True)
