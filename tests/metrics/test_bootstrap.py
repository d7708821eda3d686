"""The coverage of intervals is as stated, and draws are those of a stratified bootstrap."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from cospeech.metrics import bootstrap


def interval_of_mean(values, strata, level=0.95, samples=1000, name="x"):
    """The interval of the mean of each row of values (G, R)."""
    counts = bootstrap.draws(strata, samples, 1, name)
    drawn = bootstrap.ratios(values, np.ones_like(values), counts)
    n, n_strata = len(strata), len(set(strata))
    return bootstrap.interval(drawn, level, np.full(len(values), n), np.full(len(values), n_strata))


def coverage(strata, groups=1500):
    values = np.random.default_rng(7).normal(size=(groups, len(strata)))
    low, high = interval_of_mean(values, strata, samples=2000)
    return float(np.mean((low <= 0) & (high >= 0)))


# Of 1500 intervals at 0.95 a share outside 0.95 -+ 0.018 has probability 0.002; the draws they share add a little.
@pytest.mark.parametrize("strata", [["a"] * 24, ["a"] * 12 + ["b"] * 12])
def test_coverage_with_many_records(strata):
    assert coverage(strata) == pytest.approx(0.95, abs=0.022)


def test_coverage_of_the_demo_with_two_actors_of_four_records():
    # Not 0.95: the tails of eight numbers are too short. The report says so.
    assert coverage(["a"] * 4 + ["b"] * 4) == pytest.approx(0.92, abs=0.02)


def test_four_records_give_their_range_and_cover_less():
    # The range of four numbers contains the mean of a symmetric distribution unless all are on one side: 1 - 2 / 2^4.
    values = np.random.default_rng(1).normal(size=(1, 4))
    low, high = interval_of_mean(values, ["a"] * 4, samples=4000)
    # The most extreme draw, four times the same record, has probability 1/256.
    assert low[0] == pytest.approx(values.min(), abs=1e-12)
    assert high[0] == pytest.approx(values.max(), abs=1e-12)
    assert coverage(["a"] * 4) == pytest.approx(0.875, abs=0.026)


def test_plain_percentiles_would_cover_less():
    values = np.random.default_rng(7).normal(size=(1500, 8))
    counts = bootstrap.draws(["a"] * 4 + ["b"] * 4, 2000, 1, "x")
    low, high = np.quantile(bootstrap.ratios(values, np.ones_like(values), counts), [0.025, 0.975], axis=1)
    assert np.mean((low <= 0) & (high >= 0)) < 0.88


def test_expanded_tail_gives_the_t_interval_where_the_mean_is_normal():
    n = 12
    values = np.random.default_rng(4).normal(3.0, 2.0, n)
    spread = values.std(ddof=0) / math.sqrt(n)  # of the bootstrap mean
    z = -stats.norm.ppf(bootstrap.expanded_tail(0.9, n, n - 1))
    expected = stats.t.interval(0.9, n - 1, values.mean(), values.std(ddof=1) / math.sqrt(n))
    assert (values.mean() - z * spread, values.mean() + z * spread) == pytest.approx(expected)
    assert math.isnan(bootstrap.expanded_tail(0.9, 1, 0))


def test_samples_keep_every_actor_s_number_of_records():
    counts = bootstrap.draws(["a", "b", "a", "b", "b"], 500, 1, "x")
    assert (counts[:, [0, 2]].sum(axis=1) == 2).all()
    assert (counts[:, [1, 3, 4]].sum(axis=1) == 3).all()
    assert counts.mean(axis=0) == pytest.approx(np.ones(5), abs=0.1)


def test_draws_depend_on_seed_and_name_alone():
    first = bootstrap.draws(["a"] * 5, 50, 1, "x")
    assert (first == bootstrap.draws(["a"] * 5, 50, 1, "x")).all()
    assert not (first == bootstrap.draws(["a"] * 5, 50, 2, "x")).all()
    assert not (first == bootstrap.draws(["a"] * 5, 50, 1, "y")).all()


def test_ratios_by_a_plain_loop():
    rng = np.random.default_rng(2)
    numerators, denominators = rng.normal(size=(3, 6)), rng.uniform(1, 2, (3, 6))
    counts = bootstrap.draws(["a"] * 6, 20, 1, "x")
    found = bootstrap.ratios(numerators, denominators, counts)
    for group in range(3):
        for sample in range(20):
            drawn = np.repeat(np.arange(6), counts[sample].astype(int))
            expected = numerators[group, drawn].sum() / denominators[group, drawn].sum()
            assert found[group, sample] == pytest.approx(expected)


def test_one_record_has_no_interval_and_undefined_samples_are_left_out():
    values, weights = np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]])
    drawn = bootstrap.ratios(values, weights, bootstrap.draws(["a", "a"], 200, 1, "x"))
    assert np.isnan(drawn).any()
    low, high = bootstrap.interval(drawn, 0.95, [1], [1])
    assert np.isnan([*low, *high]).all()
    low, high = bootstrap.interval(drawn, 0.95, [2], [1])
    assert [*low, *high] == [1.0, 1.0]


# ---------------------------------------------------------------- draws within records


def enumerated(values):
    """Mean and probability of every outcome of the two-stage bootstrap, by going through all choices.

    values : for each record its draws.
    """
    n = len(values)
    once = {}  # for each record, the outcomes of resampling its draws
    for record, own in enumerate(values):
        outcomes = {}
        for chosen in itertools.product(own, repeat=len(own)):
            mean = Fraction(sum(chosen), len(own))
            outcomes[mean] = outcomes.get(mean, 0) + len(own) ** -len(own)
        once[record] = outcomes
    found = {}
    for records in itertools.product(range(n), repeat=n):
        for means in itertools.product(*(once[record].items() for record in records)):
            total = sum(mean for mean, _ in means) / n
            found[total] = found.get(total, 0) + n**-n * math.prod(p for _, p in means)
    return found


def test_the_hierarchical_bootstrap_has_the_distribution_of_all_its_outcomes():
    values, samples = [[0, 1, 3], [10, 14], [100]], 40000
    expected = enumerated(values)
    assert sum(expected.values()) == pytest.approx(1)
    counts = bootstrap.draws(["a"] * 3, samples, 3, "x")
    weights = bootstrap.within(counts, [3, 2, 1], 3, "x")
    table = np.array([[own + [np.nan] * (3 - len(own)) for own in values]], dtype=float)
    above, below = np.nan_to_num(table).reshape(1, -1), np.isfinite(table).astype(float).reshape(1, -1)
    found = bootstrap.ratios(above, below, weights.reshape(samples, -1))[0]
    for mean, probability in expected.items():
        spread = math.sqrt(probability * (1 - probability) / samples)
        assert np.mean(np.abs(found - float(mean)) < 1e-9) == pytest.approx(probability, abs=5 * spread)
    assert np.abs(found[:, None] - np.array([float(mean) for mean in expected])).min(axis=1).max() < 1e-9


def test_each_record_keeps_its_weight_however_many_draws_it_has():
    counts = bootstrap.draws(["a"] * 4, 300, 1, "x")
    weights = bootstrap.within(counts, [8, 1, 3, 0], 1, "x")
    assert weights.shape == (300, 4, 8)
    np.testing.assert_allclose(weights[:, :3].sum(axis=2), counts[:, :3])
    assert (weights[:, 3] == 0).all()
    assert (weights[:, 2, 3:] == 0).all()
    np.testing.assert_array_equal(weights[:, 1, 0], counts[:, 1])


def test_records_with_as_many_draws_in_two_groups_are_resampled_alike():
    counts = bootstrap.draws(["a"] * 3, 50, 1, "x")
    one, two = bootstrap.within(counts, [8, 3, 8], 1, "x"), bootstrap.within(counts, [8, 8, 8], 1, "x")
    np.testing.assert_array_equal(one[:, [0, 2]], two[:, [0, 2]])
    assert not np.array_equal(two[:, 0], two[:, 2])
    assert not np.array_equal(two, bootstrap.within(counts, [8, 8, 8], 2, "x"))


# ---------------------------------------------------------------- p-values, and many comparisons


def test_the_p_value_is_that_of_a_t_test():
    values = np.random.default_rng(4).normal(0.4, 1.0, (1, 20))
    counts = bootstrap.draws(["a"] * 20, 20000, 1, "x")
    drawn = bootstrap.ratios(values, np.ones_like(values), counts)
    found = bootstrap.p_values(values.mean(axis=1), drawn, [20], [1])
    assert found[0] == pytest.approx(stats.ttest_1samp(values[0], 0).pvalue, rel=0.05)
    assert bootstrap.p_values(-values.mean(axis=1), -drawn, [20], [1])[0] == found[0]


def test_p_values_where_nothing_varies():
    same = np.full((4, 10), 0.5)
    found = bootstrap.p_values(np.array([0.5, 0.0, 0.5, np.nan]), same, [5, 5, 1, 5], [1, 1, 1, 1])
    np.testing.assert_array_equal(found, [0, 1, np.nan, np.nan])


def holm_by_definition(p_values):
    """Adjusted values from the procedure itself: the smallest alpha at which the step-down test rejects each."""
    order = sorted(range(len(p_values)), key=lambda k: p_values[k])
    adjusted = [1.0] * len(p_values)
    for place, k in enumerate(order):
        needed = [(len(order) - j) * p_values[order[j]] for j in range(place + 1)]  # all of these must be <= alpha
        adjusted[k] = min(1.0, max(needed))
    return adjusted


@given(st.lists(st.floats(0, 1), max_size=12))
def test_holm_by_its_definition(p_values):
    found = bootstrap.holm(p_values)
    assert found.tolist() == pytest.approx(holm_by_definition(p_values))
    for alpha in (
        0.01,
        0.05,
        0.3,
    ):  # the procedure: go through the sorted p-values and stop at the first that is too large
        rejected, left = set(), len(p_values)
        for k in sorted(range(left), key=lambda k: p_values[k]):
            if p_values[k] * left > alpha:
                break
            rejected, left = rejected | {k}, left - 1
        assert {k for k, adjusted in enumerate(found) if adjusted <= alpha} == rejected


def test_holm_leaves_out_what_is_undefined():
    np.testing.assert_allclose(bootstrap.holm([0.01, np.nan, 0.04, 0.03]), [0.03, np.nan, 0.06, 0.06])
