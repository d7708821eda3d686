"""Error rates of early fusion with the lips shifted (Sargin 2006, fig. 2.1b)."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from threadpoolctl import threadpool_limits

from cospeech.identity import controls, features, sessions, strategies, verification
from cospeech.identity.classifiers import Settings
from cospeech.identity.features import RATE_HZ, Features
from cospeech.identity.strategies import Scored
from cospeech.identity.verification import Bootstrap

EARLY = "concatenated"


def equal_error_rates(
    given: Features, shifts_ms: Sequence[int], settings: Settings, bootstrap: Bootstrap
) -> pd.DataFrame:
    """Return the table ``shift_rates``: concatenated features in all four sessions together, at each shift.

    Parameters
    ----------
    given : features of all clips, not synchronised.
    shifts_ms : by how much the lips are shifted, multiples of 10 ms.
    settings : of the word models.
    bootstrap : of the intervals.
    """
    parts = []
    with threadpool_limits(1, "blas"):
        for shift_ms in shifts_ms:
            own = features.shifted(given, round(shift_ms * RATE_HZ / 1000.0))
            trials = pd.concat([_trials(own, session, settings) for session in sessions.sessions(own.clips)])
            rates = verification.equal_error_rates(trials, own.clips, bootstrap)
            parts.append(rates[rates["session"].isna()].assign(shift_ms=shift_ms))
    return pd.concat(parts, ignore_index=True)[["shift_ms", "rates", "eer_pct", "low", "high"]]


def _trials(own: Features, session: sessions.Session, settings: Settings) -> pd.DataFrame:
    training = own.chosen(session.train)
    models = strategies.train_plain(training, session.owner, len(session.speakers), settings, [EARLY])
    best, score = strategies.best(strategies.plain_ratios(own.chosen(session.test), models)[EARLY])
    return strategies.trials(own, session, Scored(controls.PAIRED, EARLY, None, best, score))
