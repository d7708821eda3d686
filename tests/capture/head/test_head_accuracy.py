"""The trial over image size, contrast and noise, and its table."""

import numpy as np
import pandas as pd
import pytest

from cospeech.capture.head import accuracy
from cospeech.data import tables


def test_every_case_differs_and_the_motion_starts_at_rest_and_reaches_its_range():
    planned = list(accuracy.cases())
    assert len(set(planned)) == len(planned) == 18
    trial = accuracy.trial(60, 30.0)
    np.testing.assert_array_equal(trial.angles_deg[0], 0.0)
    np.testing.assert_allclose(np.abs(trial.angles_deg).max(axis=0), accuracy.AMPLITUDES_DEG, rtol=0.05)
    assert 0 < trial.blink.mean() < 0.4
    assert (trial.mouth[0], round(trial.mouth.max(), 2)) == (0.0, 1.0)


def test_errors_are_those_of_the_frames_that_are_not_lost():
    found = pd.DataFrame({"x_deg": [0.0, 2.0, np.nan, 1.0], "y_deg": [0.0, -1.0, np.nan, 5.0], "z_deg": 0.0})
    planted = np.array([[0.0, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 2]])
    case = next(accuracy.cases())
    rows = accuracy.rows(case, planted, found)
    tables.validate(rows, "head_accuracy", "rows")
    assert rows["mean_deg"].tolist() == pytest.approx([1 / 3, 2.0, 2 / 3])
    assert rows["max_deg"].tolist() == [1.0, 4.0, 2.0]
    assert set(rows["share_lost"]) == {0.25}
    nothing = accuracy.rows(case, planted, found.assign(x_deg=np.nan))
    tables.validate(nothing, "head_accuracy", "rows")
    assert set(nothing["share_lost"]) == {1.0}
