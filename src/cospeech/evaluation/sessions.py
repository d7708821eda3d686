"""Scores of synthesis sessions: means over the records of an actor, their intervals, and paired differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.evaluation.scores import BETTER
from cospeech.metrics import bootstrap

ALL = "all"
"""The name under which the records of all actors are pooled."""


_QUANTITY = ["phrases", "measure", "part", "bin_s"]
_GROUP = ["system", "variant", *_QUANTITY]


@dataclass(frozen=True)
class Bootstrap:
    """How intervals are drawn: number of samples, level, seed."""

    samples: int
    level: float
    seed: int


@dataclass(frozen=True)
class _Session:
    """The records of one actor (or of all) as sums: one row of each array a group, one column a record."""

    actor: str
    groups: pd.DataFrame
    numerators: Floats
    denominators: Floats
    n: npt.NDArray[np.int64]
    n_undefined: npt.NDArray[np.int64]
    strata: npt.NDArray[np.object_]


def session_scores(record_scores: pd.DataFrame, settings: Bootstrap) -> pd.DataFrame:
    """Return the mean of every measure over the records of each actor, and over all of them (actor ``all``).

    S is the plain mean over gestures and records, undefined values left out (Özkul 2012, eq. 7.3); every other
    measure is weighted by the duration of the records, as D is (eq. 7.4).

    Returns
    -------
    Columns system, variant, actor, phrases, measure, part, bin_s, value, low, high, n (values in the mean),
    n_undefined (left out), n_records (with a defined value, from which the interval is drawn).
    """
    tables = []
    for session in _sessions(record_scores):
        counts = bootstrap.draws(session.strata, settings.samples, settings.seed, session.actor)
        defined = session.denominators > 0
        n_records = defined.sum(axis=1)
        low, high = bootstrap.interval(
            bootstrap.ratios(session.numerators, session.denominators, counts),
            settings.level,
            n_records,
            _n_strata(defined, session.strata),
        )
        with np.errstate(invalid="ignore"):
            value = session.numerators.sum(axis=1) / session.denominators.sum(axis=1)
        found = {"value": value, "low": low, "high": high, "n": session.n, "n_undefined": session.n_undefined}
        tables.append(session.groups.assign(actor=session.actor, **found, n_records=n_records))
    return pd.concat(tables, ignore_index=True)


def differences(record_scores: pd.DataFrame, main: Mapping[str, str], settings: Bootstrap) -> pd.DataFrame:
    """Return the difference of every two systems, each in its main variant, paired by record.

    Planned phrases are compared with planned ones, and phrases seen in motion with such. The difference is that of
    the session scores over the records where both are defined; each bootstrap sample draws the same records for both.
    ``better`` says that the whole interval lies on the measure's good side of 0;
    it is missing where there is no interval or the measure has no good side.

    Returns
    -------
    Columns system, other, actor, phrases, measure, part, bin_s, difference (system - other), low, high, n (records)
    and better.
    """
    at_setting = record_scores[record_scores["variant"] == record_scores["system"].map(main)]
    tables = []
    for session in _sessions(at_setting):
        counts = bootstrap.draws(session.strata, settings.samples, settings.seed, session.actor)
        for _, rows in session.groups.groupby(_QUANTITY, dropna=False, sort=False):
            tables.append(_pairs(session, rows, counts, settings.level))
    return pd.concat(tables, ignore_index=True)


def _sessions(scores: pd.DataFrame) -> Iterator[_Session]:
    actors = list(dict.fromkeys(scores["actor"]))
    if ALL in actors:
        raise UserError(f"an actor is called '{ALL}', the name of all actors together; give the actor another name")
    weighted = scores.assign(
        defined=scores["value"].notna(),
        weight=np.where(scores["measure"] == "S", 1.0, scores["duration_s"]),
    )
    weighted["denominator"] = weighted["weight"].where(weighted["defined"], 0.0)
    weighted["numerator"] = (weighted["weight"] * weighted["value"]).where(weighted["defined"], 0.0)
    for actor in [*actors, ALL]:
        yield _session(actor, weighted if actor == ALL else weighted[weighted["actor"] == actor])


def _session(actor: str, scores: pd.DataFrame) -> _Session:
    owners = scores.drop_duplicates("record").set_index("record")["actor"]
    columns = pd.Index(owners.index).get_indexer(scores["record"])
    grouped = scores.groupby(_GROUP, dropna=False, sort=False)
    rows = grouped.ngroup().to_numpy()
    groups = scores.drop_duplicates(_GROUP)[_GROUP].reset_index(drop=True)

    def total(values: npt.ArrayLike) -> Floats:
        table = np.zeros((len(groups), len(owners)))
        np.add.at(table, (rows, columns), np.asarray(values, dtype=float))
        return table

    defined = total(scores["defined"]).sum(axis=1).astype(np.int64)
    return _Session(
        actor=actor,
        groups=groups,
        numerators=total(scores["numerator"]),
        denominators=total(scores["denominator"]),
        n=defined,
        n_undefined=grouped.size().to_numpy() - defined,
        strata=owners.to_numpy(dtype=object),
    )


def _n_strata(defined: npt.NDArray[np.bool_], strata: npt.NDArray[np.object_]) -> npt.NDArray[np.int64]:
    """Return how many actors have a record with a defined value, shape (G,)."""
    actors = sorted(set(strata.tolist()))
    return np.sum([defined[:, strata == actor].any(axis=1) for actor in actors], axis=0)


def _pairs(session: _Session, rows: pd.DataFrame, counts: bootstrap.Counts, level: float) -> pd.DataFrame:
    """Return the differences of all ordered pairs of systems in one measure of one session."""
    index = rows.index.to_numpy()
    first, second = np.triu_indices(len(index), k=1)
    both = (session.denominators[index[first]] > 0) & (session.denominators[index[second]] > 0)
    every = np.ones((1, counts.shape[1]))
    sides = [(session.numerators[index[k]] * both, session.denominators[index[k]] * both) for k in (first, second)]
    drawn = bootstrap.ratios(*sides[0], counts) - bootstrap.ratios(*sides[1], counts)
    difference = (bootstrap.ratios(*sides[0], every) - bootstrap.ratios(*sides[1], every))[:, 0]
    low, high = bootstrap.interval(drawn, level, both.sum(axis=1), _n_strata(both, session.strata))
    names = rows["system"].to_numpy(dtype=object)
    common = {key: rows[key].iloc[0] for key in _QUANTITY} | {"actor": session.actor, "n": both.sum(axis=1)}
    direction = BETTER[common["measure"]]

    def table(system: npt.NDArray[np.int64], other: npt.NDArray[np.int64], sign: int) -> pd.DataFrame:
        ends = (sign * low, sign * high)
        frame = pd.DataFrame(
            {"system": names[system], "other": names[other]}
            | common
            | {"difference": sign * difference, "low": ends[sign < 0], "high": ends[sign > 0]}
        )
        good_end = frame["low"] if direction > 0 else -frame["high"]
        decided = frame["low"].notna() & (direction != 0)
        return frame.assign(better=(good_end > 0).astype("boolean").where(decided))

    return pd.concat([table(first, second, 1), table(second, first, -1)], ignore_index=True)
