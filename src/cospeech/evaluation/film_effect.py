"""What filming costs the experiment: scores from filmed joint angles beside those from the true ones."""

from __future__ import annotations

import pandas as pd

from cospeech.evaluation import sessions

KEY = ["system", "variant", "actor", "measure", "part", "bin_s"]
QUANTITY = ["actor", "measure", "part", "bin_s"]


def film_effect(filmed: pd.DataFrame, true: pd.DataFrame, settings: sessions.Bootstrap) -> pd.DataFrame:
    """Return the table ``film_effect``: session scores from films and from true angles, and their difference.

    The two are held against each other as two systems are: paired by record, with intervals over the records. The
    difference is relative to the true score, in percent, and missing where that is 0 or undefined.

    Parameters
    ----------
    filmed : the table ``record_scores``.
    true : the same of one system and setting, which tells those of ``filmed`` that count.
    """
    system, variant = true[["system", "variant"]].iloc[0]
    own = filmed[(filmed["system"] == system) & (filmed["variant"] == variant) & (filmed["phrases"] == "planned")]
    both = pd.concat([own.assign(system="filmed"), true.assign(system="planted")], ignore_index=True)
    scores = sessions.session_scores(both, settings)
    filmed_scores, true_scores = (scores[scores["system"] == side] for side in ("filmed", "planted"))
    pairs = sessions.differences(both, {"filmed": variant, "planted": variant}, settings)
    table = (
        filmed_scores.merge(true_scores[[*QUANTITY, "value"]], on=QUANTITY, suffixes=("", "_true"), validate="1:1")
        .merge(pairs[pairs["system"] == "filmed"], on=QUANTITY, suffixes=("", "_apart"), validate="1:1")
        .assign(system=system)
    )
    size = table["value_true"].abs()
    relative = 100.0 / size.where(size > 0)
    return table.assign(
        filmed=table["value"],
        planted=table["value_true"],
        difference_pct=relative * (table["value"] - table["value_true"]),
        low_pct=relative * table["low_apart"],
        high_pct=relative * table["high_apart"],
    )[[*KEY, "filmed", "planted", "difference_pct", "low_pct", "high_pct", "n_records"]]
