"""The difference that filming makes, by hand."""

import numpy as np
import pandas as pd

from cospeech import tables
from cospeech.evaluation.film_effect import film_effect


def session(measure, value, system="hsmm_weighted", bin_s=np.nan):
    return {
        "system": system, "clusters": 8, "states": 3, "actor": "all", "measure": measure, "part": "whole",
        "bin_s": bin_s, "value": value, "low": np.nan, "high": np.nan, "n": 4, "n_undefined": 0, "n_records": 4,
    }  # fmt: skip


def test_differences_are_relative_to_the_true_score_and_of_what_both_hold():
    filmed = [session("S", 0.63, bin_s=0.5), session("kappa", 0.2), session("D", 0.9), session("D", 0.8, "random")]
    true = [session("D", 1.0), session("S", 0.60, bin_s=0.5), session("kappa", 0.0)]
    found = film_effect(pd.DataFrame(filmed), pd.DataFrame(true))
    assert list(found["measure"]) == ["S", "kappa", "D"]
    assert found["system"].eq("hsmm_weighted").all()
    np.testing.assert_allclose(found["difference_pct"], [5.0, np.nan, -10.0])
    assert list(found["planted"]) == [0.60, 0.0, 1.0]
    tables.validate(found, "film_effect", "here")
