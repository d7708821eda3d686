"""Equal error rates against a brute-force count, against scikit-learn's ROC, and in cases with a known answer."""

import numpy as np
import pytest
from sklearn.metrics import roc_curve

from cospeech.metrics import bootstrap, equal_error
from cospeech.metrics.equal_error import RATES, Trials


def draw(rng, n, ties=False):
    client = rng.uniform(size=n) < 0.5
    client[:2] = [True, False]
    right = client & (rng.uniform(size=n) < 0.9)
    score = rng.normal(size=n) + 1.5 * right
    return Trials(np.round(score, 1) if ties else score, client, right)


def counted(trials, rates, threshold):
    """The two rates at one threshold, from the definitions, trial by trial."""
    accepts, rejects = 0, 0
    for score, client, right in zip(*trials, strict=True):
        accepted = score >= threshold
        if rates == "as printed":
            accepts += accepted and not right
            rejects += client and not accepted
        else:
            accepts += accepted and not client
            rejects += client and not (accepted and right)
    impostors, clients = (~trials.client).sum(), trials.client.sum()
    return accepts / (len(trials.score) if rates == "as printed" else impostors), rejects / clients


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("ties", [False, True])
def test_every_operating_point_is_what_is_counted(rates, ties):
    rng = np.random.default_rng(3)
    for _ in range(30):
        trials = draw(rng, int(rng.integers(4, 40)), ties)
        curve = equal_error.curve(trials, rates)
        assert len(curve.threshold) == len(np.unique(trials.score)) + 1
        for threshold, accept, reject in zip(*curve, strict=True):
            assert (accept, reject) == pytest.approx(counted(trials, rates, threshold))


@pytest.mark.parametrize("rates", RATES)
def test_the_equal_error_rate_lies_between_the_points_on_both_sides(rates):
    rng = np.random.default_rng(5)
    for _ in range(50):
        trials = draw(rng, int(rng.integers(6, 60)), ties=True)
        found = equal_error.equal_error(trials, rates)
        points = np.array([counted(trials, rates, one) for one in [np.inf, *np.unique(trials.score)[::-1]]])
        after = int(np.argmax(points[:, 0] >= points[:, 1]))
        before, at = points[max(after - 1, 0)], points[after]
        gap = before[1] - before[0], at[0] - at[1]
        assert found.rate == pytest.approx((before[0] * gap[1] + at[0] * gap[0]) / sum(gap))


def test_usual_rates_of_a_verification_are_those_of_scikit_learn():
    rng = np.random.default_rng(7)
    for _ in range(20):
        trials = draw(rng, 80)
        trials = trials._replace(right=trials.client)  # all best models are right: plain verification
        accept, hit, _ = roc_curve(trials.client, trials.score, drop_intermediate=False)
        crossing = np.interp(0.0, accept - (1 - hit), accept)
        curve = equal_error.curve(trials, "usual")
        np.testing.assert_allclose(curve.false_accept, accept)
        np.testing.assert_allclose(curve.false_reject, 1 - hit, atol=1e-12)
        assert equal_error.equal_error(trials, "usual").rate == pytest.approx(crossing)


def test_clients_taken_for_others_count_as_the_document_says_or_as_usual():
    """Four clients, one of them taken for another one with the highest score, and four impostors."""
    trials = Trials(
        np.array([9.0, 8.0, 7.0, 6.0, 1.0, 2.0, 3.0, 4.0]),
        np.array([True] * 4 + [False] * 4),
        np.array([False, True, True, True] + [False] * 4),
    )
    assert counted(trials, "as printed", 5.0) == (1 / 8, 0.0)
    assert counted(trials, "usual", 5.0) == (0.0, 1 / 4)
    assert equal_error.equal_error(trials, "as printed").rate == pytest.approx(1 / 8)
    assert equal_error.equal_error(trials, "usual").rate == pytest.approx(1 / 4)


def test_without_impostors_or_clients_there_is_no_rate():
    trials = Trials(np.arange(3.0), np.ones(3, dtype=bool), np.ones(3, dtype=bool))
    assert np.isnan(equal_error.equal_error(trials, "usual").rate)
    assert np.isnan(equal_error.bootstrapped(trials, "usual", np.arange(3), np.ones((2, 3)))).all()


@pytest.mark.parametrize("rates", RATES)
def test_a_bootstrap_sample_is_the_rate_of_the_trials_it_repeats(rates):
    rng = np.random.default_rng(9)
    trials, group = draw(rng, 60, ties=True), rng.integers(8, size=60)
    weights = bootstrap.draws(np.zeros(8), 25, 1, "x")
    found = equal_error.bootstrapped(trials, rates, group, weights)
    for value, drawn in zip(found, weights, strict=True):
        repeated = np.repeat(np.arange(60), drawn[group].astype(int))
        again = Trials(*(values[repeated] for values in trials))
        assert value == pytest.approx(equal_error.equal_error(again, rates).rate, nan_ok=True)


def test_the_threshold_at_a_false_accept_rate_accepts_no_more_than_that():
    rng = np.random.default_rng(11)
    for _ in range(20):
        trials, allowed = draw(rng, 50), float(rng.uniform(0.05, 0.5))
        threshold = equal_error.threshold_at(trials, "usual", allowed)
        assert counted(trials, "usual", threshold)[0] <= allowed
        below = trials.score[trials.score < threshold].max()
        assert counted(trials, "usual", below)[0] > allowed or below not in trials.score[~trials.client]
