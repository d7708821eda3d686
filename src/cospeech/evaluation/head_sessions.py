"""Scores of heads over all records of a run, differences between systems, and their intervals.

Both are given over records and over minutes. A few stories say little about further stories, and the minutes of one
story are not independent: the truth lies between the two intervals.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.evaluation import head
from cospeech.evaluation.sessions import Bootstrap
from cospeech.metrics import bootstrap
from cospeech.motion.head import frame_rate

UNITS = {"record": ["actor", "record"], "minute": ["actor", "record", "minute"]}
"""What intervals are over, and the columns that tell one unit from another."""

KEY = ["measure", "lag_s"]

COLUMNS = ["system", "variant", "other", "measure", "lag_s", "unit", "value", "low", "high", "n"]


def scored(original: pd.DataFrame, made: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of a head, of the whole record and of each of its minutes: measure, lag_s, minute and value.

    Parameters
    ----------
    original, made : angles of the head of the same frames (schema ``head``).
    """
    whole = head.scores(original, made)
    parts, spans = [whole.assign(minute=None)], minutes(len(original), frame_rate(original))
    for minute, (start, end) in enumerate(spans):
        own = (table.iloc[start:end].reset_index(drop=True) for table in (original, made))
        found = head.scores(*own) if len(spans) > 1 else whole
        parts.append(found.assign(minute=minute))
    return pd.concat(parts, ignore_index=True).astype({"minute": "Int64"})


def table(scores: pd.DataFrame, compared: Mapping[str, Iterable[str]], settings: Bootstrap) -> pd.DataFrame:
    """Return means of all systems, and differences between some of them (schema ``head_sessions``).

    Draws of a control are averaged before anything else. A difference is the mean over the units that both have; none
    is returned of measures over the lag.

    Parameters
    ----------
    scores : scores of all draws (schema ``head_scores``).
    compared : by system, the others that are subtracted from it.
    """
    variants = scores.groupby("system", sort=False)["variant"].first()
    alone = [(name, None) for name in variants.index]
    both = [(name, other) for name, others in compared.items() for other in others]
    rows = []
    for unit, columns in UNITS.items():
        own = scores[scores["minute"].isna() == (unit == "record")]
        for key, part in own.groupby(KEY, sort=False, dropna=False):
            wide = part.pivot_table(index=columns, columns="system", values="value", aggfunc="mean", sort=True)
            actors = wide.index.get_level_values("actor")
            counts = bootstrap.draws(actors, settings.samples, settings.seed, f"heads {unit}")
            over_lag = part["lag_s"].notna().any()
            for name, other in [*alone, *([] if over_lag else both)]:
                if name in wide and (other is None or other in wide):
                    values = wide[name] - (wide[other] if other is not None else 0.0)
                    named = {"system": name, "variant": variants[name], "other": other, "unit": unit}
                    rows.append(named | dict(zip(KEY, key, strict=True)) | _mean(values, counts, settings.level))
    return pd.DataFrame(rows).reindex(columns=COLUMNS)


def _mean(values: pd.Series, counts: Floats, level: float) -> dict[str, float]:
    """Return the mean of the values of units and its interval."""
    known = values.notna().to_numpy()
    n_units = int(known.sum())
    if n_units == 0:
        return {"value": np.nan, "low": np.nan, "high": np.nan, "n": 0}
    actors = values.index.get_level_values("actor")[known].nunique()
    filled = np.where(known, values.to_numpy(dtype=float), 0.0)[None, :]
    sampled = bootstrap.ratios(filled, known[None, :].astype(float), counts)
    low, high = bootstrap.interval(sampled, level, [n_units], [actors])
    return {"value": float(values.mean()), "low": float(low[0]), "high": float(high[0]), "n": n_units}


def minutes(n_frames: int, fps: float) -> list[tuple[int, int]]:
    """Return the first frame of each minute of a record and the first frame after it.

    The last one ends with the record, and is longer by what remains if that is less than half a minute.
    """
    length = round(60.0 * fps)
    n_minutes = max(1, int((n_frames + length / 2) // length))
    edges = [*(minute * length for minute in range(n_minutes)), n_frames]
    return [(start, end) for start, end in pairwise(edges)]


def pairs(systems: Mapping[str, tuple[str, Iterable[str]]]) -> dict[str, list[str]]:
    """Return what each system is compared with: its own controls, those of no system, and the systems before it.

    Parameters
    ----------
    systems : role and matched controls of each system, in the order of every table.
    """
    matched = {control for _, controls in systems.values() for control in controls}
    general = [name for name, (role, _) in systems.items() if role == "control" and name not in matched]
    listening = [name for name, (role, _) in systems.items() if role == "system"]
    return {name: [*systems[name][1], *general, *listening[:place]] for place, name in enumerate(listening)}
