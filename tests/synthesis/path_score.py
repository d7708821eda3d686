"""The score of a path of the HSMM, by somebody who has nothing but its tables."""

import itertools
import math


def score_by_rows(model_tables, phrases, observed, weight, censoring="none"):
    """The score of a segment table, looked up row by row; minus infinity for what the model cannot do."""
    look = {
        "initial": model_tables["initial"].set_index("gesture")["probability"].to_dict(),
        "transitions": model_tables["transitions"].set_index(["from_gesture", "to_gesture"])["probability"].to_dict(),
        "emissions": model_tables["emissions"].set_index(["gesture", "prosody"])["probability"].to_dict(),
        "durations": model_tables["durations"].set_index(["gesture", "bin"])["probability"].to_dict(),
    }
    n_bins = int(model_tables["durations"]["bin"].max())
    rows = list(phrases.itertuples())
    if max(row.end_frame - row.start_frame for row in rows) > n_bins:
        return -math.inf
    terms = [math.log(look["initial"][rows[0].label])]
    terms += [math.log(look["transitions"][before.label, after.label]) for before, after in itertools.pairwise(rows)]
    for row in rows:
        length = row.end_frame - row.start_frame
        longer = range(length, n_bins + 1) if row is rows[-1] and censoring == "right" else [length]
        terms.append(math.log(min(1.0, math.fsum(look["durations"][row.label, k] for k in longer))))
        terms += [
            weight * math.log(look["emissions"][row.label, observed[t]])
            for t in range(row.start_frame, row.end_frame)
        ]
    return math.fsum(terms)
