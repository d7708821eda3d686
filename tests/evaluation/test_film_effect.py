"""The effect of filming, compared with values computed by hand, and its interval."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.evaluation.film_effect import film_effect
from cospeech.evaluation.sessions import Bootstrap

SETTINGS = Bootstrap(samples=400, level=0.95, seed=1)
RECORDS = ("ada_1", "ada_2", "ada_3", "ada_4")


def records(measure, values, system="hsmm_weighted", bin_s=np.nan, variant="clusters~8,states~3"):
    return pd.DataFrame(
        [
            {
                "system": system, "variant": variant, "actor": "ada", "record": record,
                "phrases": "planned", "draw": 0,
                "measure": measure, "part": "whole", "bin_s": bin_s, "value": value, "duration_s": 60.0,
            }
            for record, value in zip(RECORDS, values, strict=True)
        ]
    )  # fmt: skip


def effect(filmed, true):
    found = film_effect(pd.concat(filmed), pd.concat(true), SETTINGS)
    tables.validate(found, "film_effect", "here")
    return found[found["actor"] == "all"].set_index("measure")


def test_differences_are_relative_and_for_one_system_and_setting():
    found = effect(
        [
            records("S", [0.6, 0.7, 0.6, 0.62], bin_s=0.5), records("kappa", [0.2] * 4), records("D", [0.9] * 4),
            records("D", [0.5] * 4, system="random"), records("D", [0.4] * 4, variant="clusters~8,states~5"),
        ],
        [records("D", [1.0] * 4), records("S", [0.6] * 4, bin_s=0.5), records("kappa", [0.0] * 4)],
    )  # fmt: skip
    assert list(found.index) == ["S", "kappa", "D"]
    assert found["system"].eq("hsmm_weighted").all()
    np.testing.assert_allclose(found["filmed"], [0.63, 0.2, 0.9])
    np.testing.assert_allclose(found["planted"], [0.6, 0.0, 1.0])
    np.testing.assert_allclose(found["difference_pct"], [5.0, np.nan, -10.0])
    assert found["n_records"].eq(4).all()


def test_intervals_are_computed_from_paired_differences():
    """If all records differ from their planted score by the same amount, the interval has zero width."""
    true = [0.2, 0.9, 0.4, 0.7]
    constant = effect([records("D", [value + 0.055 for value in true])], [records("D", true)]).loc["D"]
    assert (constant["low_pct"], constant["high_pct"]) == pytest.approx((10.0, 10.0))
    varying = effect([records("D", [0.7, 0.4, 0.9, 0.2])], [records("D", true)]).loc["D"]
    assert varying["low_pct"] < -50.0 < 50.0 < varying["high_pct"]
    assert varying["difference_pct"] == pytest.approx(0.0, abs=1e-9)


def test_phrases_seen_in_motion_do_not_count():
    seen = records("D", [9.0] * 4).assign(phrases="seen")
    assert effect([records("D", [1.1] * 4), seen], [records("D", [1.0] * 4)]).loc["D", "filmed"] == pytest.approx(1.1)


def test_more_is_more_where_the_planted_score_is_negative():
    found = effect([records("kappa", [0.1] * 4)], [records("kappa", [-0.1] * 4)]).loc["kappa"]
    assert found["difference_pct"] == pytest.approx(200)
