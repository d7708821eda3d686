"""Numbers about transplanted heads, on movements that can be worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation import head_transplant
from cospeech.motion import head

FPS = 25.0
FEATURES = [*head.COLUMNS, *(f"d_{name}" for name in head.COLUMNS)]


def turning(times, angle_deg=20.0):
    """A head that looks ahead and aside in turn, for the given numbers of frames."""
    turned = np.repeat(np.arange(len(times)) % 2, times)
    return head.table(np.column_stack([0.0 * turned, angle_deg * turned, 0.0 * turned]), FPS)


def patterns(names=("ahead", "aside"), feature="y_deg", means=(0.0, 20.0), others=()):
    """A model of two patterns of one state that are told apart by one feature."""
    rows = [
        {"branch": name, "state": 0, "entry_probability": 0.5, "stay_probability": 0.9, "feature": other}
        | {"mean": mean if other == feature else 0.0, "variance": 4.0 if other == feature else 400.0}
        for name, mean in zip(names, means, strict=True)
        for other in others or FEATURES
    ]
    return pd.DataFrame(rows)


def test_speed_spread_and_patterns_of_a_head_that_turns():
    made = turning([50, 25, 50, 25])
    found = head_transplant.row(made, patterns(), [turning([50, 50])])
    assert found["speed_deg_s"] == pytest.approx(3 * 20.0 * FPS / 149)
    assert found["spread_deg"] == pytest.approx(20.0 * np.sqrt(2 / 9 / 3))
    assert found["patterns_per_minute"] == pytest.approx(60 * 4 / 6)
    assert found["pattern_distance"] == pytest.approx(2 / 3 - 1 / 2)


def test_heads_without_a_common_pattern_are_at_distance_1():
    assert head_transplant.row(turning([100]), patterns(), [turning([1, 99])])["pattern_distance"] > 0.98


def test_models_that_cut_a_melody_alike_agree_whatever_their_names_are():
    pitch = np.repeat([0.0, 3.0, 0.0, 3.0, 0.0], [100, 50, 80, 70, 90])
    melody = pd.DataFrame({"pitch": pitch, "d_pitch": 0.0, "intensity": 0.0})
    columns = ["pitch", "d_pitch", "intensity"]
    one = patterns(("p1", "p2"), "pitch", (0.0, 3.0), columns)
    other = patterns(("high", "low"), "pitch", (3.0, 0.0), columns)
    deaf = patterns(("p1", "p2"), "pitch", (0.0, 90.0), columns)
    assert head_transplant.melody_agreement(melody, one, other) == pytest.approx(1.0)
    assert head_transplant.melody_agreement(melody, one, deaf) == pytest.approx(0.0, abs=1e-9)


def test_the_rows_have_their_schema():
    named = {"record": "a_1", "voice_actor": "a", "model_actor": "b", "system": "head", "variant": "main"}
    found = head_transplant.row(turning([50, 25]), patterns(), [turning([50, 50])])
    table = pd.DataFrame([named | {"source": "transplant", "melody_ami": 0.5} | found])
    tables.validate(table, "head_transplant", "x")
