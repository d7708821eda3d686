"""The exhibits of Levine et al. 2010, by hand."""

import dataclasses

import pandas as pd
import plausible
import pytest
from matplotlib import pyplot as plt
from plausible import RUN

from cospeech.report.exhibits import controller

TABLES = {name: table for name, (table, _) in plausible.controller().items()}


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def test_scores_of_windows_are_means_over_records_and_the_best_is_compared():
    table = TABLES["windows"].copy()
    table.loc[table["record"] == "ada_3", "filtered"] -= 0.5
    means, figure, _ = controller.windows(RUN, table)
    row = means[(means["model"] == "hmm") & (means["window"] == 2)].iloc[0]
    assert row["filtered"] == pytest.approx(-1.7 - 1.6 - 0.25)
    assert row["n"] == 2
    assert [axis.get_xlabel() for axis in figure.axes] == ["input window in steps of 100 ms"] * 2
    best, better = controller.compare_windows(RUN, means, {"best_window": 4})
    assert (best.published, best.ours) == ("4", "4 (chain score), 4 (filtered score)")
    assert better.ours == "5 of 5 (filtered score)"


def test_regret_is_pooled_over_records_for_each_plan():
    one, two = TABLES["regret"], TABLES["regret"].assign(optimum=4.0)
    pooled, figure, _ = controller.regret(RUN, pd.concat([one, two]))
    own = pooled[pooled["plan"] == "states"]
    assert own["regret"].iloc[0] == pytest.approx(2.6 / 3.0 - 1.0)
    states, situations = figure.axes[0].get_lines()
    assert states.get_ydata()[0] == pytest.approx(100 * (2.6 / 3.0 - 1.0))
    assert (len(states.get_xdata()), len(situations.get_xdata())) == (6, 1)


def test_facts_of_the_control_layer_are_percentages_or_counts_or_empty():
    facts = controller.control_layer(RUN, TABLES["control_layer"]).numbers
    rows = dict(controller.control_table(RUN, facts).rows)
    assert rows["share of the value table that pruning would keep"] == "6.0 %"
    assert rows["motion segments"] == "220"
    assert rows["mean shortfall of values that are combined linearly for half a style"] == ""
    states, pruned = controller.compare_control(RUN, facts, {"states": 25, "pruned_pct": 98})
    assert (states.published, states.ours) == ("25", "9")
    assert (pruned.published, pruned.ours) == ("about 98 %", "94.0 %")


def test_training_times_stand_next_to_those_of_the_same_library():
    published = {"controller-table-1": {"training_s": [4110, 307, 372, 230, 725, 7]}}
    run = dataclasses.replace(RUN, published=published)
    rows = controller.library_table(run, TABLES["controller_libraries"]).rows
    assert rows[0] == ["standard", "706 s", "900", "2", "0.90 s", "4110 s (Standard library)"]
    assert rows[1] == ["creature with eight limbs", "51 s", "60", "8", "0.02 s", "7 s (Octopus)"]
    assert rows[2] == ["own", "30 s", "40", "2", "0.01 s", ""]
    pairs = controller.compare_libraries(RUN, TABLES["controller_libraries"], published["controller-table-1"])
    assert [pair.what for pair in pairs] == ["training time, Standard library", "training time, Octopus"]
    assert pairs[1].published == "7 s (Core i7, 2.66 GHz)"


def test_a_strip_has_a_row_per_library_and_a_picture_per_time():
    numbers, figure, _ = controller.strips(RUN, TABLES["controller_strips"])
    assert numbers["joints"].tolist() == [4, 4, 4]
    assert len(figure.axes) == 3 * 4
    assert all(len(axis.get_lines()) == 3 for axis in figure.axes)
