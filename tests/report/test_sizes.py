"""Figures of few and of many actors and systems: no text lies over another."""

import itertools

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import plausible
import plausible_heads
import pytest
from matplotlib.text import Text
from plausible import RUN

from cospeech.data.vocabulary import GESTURES
from cospeech.report import systems, words
from cospeech.report.exhibits import (
    differences,
    head,
    head_scores,
    leaderboard,
    motion,
    phrases,
    recovery,
    sweep,
    timeline,
    worlds,
)
from cospeech.report.exhibits.run import Run

CLEARANCE_PX = 0.5

FEW_OR_MANY = [pytest.param(2, marks=pytest.mark.slow), 12]
"""Numbers of systems: the many are tested always, the few with the slow tests."""


def corners(text):
    """The corners (4, 2) of the box around a text, in pixels, turned as it is."""
    around = text.get_window_extent()
    angle = text.get_rotation()
    text.set_rotation(0)
    flat = text.get_window_extent()
    text.set_rotation(angle)
    half = np.array([flat.width, flat.height]) / 2 - CLEARANCE_PX
    turn = np.radians(angle)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    middle = [(around.x0 + around.x1) / 2, (around.y0 + around.y1) / 2]
    return middle + (np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half) @ axes


def apart(one, other):
    """Whether two convex outlines are separated along a side of one of them."""
    for outline in (one, other):
        for side in np.diff(np.vstack([outline, outline[:1]]), axis=0)[:2]:
            a, b = one @ side, other @ side
            if a.max() <= b.min() or b.max() <= a.min():
                return True
    return False


def close(outlines):
    """The pairs of outlines whose upright boxes overlap."""
    low, high = np.min(outlines, axis=1), np.max(outlines, axis=1)
    overlap = (low[:, None] < high[None]).all(axis=2) & (low[None] < high[:, None]).all(axis=2)
    return np.argwhere(np.triu(overlap, 1))


def out_of_view(figure):
    """The labels of ticks beyond the ends of an axis, which are not drawn."""
    labels = set()
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        low, high = sorted(axis.get_transform().transform(axis.get_view_interval()))
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            place = axis.get_transform().transform([tick.get_loc()])[0]
            if not low - 1e-9 * (high - low) <= place <= high + 1e-9 * (high - low):
                labels |= {tick.label1, tick.label2}
    return labels


def overlapping(figure):
    """The pairs of texts of a figure that lie over each other."""
    figure.draw_without_rendering()
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    unseen = out_of_view(figure)
    shown = [text for text in shown if text not in unseen and (text.axes is None or text.axes.axison)]
    outlines = [corners(text) for text in shown]
    found = [
        (shown[a].get_text(), shown[b].get_text()) for a, b in close(outlines) if not apart(outlines[a], outlines[b])
    ]
    plt.close(figure)
    return found


def test_texts_over_each_other_are_found():
    figure = plt.figure()
    figure.text(0.5, 0.5, "one text")
    figure.text(0.52, 0.5, "another")
    figure.text(0.1, 0.1, "far away")
    assert overlapping(figure) == [("one text", "another")]


def sequences(n_actors, n_systems):
    """Phrases of some actors with two records each, actual and by some systems."""
    actors = {f"actor_{a}_{k}": f"actor_{a}" for a in range(n_actors) for k in range(2)}
    names = ["actual", *(f"system_{k}" for k in range(n_systems))]
    tables = {}
    for place, name in enumerate(names):
        drawn = [
            plausible.draw_phrases(record, np.random.default_rng([place, number]))
            for number, record in enumerate(actors)
        ]
        tables[name] = pd.concat(drawn, ignore_index=True)
    return actors, tables


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
@pytest.mark.parametrize("n_actors", [1, 2, 7, pytest.param(20, marks=pytest.mark.slow)])
def test_gesture_frequencies(n_actors, n_systems):
    actors, tables = sequences(n_actors, n_systems)
    titles = {name: f"System number {name}, of some length" for name in tables}
    table = phrases.shares(tables, actors, list(GESTURES))
    assert overlapping(phrases.frequency_figure(table, titles)) == []


@pytest.mark.parametrize("n_systems", [1, 3, pytest.param(12, marks=pytest.mark.slow)])
def test_duration_histograms(n_systems):
    _, tables = sequences(1, n_systems)
    actual = tables.pop("actual")
    table = phrases.durations(actual, tables, list(GESTURES), 0.25, 10.0)
    titles = {name: f"System {name}, of some length" for name in tables}
    assert overlapping(phrases.duration_figure(table, titles)) == []


@pytest.mark.parametrize("n_systems", [1, 12])
def test_timeline(n_systems):
    _, tables = sequences(1, n_systems)
    rng = np.random.default_rng(0)
    clusters = plausible.clusters("actor_0_0", rng)
    own = {name: table[table["record"] == "actor_0_0"] for name, table in tables.items()}
    table = timeline.strips(clusters[clusters["record"] == "actor_0_0"], own)
    figure = timeline.figure(plausible.speech("ada_1", rng), table, list(GESTURES), 0.4)
    assert overlapping(figure) == []


def many_systems(n):
    """Systems with two matched controls each, two other controls, and a ceiling."""
    params = {}
    for k in range(n):
        title = f"System number {k}, of some length"
        own = [f"system_{k}_another", f"system_{k}_shifted"]
        params[f"system_{k}"] = {"title": title, "role": "system", "controls": own, "swept": k < 3}
        for name, what in zip(own, ("another record's speech", "the same speech, shifted"), strict=True):
            params[name] = {"title": f"{title}: {what}", "role": "control"}
    params |= {f"control_{k}": {"title": f"Control number {k}", "role": "control"} for k in range(2)}
    return systems.from_params(params | {"oracle": {"title": "Planted phrases", "role": "ceiling"}})


def run_of(declared):
    shown = list(declared)[:4]
    return Run(declared, {}, shown, shown, {"clusters": 8, "states": 3}, {}, declared, shown)


def measured(rows, **columns):
    """Scores with their intervals, for each of some rows."""
    rng = np.random.default_rng(0)
    value = rng.uniform(0.0, 1.0, len(rows))
    found = {"value": value, "low": value - 0.1, "high": value + 0.1, "n": 8, "n_undefined": 0, "n_records": 8}
    return pd.DataFrame(rows).assign(**found, **columns)


def scores_of(declared):
    """The table ``session_scores`` of some systems, over all actors."""
    kinds = [(name, None) for name in words.MEASURES if name != "S"] + [("S", bin_s) for bin_s in (0.025, 0.5)]
    return measured(
        [
            {"system": name, "variant": "main", "phrases": seen, "measure": measure, "bin_s": bin_s, "part": part}
            for name in declared
            for seen in ("planned", "seen")
            for measure, bin_s in kinds
            for part in ("whole", "interior")
        ],
        actor="all",
    )


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
def test_leaderboard(n_systems):
    declared = many_systems(n_systems)
    assert overlapping(leaderboard.draw(run_of(declared), scores_of(declared)).figure) == []


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
def test_differences(n_systems):
    declared = many_systems(n_systems)
    kinds = [("kappa", None), ("D", None), ("boundary_f1", None), ("S", 0.5)]
    table = measured(
        [
            {"system": one, "other": other, "measure": measure, "bin_s": bin_s}
            for one, other in itertools.permutations(declared, 2)
            for measure, bin_s in kinds
        ],
        actor="all", part="interior", phrases="planned",
    ).rename(columns={"value": "difference"})  # fmt: skip
    assert overlapping(differences.draw(run_of(declared), table, [0.025, 0.5]).figure) == []


@pytest.mark.parametrize(
    ("n_systems", "n_actors"),
    [pytest.param(2, 2, marks=pytest.mark.slow), (1, 8), pytest.param(12, 20, marks=pytest.mark.slow)],
)
def test_worlds(n_systems, n_actors):
    cells = measured(
        [
            {"system": f"system_{k}", "title": f"System number {k}, of some length", "actor": f"actor_{a}"}
            | {"world": ("syllables", "phrases", "vigour", "all")[a % 4], "coupling": 0.8, "measure": measure}
            for k in range(n_systems)
            for a in range(n_actors)
            for measure in worlds.MEASURES
        ],
        recorded=0.4, found="gain",
    ).rename(columns={"value": "advantage"})  # fmt: skip
    assert overlapping(worlds.figure(cells)) == []


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
def test_hand_speeds(n_systems):
    names = ["original", *(f"system_{k}" for k in range(n_systems))]
    titles = {name: f"System number {name}, of some length" for name in names}
    units = {"speed": "m/s", "acceleration": "m/s^2", "jerk": "m/s^3"}
    histograms = pd.DataFrame(
        [
            {"system": name, "quantity": quantity, "unit": unit, "joint": "left_hand", "bin": place}
            | {"low": 0.1 * place, "share": 0.3 / (1 + place)}
            for name in names
            for quantity, unit in units.items()
            for place in range(10)
        ]
    )
    summary = pd.DataFrame(
        [
            {"system": name, "quantity": quantity, "hellinger": 0.3, "lowest": 0.2, "highest": 0.4}
            for name in [*names[1:], "another original"]
            for quantity in units
        ]
    )
    assert overlapping(motion.figure(histograms, summary, titles)) == []


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
@pytest.mark.parametrize("draw", [head_scores.board, head_scores.differences, head_scores.lags])
def test_heads(draw, n_systems):
    declared = many_systems(n_systems)
    rows = []
    for name, system in declared.items():
        for unit in ("record", "minute"):
            rows += [{"system": name, "measure": measure, "unit": unit} for measure in words.HEAD_MEASURES]
            rows += [{"system": name, "measure": "speed_r", "unit": unit, "lag_s": lag_s} for lag_s in (-0.1, 0, 0.1)]
            rows += [
                {"system": name, "measure": measure, "unit": unit, "other": other}
                for measure in words.HEAD_MEASURES
                for other in (*system.controls, "control_0", "control_1")
                if other != name
            ]
    assert overlapping(draw(run_of(declared), measured(rows)).figure) == []


@pytest.mark.parametrize("n_systems", FEW_OR_MANY)
def test_head_angles(n_systems):
    declared = many_systems(n_systems)
    made = {name: plausible_heads.angles(k) for k, name in enumerate(list(declared)[:n_systems])}
    assert overlapping(head.timeline(run_of(declared), plausible_heads.angles(99), made).figure) == []


@pytest.mark.parametrize(
    "n_actors", [pytest.param(2, marks=pytest.mark.slow), 7, pytest.param(20, marks=pytest.mark.slow)]
)
def test_recovered_head_gestures(n_actors):
    table = plausible_heads.recovery({f"record_{a}": f"actor_{a}" for a in range(n_actors)})
    assert overlapping(head.recovered(RUN, table).figure) == []


@pytest.mark.parametrize("n_actors", [pytest.param(2, marks=pytest.mark.slow), 20])
def test_recovered_phrases(n_actors):
    small = pd.DataFrame(plausible.recovery_rows())
    rows = [small.assign(actor=small["actor"] + f"_{k}") for k in range(n_actors // 2)]
    assert overlapping(recovery.figure(pd.concat(rows, ignore_index=True))) == []


@pytest.mark.slow
@pytest.mark.parametrize("n_systems", [2, 12])
def test_sweep(n_systems):
    declared = many_systems(n_systems)
    swept = [
        {"system": f"system_{k}", "measure": measure, "bin_s": bin_s, "clusters": clusters}
        for k in range(n_systems)
        for measure, bin_s in (("S", 0.025), ("S", 0.5), ("D", None))
        for clusters in range(4, 17)
    ]
    levels = sweep.references(scores_of(declared), declared)
    titles = {name: system.title for name, system in declared.items()}
    assert overlapping(sweep.figure(measured(swept, actor="all"), levels, "clusters", titles, {})) == []
