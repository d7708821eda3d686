"""Findings claim no more than their intervals allow."""

import numpy as np
import pandas as pd
import plausible
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.report import systems as reported
from cospeech.report import words
from cospeech.report.page import findings

NAMES = ("hsmm", "shuffled", "shifted", "majority", "another")
SYSTEMS = {name: plausible.SYSTEMS[name] for name in NAMES}


def score(system, measure, value, bin_s=np.nan, part="interior"):
    origin = {
        "system": system,
        "variant": "main",
        "phrases": "planned",
        "actor": "all",
        "measure": measure,
        "part": part,
    }
    found = {"bin_s": bin_s, "value": value, "low": value - 0.1, "high": value + 0.1}
    draws = {"fewest_draws": 1, "most_draws": 1}
    return origin | found | {"n": 8, "n_undefined": 0, "n_records": 8} | draws


def difference(other, measure, low, high, p_value=0.0001):
    return {
        "system": "hsmm", "other": other, "actor": "all", "phrases": "planned",
        "measure": measure, "part": "interior", "bin_s": np.nan,
        "difference": (low + high) / 2, "low": low, "high": high, "n": 8, "better": None, "p_value": p_value,
    }  # fmt: skip


SCORES = pd.DataFrame(
    [
        score("hsmm", "kappa", 0.3),
        score("another", "S", 0.1, 0.025, "whole"),
        score("another", "S", 0.7, 0.5, "whole"),
        score("hsmm", "D", 0.5, part="whole"),
        score("majority", "D", 0.0, part="whole"),
        score("majority", "phrase_ratio", 0.05, part="whole"),
    ]
)


def first(kappa, distance=((-0.1, 0.1), (-0.1, 0.1))):
    rows = []
    for control, (low, high), (near, far) in zip(("shuffled", "shifted"), kappa, distance, strict=True):
        rows += [difference(control, "kappa", low, high), difference(control, "D", near, far)]
    return findings.findings(SCORES, pd.DataFrame(rows), SYSTEMS, 0.8313, 0.95)[0]


@pytest.mark.parametrize(
    ("kappa", "claim"),
    [
        (
            ((0.1, 0.3), (0.2, 0.4)),
            "picks gestures better than the same system driven by another record's speech or its own speech, shifted",
        ),
        (
            ((0.1, 0.3), (-0.1, 0.2)),
            "but cannot be distinguished from the same system driven by its own speech, shifted",
        ),
        (((-0.1, 0.3), (0.0, 0.2)), "cannot be distinguished from its controls by the gestures that it picks"),
        (((-0.3, -0.1), (0.1, 0.2)), "picks gestures worse than the same system driven by another record's speech"),
    ],
)
def test_claims_follow_the_intervals(kappa, claim):
    assert claim in first(kappa).claim


def test_boundaries_are_better_where_distances_are_smaller():
    good, bad, open_ = (-0.3, -0.1), (0.1, 0.3), (-0.1, 0.3)
    clear = ((0.1, 0.3), (0.1, 0.3))
    assert "Its boundaries are closer" in first(clear, (good, good)).claim
    assert "is undecided" in first(clear, (good, open_)).claim
    assert "are further" in first(clear, (good, bad)).claim


def test_fewer_than_four_records_decide_nothing():
    clear = pd.DataFrame([difference("shuffled", "kappa", 0.1, 0.3), difference("shifted", "kappa", 0.2, 0.4)])
    for n_records, silent in ((3, True), (4, False)):
        found = findings.findings(SCORES.assign(n_records=n_records), clear, SYSTEMS, 0.8313, 0.95)
        claims = " ".join(finding.claim for finding in found)
        assert ("better than" in claims) != silent
        assert ("cannot distinguish between systems, so none is called better" in claims) == silent
        assert "The ceiling of S" in claims


def test_a_difference_that_many_comparisons_do_not_support_is_undecided():
    def of(p_value, n_others):
        rows = [difference("shuffled", "kappa", 0.1, 0.3, p_value)]
        rows += [difference(f"c{k}", "kappa", -0.1, 0.3, 0.9) for k in range(n_others)]
        controls = {f"c{k}": reported.System(f"c{k}", f"C{k}", "control") for k in range(n_others)}
        return findings.findings(SCORES, pd.DataFrame(rows), SYSTEMS | controls, 0.8313, 0.95)

    assert "better than the same system driven by another record's speech" in of(0.02, 1)[0].claim
    many = of(0.02, 4)
    assert "cannot be distinguished from its controls" in many[0].claim
    assert "kappa +0.20 (+0.10 to +0.30), p = 0.100" in many[0].evidence[1]
    assert any("Holm, 5 comparisons" in line for finding in many for line in finding.evidence)


def test_controls_of_no_system_are_in_the_headline_and_undefined_ones_do_not_count():
    rows = [
        *(difference(name, "kappa", 0.1, 0.3) for name in ("shuffled", "shifted", "majority")),
        difference("shuffled", "D", -0.3, -0.1),
        difference("shifted", "D", -0.3, -0.1),
        difference("majority", "D", np.nan, np.nan, np.nan),  # it has no boundary
    ]
    found = findings.findings(SCORES, pd.DataFrame(rows), SYSTEMS, 0.8313, 0.95)[0]
    assert found.claim == (
        "“HSMM as printed” picks gestures better than “Most frequent label” and the same system driven by another "
        "record's speech or its own speech, shifted. Its boundaries are closer to the actual ones, too."
    )
    assert found.evidence[-1] == "minus “Most frequent label”: kappa +0.20 (+0.10 to +0.30), p < 0.001"


def test_the_number_of_draws_and_of_records_of_a_control_is_said():
    rows = pd.concat([SCORES, pd.DataFrame([score("shuffled", "kappa", 0.1), score("shifted", "kappa", 0.1)])])
    rows.loc[rows["system"] == "shuffled", ["fewest_draws", "most_draws"]] = 3
    rows.loc[rows["system"] == "shifted", ["fewest_draws", "most_draws", "n_records"]] = [5, 8, 6]
    compared = pd.DataFrame([difference("shuffled", "kappa", 0.1, 0.3), difference("shifted", "kappa", 0.2, 0.4)])
    evidence = findings.findings(rows, compared, SYSTEMS, 0.8313, 0.95)[0].evidence
    assert "driven by another record's speech (3 draws per record): kappa" in evidence[1]
    assert "driven by its own speech, shifted (5 to 8 draws per record, 6 of 8 records): kappa" in evidence[2]


ENDS = st.tuples(st.floats(-1, 1), st.floats(0.001, 1)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@given(ENDS, ENDS, ENDS, ENDS)
@settings(max_examples=40, deadline=None)
def test_an_interval_with_zero_is_never_called_better(one, two, near, far):
    claim = first((one, two), (near, far)).claim
    named = {"another record's speech": one, "its own speech, shifted": two}
    decided = claim.split(". ")[0].split("but cannot")[0]
    for speech, (low, high) in named.items():
        if "better than" in decided and speech in decided:
            assert low > 0
        if "worse than" in decided and speech in decided:
            assert high < 0
    if "are closer to the actual ones" in claim:
        assert near[1] < 0
        assert far[1] < 0


def test_a_system_is_compared_with_the_first_and_with_its_predecessor():
    rows = [
        difference("hsmm", "kappa", 0.1, 0.3) | {"system": "hsmm_weighted"},
        difference("hsmm", "kappa", -0.3, -0.1) | {"system": "hsmm_sampled"},
        difference("hsmm", "D", -0.3, 0.1) | {"system": "hsmm_sampled"},
        difference("hsmm_weighted", "kappa", -0.1, 0.1) | {"system": "hsmm_sampled"},
    ]
    scores = pd.concat(
        [SCORES, pd.DataFrame([score(name, "kappa", 0.3) for name in ("hsmm_weighted", "hsmm_sampled")])]
    )
    claims = [
        finding.claim for finding in findings.findings(scores, pd.DataFrame(rows), plausible.SYSTEMS, 0.8313, 0.95)
    ]
    assert "“HSMM, emissions weighted” beats “HSMM as printed” in kappa." in claims
    assert (
        "“HSMM, drawn from the posterior” does worse than “HSMM as printed” in kappa; it cannot be distinguished "
        "from “HSMM as printed” in D; it cannot be distinguished from “HSMM, emissions weighted” in kappa."
    ) in claims


def test_a_system_without_scores_is_not_compared():
    claims = " ".join(
        finding.claim
        for finding in findings.findings(
            SCORES, pd.DataFrame([difference("shuffled", "kappa", 0.1, 0.3)]), plausible.SYSTEMS, 0.8313, 0.95
        )
    )
    assert "HSMM as printed" in claims
    assert "HSMM, emissions weighted" not in claims


def test_a_control_with_the_lowest_distance_is_named():
    found = findings.findings(
        SCORES, pd.DataFrame([difference("shuffled", "kappa", 0.1, 0.3)]), SYSTEMS, 0.8313, 0.95
    )
    claims = " ".join(finding.claim for finding in found)
    assert "D alone rewards silence: the control “Most frequent label” has the lowest D." in claims
    assert "The ceiling of S, “Another real record”, is 0.10" in claims
    assert "resolves differences of about 0.10 in kappa" in claims


def test_goals_that_may_be_missed_by_chance_are_counted_apart():
    aimed = {"unit": "%", "goal": 5.0, "values": 8}
    summary = pd.DataFrame(
        [
            aimed | {"group": "angles", "quantity": "a", "meaning": "head", "unit": "deg", "mean": 4.0, "lowest": 3.0,
                     "highest": 7.0, "met": False},
            aimed | {"group": "markers", "quantity": "b", "meaning": "lost", "mean": 1.0, "lowest": 0.0,
                     "highest": 2.0, "met": True},
            aimed | {"group": "experiment", "quantity": "c", "meaning": "S", "mean": 12.0, "lowest": -3.0,
                     "highest": 25.0, "met": None},
        ]
    )  # fmt: skip
    found = findings.findings(
        SCORES, pd.DataFrame([difference("shuffled", "kappa", 0.1, 0.3)]), SYSTEMS, 0.8313, 0.95, capture=summary
    )
    captured = next(finding for finding in found if finding.claim.startswith("Capture"))
    assert captured.claim == "Capture meets 1 of its 3 goals; 1 more may be missed by chance."
    assert captured.evidence == [
        "head: 7.00 deg in the worst record, the goal is 5",
        "S: +12.00 % (−3.00 to +25.00), the goal is 5",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.523, "0.52"), (-0.5, "−0.50"), (0.004, "0.004"), (0.0, "0.00"), (-0.0, "0.00"), (float("nan"), "–")],
)
def test_numbers(value, text):
    assert words.number(value) == text


def test_the_made_up_run_has_all_its_findings(virtual_page):
    for claim in (
        "“HSMM as printed”",
        "D alone",
        "This corpus resolves",
        "The planted gesture phrases were recovered",
        "The speeds",
        "Capture meets",
    ):
        assert f"<strong>{claim}" in virtual_page
