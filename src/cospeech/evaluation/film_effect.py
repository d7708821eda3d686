"""What filming costs the experiment: scores from filmed joint angles beside those from the true ones."""

from __future__ import annotations

import pandas as pd

KEY = ["system", "clusters", "states", "actor", "measure", "part", "bin_s"]


def film_effect(filmed: pd.DataFrame, true: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``film_effect`` of two tables ``session_scores``, over what both hold.

    The difference is relative to the true score, in percent, and missing where that is 0 or undefined.
    """
    both = filmed.merge(true[[*KEY, "value"]], on=KEY, suffixes=("", "_true"), validate="1:1")
    size = both["value_true"].abs()
    relative = 100.0 * (both["value"] - both["value_true"]) / size.where(size > 0)
    table = both.assign(filmed=both["value"], planted=both["value_true"], difference_pct=relative)
    return table[[*KEY, "filmed", "planted", "difference_pct", "n_records"]]
