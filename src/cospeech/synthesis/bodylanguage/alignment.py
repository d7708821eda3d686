"""Observations of speech go with the subunits that are active at the end of the next one (Levine 2009, 4.4)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.synthesis.bodylanguage.chain import Path
from cospeech.synthesis.bodylanguage.observations import Observed


def align(observed: Sequence[Observed], subunits: pd.DataFrame) -> Path:
    """Return the states of one section in a record: one step per observation, except the last.

    Subunits in which no observation ends are left out, as in the thesis, where they were less than 0.4 %.

    Parameters
    ----------
    observed : the observations of the record.
    subunits : the subunits of the section in the record (schema ``subunits``), in order of time.
    """
    end_s = np.array([one.end_s for one in observed[1:]])
    starts_s, ends_s = (subunits[name].to_numpy(dtype=float) for name in ("start_s", "end_s"))
    active = np.clip(np.searchsorted(starts_s, end_s, side="right") - 1, 0, len(subunits) - 1)
    elapsed = np.clip((end_s - starts_s[active]) / (ends_s[active] - starts_s[active]), 0.0, 1.0)
    return Path(
        np.array([one.observation for one in observed[:-1]], dtype=np.int64),
        subunits["cluster"].to_numpy(dtype=np.int64)[active],
        np.diff(active, prepend=-1) != 0,
        elapsed,
    )


def skipped_share(paths: Sequence[Path], n_subunits: int) -> float:
    """Return the share of the subunits of the records in which no observation ends."""
    return 1.0 - sum(int(path.start.sum()) for path in paths) / max(1, n_subunits)
