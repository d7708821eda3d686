"""Effect of filming on the experiment: scores with joint angles from films, compared with the planted angles."""

from __future__ import annotations

import pandas as pd

from cospeech.evaluation import sessions

KEY = ["system", "variant", "actor", "measure", "part", "bin_s"]
QUANTITY = ["actor", "measure", "part", "bin_s"]


def film_effect(filmed: pd.DataFrame, true: pd.DataFrame, settings: sessions.Bootstrap) -> pd.DataFrame:
    """Return session scores with filmed and with planted joint angles, and their difference (schema ``film_effect``).

    The two sets of scores are compared like those of two systems: paired by record, with bootstrap intervals over
    records. The difference is relative to the score with planted angles, in percent; it is null if that score is 0 or
    undefined.

    Parameters
    ----------
    filmed : scores with joint angles from films (schema ``record_scores``).
    true : scores with the planted joint angles (schema ``record_scores``), for one system and setting; only the rows
        of ``filmed`` with that system and setting are used.
    settings : settings of the bootstrap.
    """
    system, variant = true[["system", "variant"]].iloc[0]
    same = filmed[(filmed["system"] == system) & (filmed["variant"] == variant) & (filmed["phrases"] == "planned")]
    both = pd.concat([same.assign(system="filmed"), true.assign(system="planted")], ignore_index=True)
    scores = sessions.session_scores(both, settings)
    filmed_scores, true_scores = (scores[scores["system"] == side] for side in ("filmed", "planted"))
    pairs = sessions.differences(both, {"filmed": variant, "planted": variant}, settings)
    table = (
        filmed_scores.merge(true_scores[[*QUANTITY, "value"]], on=QUANTITY, suffixes=("", "_true"), validate="1:1")
        .merge(pairs[pairs["system"] == "filmed"], on=QUANTITY, suffixes=("", "_apart"), validate="1:1")
        .assign(system=system)
    )
    magnitude = table["value_true"].abs()
    to_percent = 100.0 / magnitude.where(magnitude > 0)
    return table.assign(
        filmed=table["value"],
        planted=table["value_true"],
        difference_pct=to_percent * (table["value"] - table["value_true"]),
        low_pct=to_percent * table["low_apart"],
        high_pct=to_percent * table["high_apart"],
    )[[*KEY, "filmed", "planted", "difference_pct", "low_pct", "high_pct", "n_records"]]
