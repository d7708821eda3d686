"""Figures of few and of many actors and systems: no text lies over another."""

import itertools

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import plausible
import pytest
from matplotlib.text import Text

from cospeech.data.vocabulary import GESTURES
from cospeech.report.exhibits import phrases, timeline

CLEARANCE_PX = 0.5


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


def overlapping(figure):
    """The pairs of texts of a figure that lie over each other."""
    figure.draw_without_rendering()
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    shown = [text for text in shown if text.axes is None or text.axes.axison]
    outlines = [corners(text) for text in shown]
    pairs = itertools.combinations(range(len(shown)), 2)
    found = [(shown[a].get_text(), shown[b].get_text()) for a, b in pairs if not apart(outlines[a], outlines[b])]
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


@pytest.mark.parametrize("n_systems", [2, 12])
@pytest.mark.parametrize("n_actors", [1, 2, 7, 20])
def test_gesture_frequencies(n_actors, n_systems):
    actors, tables = sequences(n_actors, n_systems)
    titles = {name: f"System number {name}, of some length" for name in tables}
    table = phrases.shares(tables, actors, list(GESTURES))
    assert overlapping(phrases.frequency_figure(table, titles)) == []


@pytest.mark.parametrize("n_systems", [1, 3, 12])
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
