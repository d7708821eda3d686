"""The exhibits of Levine 2009, by hand."""

import pandas as pd
import plausible
from matplotlib import pyplot as plt
from plausible import RUN

from cospeech.report.exhibits import body_language

TABLES = {name: table for name, (table, _) in plausible.body_language().items()}


def test_subunits_and_clusters_are_counted_by_section():
    counts = body_language.subunits(RUN, TABLES["subunits"]).numbers
    assert counts["segments"].tolist() == [40, 40, 40]
    assert counts["clusters"].tolist() == [3, 4, 2]
    assert body_language.subunit_table(RUN, counts).rows[2] == ["lower body", "40", "2", "20.0"]
    (pair,) = body_language.compare_subunits(RUN, counts, {"lower_body_clusters": 3})
    assert (pair.published, pair.ours) == ("3 (training set II)", "2")


def test_observations_that_can_occur_are_listed_with_their_shares():
    table = TABLES["occurrences"].assign(count=0)
    table.loc[table["observation"].isin([5, 6]), "count"] = [3, 1]
    found = body_language.occurrences(RUN, table).numbers
    assert len(found) == 26
    assert found.loc[found["count"] > 0, "share_pct"].tolist() == [75.0, 25.0]
    assert body_language.occurrence_table(RUN, found).rows[:2] == [
        ["standard", "long", "no", "no", "3", "75.0"],
        ["high", "short", "no", "no", "1", "25.0"],
    ]
    (pair,) = body_language.compare_occurrences(RUN, found, {"combinations": 36, "occurring": 26})
    assert pair.ours == "26 of 36 are possible, 2 occur"


def test_selected_states_are_listed_with_the_largest_probability():
    rows = [
        ("arms", 0, 0.2, 0, True, 0.7, True, False),
        ("arms", 0, 0.2, 0, False, 0.3, False, True),
        ("arms", 1, 0.4, 0, True, 0.1, True, True),
        ("arms", 1, 0.4, 0, False, 0.9, False, False),
    ]
    names = ["section", "step", "time_s", "cluster", "start", "forward", "by_direct", "by_product"]
    found = body_language.selected(pd.DataFrame(rows, columns=names))
    assert found[["rule", "step", "start", "forward", "largest"]].to_numpy().tolist() == [
        ["direct", 0, True, 0.7, 0.7],
        ["direct", 1, True, 0.1, 0.9],
        ["product", 0, False, 0.3, 0.7],
        ["product", 1, True, 0.1, 0.9],
    ]


def test_figures_show_every_cluster_that_has_a_fit():
    drawn = body_language.continuations(RUN, TABLES["clusters"])
    lines = [len(axis.lines) for axis in drawn.figure.axes]
    assert lines == [3 + 2, 4 + 3, 2 + 1]
    plt.close("all")
    assert len(body_language.elapsed_table(RUN, TABLES["elapsed"]).rows) == 6
