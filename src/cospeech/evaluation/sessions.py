"""Scores of synthesis sessions: means over the records of an actor, their intervals, and paired differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Flags, Floats, Integers
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
    """The records of one actor (or of all) as sums, (groups, records, draws), and their bootstrap samples."""

    actor: str
    groups: pd.DataFrame
    numerators: Floats
    denominators: Floats
    n: npt.NDArray[np.int64]
    n_undefined: npt.NDArray[np.int64]
    n_draws: npt.NDArray[np.int64]
    strata: npt.NDArray[np.object_]
    settings: Bootstrap
    _weights: dict[tuple[int, ...], Floats] = field(default_factory=dict)

    @cached_property
    def _counts(self) -> bootstrap.Counts:
        return bootstrap.draws(self.strata, self.settings.samples, self.settings.seed, self.actor)

    def _weights_of(self, n_draws: Integers) -> Floats:
        """Return the weight of each draw in each bootstrap sample, (samples, R * K)."""
        key = tuple(n_draws.tolist())
        if key not in self._weights:
            weights = bootstrap.within(self._counts, n_draws, self.settings.seed, self.actor)
            self._weights[key] = weights.reshape(len(weights), -1)
        return self._weights[key]

    def means(self, groups: Integers, records: Flags) -> Floats:
        """Return the mean of some groups, (N,), each over its own selection of records, (N, R)."""
        share = records[:, :, None] / np.maximum(self.n_draws[groups], 1)[:, :, None]
        above, below = (
            (table[groups] * share).sum(axis=2).sum(axis=1) for table in (self.numerators, self.denominators)
        )
        with np.errstate(invalid="ignore"):
            return np.asarray(above / below, dtype=float)

    def sampled(self, groups: Integers, records: Flags) -> Floats:
        """Return the means of ``means`` in every bootstrap sample, (N, samples)."""
        found = np.empty((len(groups), self.settings.samples))
        layouts, layout = np.unique(self.n_draws[groups], axis=0, return_inverse=True)
        for place, n_draws in enumerate(layouts):
            chosen = np.flatnonzero(layout.reshape(-1) == place)
            most = max(1, int(n_draws.max()))
            above, below = (
                (table[groups[chosen], :, :most] * records[chosen][:, :, None]).reshape(len(chosen), -1)
                for table in (self.numerators, self.denominators)
            )
            found[chosen] = bootstrap.ratios(above, below, self._weights_of(n_draws))
        return found


def session_scores(record_scores: pd.DataFrame, settings: Bootstrap) -> pd.DataFrame:
    """Return the mean of every measure over the records of each actor, and over all of them (actor ``all``).

    S is the mean over gestures and records without undefined values (Özkul 2012, eq. 7.3). Every other measure is
    weighted by the duration of the records, like D (eq. 7.4). The draws of a control share the weight of their
    record. Intervals are those of a hierarchical bootstrap over records, and over the draws within each record.

    Returns
    -------
    Columns system, variant, actor, phrases, measure, part, bin_s, value, low, high, n (values in the mean),
    n_undefined (left out), n_records (with a defined value, from which the interval is drawn), fewest_draws and
    most_draws (per record).
    """
    tables = []
    for session in _sessions(record_scores, settings):
        defined = np.any(session.denominators > 0, axis=2)
        n_records = defined.sum(axis=1)
        every = np.arange(len(session.groups))
        low, high = bootstrap.interval(
            session.sampled(every, np.ones_like(defined)),
            settings.level,
            n_records,
            _n_strata(defined, session.strata),
        )
        value = session.means(every, np.ones_like(defined))
        found = {"value": value, "low": low, "high": high, "n": session.n, "n_undefined": session.n_undefined}
        some = np.where(session.n_draws > 0, session.n_draws, session.n_draws.max(axis=1, keepdims=True))
        spread = {"fewest_draws": some.min(axis=1), "most_draws": some.max(axis=1)}
        tables.append(session.groups.assign(actor=session.actor, **found, n_records=n_records, **spread))
    return pd.concat(tables, ignore_index=True)


def differences(record_scores: pd.DataFrame, main: Mapping[str, str], settings: Bootstrap) -> pd.DataFrame:
    """Return the difference of every two systems, each in its main variant, paired by record.

    Planned phrases are compared with planned ones, and phrases seen in motion with phrases seen in motion. The
    difference is that of the session scores over the records for which both are defined. Each bootstrap sample draws
    the same records for both, and the same draws within them if both have equally many. ``better`` says whether the
    whole interval lies on the measure's good side of 0; it is missing if there is no interval or the measure has no
    good side.

    Returns
    -------
    Columns system, other, actor, phrases, measure, part, bin_s, difference (system - other), low, high, p_value (not
    corrected for the number of comparisons), n (records) and better.
    """
    at_setting = record_scores[record_scores["variant"] == record_scores["system"].map(main)]
    tables = []
    for session in _sessions(at_setting, settings):
        for _, rows in session.groups.groupby(_QUANTITY, dropna=False, sort=False):
            tables.append(_pairs(session, rows))
    return pd.concat(tables, ignore_index=True)


def _sessions(scores: pd.DataFrame, settings: Bootstrap) -> Iterator[_Session]:
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
        yield _session(actor, weighted if actor == ALL else weighted[weighted["actor"] == actor], settings)


def _session(actor: str, scores: pd.DataFrame, settings: Bootstrap) -> _Session:
    owners = scores.drop_duplicates("record").set_index("record")["actor"]
    columns = pd.Index(owners.index).get_indexer(scores["record"])
    grouped = scores.groupby(_GROUP, dropna=False, sort=False)
    rows = grouped.ngroup().to_numpy()
    groups = scores.drop_duplicates(_GROUP)[_GROUP].reset_index(drop=True)
    draws = scores["draw"].to_numpy()
    n_draws = np.zeros((len(groups), len(owners)), dtype=np.int64)
    np.maximum.at(n_draws, (rows, columns), draws + 1)

    def total(values: npt.ArrayLike) -> Floats:
        table = np.zeros((*n_draws.shape, int(draws.max()) + 1))
        np.add.at(table, (rows, columns, draws), np.asarray(values, dtype=float))
        return table

    defined = total(scores["defined"]).sum(axis=(1, 2)).astype(np.int64)
    return _Session(
        actor=actor,
        groups=groups,
        numerators=total(scores["numerator"]),
        denominators=total(scores["denominator"]),
        n=defined,
        n_undefined=grouped.size().to_numpy() - defined,
        n_draws=n_draws,
        strata=owners.to_numpy(dtype=object),
        settings=settings,
    )


def _n_strata(defined: npt.NDArray[np.bool_], strata: npt.NDArray[np.object_]) -> npt.NDArray[np.int64]:
    """Return how many actors have a record with a defined value, shape (G,)."""
    actors = sorted(set(strata.tolist()))
    return np.sum([defined[:, strata == actor].any(axis=1) for actor in actors], axis=0)


def _pairs(session: _Session, rows: pd.DataFrame) -> pd.DataFrame:
    """Return the differences of all ordered pairs of systems in one measure of one session."""
    index = rows.index.to_numpy()
    first, second = np.triu_indices(len(index), k=1)
    defined = np.any(session.denominators[index] > 0, axis=2)
    both = defined[first] & defined[second]
    # Each system is compared with many others over the same records, mostly over all.
    sides = np.concatenate([np.column_stack([index[k], both]) for k in (first, second)])
    distinct, place = np.unique(sides, axis=0, return_inverse=True)
    groups, records = distinct[:, 0], distinct[:, 1:].astype(bool)
    of_side = np.split(place.reshape(-1), 2)
    drawn, difference = (
        found[of_side[0]] - found[of_side[1]]
        for found in (session.sampled(groups, records), session.means(groups, records))
    )
    n_records, n_strata = both.sum(axis=1), _n_strata(both, session.strata)
    low, high = bootstrap.interval(drawn, session.settings.level, n_records, n_strata)
    p_values = bootstrap.p_values(difference, drawn, n_records, n_strata)
    names = rows["system"].to_numpy(dtype=object)
    common = {key: rows[key].iloc[0] for key in _QUANTITY} | {"actor": session.actor, "n": n_records}
    direction = BETTER[common["measure"]]

    def table(system: npt.NDArray[np.int64], other: npt.NDArray[np.int64], sign: int) -> pd.DataFrame:
        ends = (sign * low, sign * high)
        frame = pd.DataFrame(
            {"system": names[system], "other": names[other]}
            | common
            | {"difference": sign * difference, "low": ends[sign < 0], "high": ends[sign > 0], "p_value": p_values}
        )
        good_end = frame["low"] if direction > 0 else -frame["high"]
        decided = frame["low"].notna() & (direction != 0)
        return frame.assign(better=(good_end > 0).astype("boolean").where(decided))

    return pd.concat([table(first, second, 1), table(second, first, -1)], ignore_index=True)
