"""Error rates of open-set identification, from trials (Sargin 2006, 2.1.1 and 2.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import pandas as pd

from cospeech.data.arrays import Integers
from cospeech.identity.controls import PAIRED
from cospeech.metrics import bootstrap, equal_error
from cospeech.metrics.equal_error import RATES, Trials

STRATEGY = ["condition", "strategy", "threshold"]
"""The columns of a table of trials that name a strategy."""


class Bootstrap(NamedTuple):
    """How intervals are computed: number of samples of speakers, level, and seed."""

    samples: int
    level: float
    seed: int


def of_table(trials: pd.DataFrame) -> Trials:
    """Return the trials of a table of trials."""
    client = trials["speaker"].notna().to_numpy()
    right = (trials["speaker"] == trials["best_speaker"]).to_numpy(dtype=bool)
    return Trials(trials["score"].to_numpy(dtype=float), client, client & right)


def equal_error_rates(trials: pd.DataFrame, clips: pd.DataFrame, settings: Bootstrap) -> pd.DataFrame:
    """Return the table ``equal_error_rates``: of each session, and of all trials under one threshold.

    Whoever speaks in a trial, as a client or as an impostor, is drawn with all trials. The interval is that of
    ``bootstrap.interval``.

    Parameters
    ----------
    trials : the table ``trials``. clips : the table ``clips``.
    settings : of the intervals.
    """
    talker = trials["trial"].map(clips.set_index("clip")["speaker"])
    group, names = pd.factorize(talker, sort=True)
    drawn = bootstrap.draws(np.zeros(len(names)), settings.samples, settings.seed, "equal error rates")
    session, every = trials["session"].to_numpy(dtype=object), of_table(trials)
    dimension = trials["dimension"].to_numpy(dtype=float, na_value=np.nan)
    rows = []
    strategies = trials.groupby(STRATEGY, sort=False, dropna=False).indices
    for key, members in cast("Mapping[tuple[Any, ...], Integers]", strategies).items():
        of_session = session[members]
        parts = {None: members} | {name: members[of_session == name] for name in dict.fromkeys(of_session)}
        for name, own in parts.items():
            table = Trials(every.score[own], every.client[own], every.right[own])
            for rates in RATES:
                found = equal_error.equal_error(table, rates).rate
                samples = equal_error.bootstrapped(table, rates, group[own], drawn)
                low, high = bootstrap.interval(samples[None], settings.level, [len(names)], [1])
                row = (name, *key, dimension[own].max(), rates, 100.0 * found, 100.0 * low[0], 100.0 * high[0])
                rows.append((*row, len(own)))
    columns = ["session", *STRATEGY, "dimension", "rates", "eer_pct", "low", "high", "trials"]
    return pd.DataFrame(rows, columns=columns).astype({"dimension": "Int64"})


def det(trials: pd.DataFrame, chosen: Sequence[tuple[str, float]]) -> pd.DataFrame:
    """Return the table ``det``: false rejects against false accepts of some strategies, all sessions together.

    Parameters
    ----------
    trials : the table ``trials``.
    chosen : names of strategies, each with its threshold of the canonical correlations (NaN: none).
    """
    parts = []
    for strategy, threshold in chosen:
        same = trials["threshold"].isna() if np.isnan(threshold) else trials["threshold"] == threshold
        own = trials[(trials["condition"] == PAIRED) & (trials["strategy"] == strategy) & same]
        for rates in RATES:
            points = equal_error.curve(of_table(own), rates)
            parts.append(
                pd.DataFrame(
                    {
                        "strategy": strategy,
                        "threshold": threshold,
                        "rates": rates,
                        "point": np.arange(len(points.threshold)),
                        "false_accept_pct": 100.0 * points.false_accept,
                        "false_reject_pct": 100.0 * points.false_reject,
                    }
                )
            )
    return pd.concat(parts, ignore_index=True)


def best_thresholds(rates: pd.DataFrame, condition: str = PAIRED) -> pd.DataFrame:
    """Return the row of each strategy at its best threshold: by rates as printed, of all sessions together."""
    own = rates[(rates["condition"] == condition) & (rates["rates"] == RATES[0]) & rates["session"].isna()]
    return own.loc[own.groupby("strategy", sort=False)["eer_pct"].idxmin().dropna()]


def shown(rates: pd.DataFrame) -> list[tuple[str, float]]:
    """Return the strategies whose operating points are drawn, each at its best threshold (NaN: it has none)."""
    best = best_thresholds(rates)
    return [
        (str(name), float(threshold)) for name, threshold in zip(best["strategy"], best["threshold"], strict=True)
    ]


def lacking(clips: pd.DataFrame) -> list[str]:
    """Return one line for each speaker who cannot be registered, and for those whose name no impostor says."""
    own = clips[clips["own_name"]]
    counts = own.groupby("speaker", sort=True).size()
    found = [
        f"speaker '{name}' has a single repetition of the own name, and is not registered: one is trained on and "
        "another one tested; add a clip"
        for name in counts[counts < 2].index
    ]
    claimed = set(clips.loc[~clips["own_name"], "phrase"])
    phrase = own.drop_duplicates("speaker").set_index("speaker")["phrase"]
    alone = [str(name) for name, said in phrase.items() if said not in claimed]
    if alone and not claimed:
        return [
            *found,
            "no clip is that of an impostor, who says the name of somebody else: only rejects are counted",
        ]
    return found + [f"speaker '{name}' has no impostors: nobody else says this name; add a clip" for name in alone]
