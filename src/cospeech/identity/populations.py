"""What fusion by canonical correlation analysis gains, paired over many virtual populations.

Every population has its own voices, mouths and names. A gain is an equal error rate minus another one in the same
population, averaged over populations, with a bootstrap interval over them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data.rng import random_source
from cospeech.identity import features, sessions, strategies, verification
from cospeech.identity.classifiers import Settings
from cospeech.identity.controls import CONTROLS, PAIRED
from cospeech.identity.features import Features
from cospeech.identity.strategies import PLAIN
from cospeech.identity.verification import Bootstrap
from cospeech.metrics import bootstrap, equal_error

CLAIMED = ("audio + canonical", "audio + weak")
"""The strategies that the document proposes for fusion (2.3.2)."""

RATES = "usual"


def seed(run_seed: int, number: int) -> int:
    """Return the seed of one population."""
    return int(random_source(run_seed, "population", str(number)).integers(2**31))


def rates(
    number: int,
    given: Features,
    shift: int,
    settings: Settings,
    threshold: float,
    controls: Sequence[str],
    regularisation: float,
    own_seed: int,
) -> pd.DataFrame:
    """Return the rows of the table ``population_rates`` of one population, from a session of each partition.

    Parameters
    ----------
    number : of the population.
    given : its features, not synchronised.
    shift : by how much its lips are shifted, in frames.
    settings, threshold, controls, regularisation, own_seed : see ``strategies.of_session``.
    """
    own = features.shifted(given, shift)
    parts = []
    for session in sessions.sessions(own.clips)[::2]:
        found, _ = strategies.of_session(own, session, settings, [threshold], controls, regularisation, own_seed)
        parts += [strategies.trials(own, session, one) for one in found]
    trials = pd.concat(parts, ignore_index=True)
    rows = [
        (number, *key, 100.0 * equal_error.equal_error(verification.of_table(table), RATES).rate)
        for key, table in trials.groupby(["condition", "strategy"], sort=False)
    ]
    return pd.DataFrame(rows, columns=["population", "condition", "strategy", "eer_pct"])


def gains(every: pd.DataFrame, settings: Bootstrap) -> pd.DataFrame:
    """Return the table ``gains``: each claimed strategy against all without a transform, and against its controls.

    Parameters
    ----------
    every : the table ``population_rates``.
    settings : of the intervals over populations.
    """
    wide = every.pivot_table(index="population", columns=["condition", "strategy"], values="eer_pct")
    rows = []
    for strategy in CLAIMED:
        if (PAIRED, strategy) not in wide:
            continue
        others = [(PAIRED, name) for name in PLAIN] + [(name, strategy) for name in CONTROLS]
        for condition, other in others:
            if (condition, other) in wide:
                both = wide[[(PAIRED, strategy), (condition, other)]].dropna().to_numpy()
                rows.append(_row(strategy, other, condition, both[:, 1] - both[:, 0], settings))
    return pd.DataFrame(rows)


def _row(strategy: str, other: str, condition: str, gain: Any, settings: Bootstrap) -> dict[str, Any]:
    counts = bootstrap.draws(np.zeros(len(gain)), settings.samples, settings.seed, "populations")
    samples = bootstrap.ratios(gain[None], np.ones((1, len(gain))), counts)
    low, high = bootstrap.interval(samples, settings.level, [len(gain)], [1])
    return {
        "strategy": strategy,
        "other": other,
        "condition": condition,
        "gain": float(gain.mean()),
        "low": float(low[0]),
        "high": float(high[0]),
        "populations": len(gain),
    }
