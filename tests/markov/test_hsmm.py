"""The HSMM against the sum and the maximum over all paths, and against planted models."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.markov import hsmm, hsmm_kernels

FRAME_S = 0.025


def random_model(rng, n_states, n_symbols, n_bins, zeros=False):
    """A model with names that are not in alphabetical order; ``zeros`` forbids some starts, steps and durations."""

    def rows(*shape):
        p = rng.dirichlet(np.full(shape[-1], 0.7), shape[:-1])
        if zeros:
            p = p * (rng.random(p.shape) < 0.7)
            p[..., rng.integers(shape[-1])] += 0.1
            p = p / p.sum(axis=-1, keepdims=True)
        return p

    return hsmm.HSMM(
        states=tuple(f"g{n_states - i}" for i in range(n_states)),
        symbols=tuple(f"p{k + 1}" for k in range(n_symbols)),
        initial=rows(n_states),
        transitions=rows(n_states, n_states),
        emissions=rng.dirichlet(np.ones(n_symbols), n_states) * 0.98 + 0.02 / n_symbols,
        durations=rows(n_states, n_bins),
    )


def all_paths(model, n_frames):
    """Every sequence of (state, length) that covers ``n_frames``."""
    n_states, n_bins = model.durations.shape

    def cut(rest):
        if rest == 0:
            yield ()
        for length in range(1, min(n_bins, rest) + 1):
            for tail in cut(rest - length):
                yield (length, *tail)

    for lengths in cut(n_frames):
        for states in itertools.product(range(n_states), repeat=len(lengths)):
            yield tuple(zip(states, lengths, strict=True))


def probability(model, path, observed, weight, censoring):
    """The product that eq. 5.9 takes the logarithm of, term by term."""
    value = model.initial[path[0][0]]
    time = 0
    for place, (state, length) in enumerate(path):
        if place > 0:
            value *= model.transitions[path[place - 1][0], state]
        last = place == len(path) - 1
        if last and censoring == "right":
            value *= sum(model.durations[state, length - 1 :])
        else:
            value *= model.durations[state, length - 1]
        for t in range(time, time + length):
            value *= model.emissions[state, observed[t]] ** weight
        time += length
    return value


def steps(model, path, n_frames):
    """A decoded path as ((state, length), ...)."""
    lengths = np.diff(np.append(path.starts, n_frames))
    return tuple((model.states.index(label), int(k)) for label, k in zip(path.labels, lengths, strict=True))


CASES = [
    (seed, weight, censoring)
    for seed in range(70)
    for weight, censoring in itertools.product((1.0, 0.3, 0.0), ("none", "right"))
]


def test_decoding_and_likelihood_equal_the_enumeration_of_all_paths():
    compared = 0
    for seed, weight, censoring in CASES:
        rng = np.random.default_rng(seed)
        model = random_model(rng, int(rng.integers(1, 4)), int(rng.integers(1, 4)), int(rng.integers(1, 5)), seed % 2)
        n_frames = int(rng.integers(1, 7))
        codes = rng.integers(len(model.symbols), size=n_frames)
        observed = np.array(model.symbols, dtype=object)[codes]
        every = {path: probability(model, path, codes, weight, censoring) for path in all_paths(model, n_frames)}
        total = sum(every.values())
        if total == 0:  # because of the zeros, no path covers these frames
            with pytest.raises(ValueError, match="no path"):
                hsmm.decode(model, observed, weight, censoring)
            with pytest.raises(ValueError, match="no path"):
                hsmm.sample(model, observed, rng, weight, censoring)
            assert hsmm.log_likelihood(model, observed, weight, censoring) == -np.inf
            continue
        path = hsmm.decode(model, observed, weight, censoring)
        best = max(every.values())
        assert path.log_score == pytest.approx(math.log(best), abs=1e-9)
        assert every[steps(model, path, n_frames)] == pytest.approx(best, rel=1e-9)
        likelihood = hsmm.log_likelihood(model, observed, weight, censoring)
        assert likelihood == pytest.approx(math.log(total), abs=1e-9)
        compared += 1
    assert compared > 350


def best_score(model, codes):
    """The score of the best path, by the recursion over all states and durations of every frame."""
    initial, transitions, emissions, durations = (
        np.log(getattr(model, name)) for name in ("initial", "transitions", "emissions", "durations")
    )
    (n_states, n_bins), n_frames = durations.shape, len(codes)
    heard = np.concatenate([np.zeros((n_states, 1)), np.cumsum(emissions[:, codes], axis=1)], axis=1)
    ending = np.full((n_states, n_frames + 1), -np.inf)
    for t in range(1, n_frames + 1):
        for j in range(n_states):
            for k in range(1, min(n_bins, t) + 1):
                begun = initial[j] if k == t else max(ending[:, t - k] + transitions[:, j])
                ending[j, t] = max(ending[j, t], begun + durations[j, k - 1] + heard[j, t] - heard[j, t - k])
    return ending[:, -1].max()


@pytest.mark.parametrize("n_bins", [8, 9, 16, 23, 40])
def test_durations_at_the_floor_are_decoded_like_any_other(n_bins):
    """The decoder handles all durations of the least probability at once. Here the labels ask for these durations."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        n_states = 3
        durations = np.full((n_states, n_bins), 1e-6)
        for row in durations:
            row[rng.integers(n_bins, size=1 + n_bins // 8)] = rng.uniform(0.2, 1.0)
        model = hsmm.HSMM(
            states=("a", "b", "c"), symbols=("p", "q", "r"), initial=np.full(n_states, 1 / n_states),
            transitions=rng.dirichlet(np.ones(n_states), n_states), durations=durations,
            emissions=np.full((n_states, n_states), 1e-4) + np.eye(n_states),
        )  # fmt: skip
        codes = np.repeat(rng.integers(n_states, size=12), rng.integers(1, n_bins + 4, 12))
        path = hsmm.decode(model, np.array(model.symbols, dtype=object)[codes])
        assert path.log_score == pytest.approx(best_score(model, codes), abs=1e-8)


@pytest.mark.parametrize("censoring", ["none", "right"])
@pytest.mark.parametrize("weight", [1.0, 0.4])
def test_draws_follow_the_posterior(weight, censoring):
    # Pearson's statistic of 4,000 draws over the paths whose expected count is at least 5, the others pooled: with
    # f degrees of freedom its mean is f and its standard deviation sqrt(2 f); 4 of these leave 1 in 10,000 by chance.
    rng = np.random.default_rng(7)
    model = random_model(rng, 3, 3, 4)
    codes = rng.integers(3, size=6)
    observed = np.array(model.symbols, dtype=object)[codes]
    posterior = {path: probability(model, path, codes, weight, censoring) for path in all_paths(model, 6)}
    total = sum(posterior.values())
    n_draws = 4_000
    seen = dict.fromkeys(posterior, 0)
    for _ in range(n_draws):
        path = hsmm.sample(model, observed, rng, weight, censoring)
        taken = steps(model, path, 6)
        assert abs(path.log_score - math.log(posterior[taken])) < 1e-9
        seen[taken] += 1
    expected = np.array([posterior[p] / total * n_draws for p in posterior])
    counted = np.array([seen[p] for p in posterior], dtype=float)
    common = expected >= 5
    expected = np.append(expected[common], expected[~common].sum())
    counted = np.append(counted[common], counted[~common].sum())
    statistic = ((counted - expected) ** 2 / expected).sum()
    freedom = len(expected) - 1
    assert freedom > 50
    assert abs(statistic - freedom) < 4 * math.sqrt(2 * freedom)


@given(
    st.integers(0, 10_000),
    st.integers(1, 40),
    st.integers(1, 30),
    st.sampled_from([1.0, 0.3, 0.0]),
    st.sampled_from(["none", "right"]),
)
@settings(max_examples=60, deadline=None)
def test_no_path_scores_more_than_the_best_and_all_cover_the_sequence(seed, n_frames, n_bins, weight, censoring):
    rng = np.random.default_rng(seed)
    model = hsmm.floored(random_model(rng, 3, 2, n_bins, zeros=True), 1e-4)
    observed = np.array(model.symbols, dtype=object)[rng.integers(2, size=n_frames)]
    best = hsmm.decode(model, observed, weight, censoring)
    likelihood = hsmm.log_likelihood(model, observed, weight, censoring)
    assert best.log_score <= likelihood + 1e-9
    for path in (best, hsmm.sample(model, observed, rng, weight, censoring)):
        assert path.starts[0] == 0
        lengths = np.diff(np.append(path.starts, n_frames))
        assert lengths.min() >= 1
        assert lengths.max() <= n_bins
        assert path.log_score <= best.log_score + 1e-9


def log_sum(terms):
    """Log-sum-exp, minus infinity if there is nothing to sum."""
    largest = max(terms)
    return largest if largest == -math.inf else largest + math.log(math.fsum(math.exp(x - largest) for x in terms))


def ending_in_logarithms(model, codes):
    """The forward recursion of an explicit-duration model in logarithms, as in textbooks."""
    with np.errstate(divide="ignore"):
        initial, transitions, emissions, durations = (
            np.log(p) for p in (model.initial, model.transitions, model.emissions, model.durations)
        )
    n_states, n_bins = durations.shape
    emitted = np.concatenate([np.zeros((1, n_states)), np.cumsum(emissions.T[codes], axis=0)])
    enter, ending = [initial], []
    for t in range(1, len(codes) + 1):
        ending.append(
            [
                log_sum(
                    [
                        enter[t - k][j] + durations[j, k - 1] + emitted[t, j] - emitted[t - k, j]
                        for k in range(1, min(n_bins, t) + 1)
                    ]
                )
                for j in range(n_states)
            ]
        )
        enter.append([log_sum([ending[-1][i] + transitions[i, j] for i in range(n_states)]) for j in range(n_states)])
    return np.array(ending)


@pytest.mark.parametrize("seed", range(6))
def test_sums_are_exact_for_emissions_that_differ_by_hundreds_of_orders(seed):
    # States that agree with the symbols for a while and then not at all: sums rise and fall by exp(1000) and more
    # within one duration, so that the scaled sums of the kernel overflow, underflow and start again. As few durations
    # are possible, any loss in the scaling would be noticed.
    rng = np.random.default_rng(seed)
    model = random_model(rng, 3, 3, 60)
    sharp = np.full((3, 3), 1e-15) + np.eye(3)
    durations = model.durations * (rng.random((3, 60)).argsort(axis=1) < 4)
    model = dataclasses.replace(
        model,
        emissions=sharp / sharp.sum(axis=1, keepdims=True),
        durations=durations / durations.sum(axis=1, keepdims=True),
    )
    codes = np.repeat(rng.integers(3, size=12), rng.integers(1, 45, size=12))
    observed = np.array(model.symbols, dtype=object)[codes]
    expected = ending_in_logarithms(model, codes)
    ending, _, _, total = hsmm._filter(hsmm._logs(model, observed, 1.0, "none"))
    np.testing.assert_allclose(ending[:, 1:].T, expected[:-1], rtol=1e-12)
    assert total == pytest.approx(log_sum(expected[-1]), rel=1e-12)


def test_ties_are_broken_by_a_fixed_rule():
    model = hsmm.HSMM(
        states=("b", "a"),
        symbols=("p1",),
        initial=np.full(2, 0.5),
        transitions=np.full((2, 2), 0.5),
        emissions=np.ones((2, 1)),
        durations=np.full((2, 4), 0.25),
    )
    path = hsmm.decode(model, ["p1"] * 5)  # two segments of any states that meet anywhere
    assert path.labels.tolist() == ["b", "b"]
    assert path.starts.tolist() == [0, 4]


def test_the_first_segment_may_have_any_duration_up_to_the_longest():
    model = hsmm.HSMM(
        states=("a",),
        symbols=("p1",),
        initial=np.ones(1),
        transitions=np.ones((1, 1)),
        emissions=np.ones((1, 1)),
        durations=np.array([[0.0, 0.0, 1.0]]),
    )
    assert hsmm.decode(model, ["p1"] * 6).starts.tolist() == [0, 3]  # Alg. 1 as printed would start at t = 1 only
    with pytest.raises(ValueError, match="no path over 5 frames"):
        hsmm.decode(model, ["p1"] * 5)
    assert hsmm.decode(model, ["p1"] * 5, censoring="right").starts.tolist() == [0, 3]


# ---------------------------------------------------------------- estimate


def segment_table(labels, lengths, record="r"):
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return segments.from_starts(record, starts, labels, int(np.sum(lengths)), 1 / FRAME_S)


def test_the_counts_of_a_short_sequence_by_hand():
    # b b a b, of 2, 1, 3 and 9 frames; the last is longer than the 4 bins
    table = segment_table(["b", "b", "a", "b"], [2, 1, 3, 9])
    observed = ["p1"] * 4 + ["p2"] * 11
    counts = hsmm.count(table, observed, ("a", "b", "c"), ("p1", "p2", "p3"), 4)
    model = hsmm.estimate(counts, floor=0.0)
    assert model.states == ("a", "b")  # c does not occur
    np.testing.assert_allclose(model.initial, [0, 1])
    np.testing.assert_allclose(model.transitions, [[0, 1], [1 / 2, 1 / 2]])
    np.testing.assert_allclose(model.emissions, [[1 / 3, 2 / 3, 0], [3 / 12, 9 / 12, 0]])
    np.testing.assert_allclose(model.durations, [[0, 0, 1, 0], [1 / 3, 1 / 3, 0, 1 / 3]])
    doubled = hsmm.estimate(counts + counts, floor=0.0)
    np.testing.assert_allclose(doubled.durations, model.durations)


def test_the_floor_is_the_least_share_before_the_scaling_and_the_sums_stay_one():
    counts = hsmm.count(segment_table(["a", "b"], [2, 3]), ["p1"] * 5, ("a", "b"), ("p1", "p2"), 5)
    model = hsmm.estimate(counts, floor=0.01)
    np.testing.assert_allclose(model.durations[0], np.array([0.01, 1, 0.01, 0.01, 0.01]) / 1.04)
    np.testing.assert_allclose(model.emissions[0], np.array([1, 0.01]) / 1.01)
    np.testing.assert_allclose(model.transitions[1], [0.5, 0.5])  # b was never left: any state may follow


def test_smoothing_spreads_durations_and_keeps_their_mass():
    counts = hsmm.count(segment_table(["a", "a", "a"], [1, 5, 5]), ["p1"] * 11, ("a",), ("p1",), 9)
    added = hsmm.estimate(counts, 0.0, "additive", 0.5)
    np.testing.assert_allclose(added.durations[0], (np.array([1, 0, 0, 0, 2, 0, 0, 0, 0]) + 0.5) / 7.5)
    spread = hsmm.estimate(counts, 0.0, "kernel", 1.0).durations[0]
    gauss = np.exp(-0.5 * np.arange(-8, 9) ** 2)
    inner = gauss[4:13] / gauss[4:13].sum()  # the segments of 5 frames, in the middle
    edge = gauss[8:] / gauss[8:].sum()  # the segment of 1 frame, all of it on this side of the edge
    np.testing.assert_allclose(spread, (2 * inner + edge) / 3, atol=1e-12)


def test_planted_parameters_are_recovered_within_sampling_error():
    # Pearson's statistic of each multinomial against the planted probabilities, over the cells expected at least 5
    # times, lies within the 0.999 quantile of chi-square (Wilson-Hilferty); about 1 row in 1000 is outside by chance.
    rng = np.random.default_rng(11)
    planted = random_model(rng, 4, 5, 30)
    records = []
    for r in range(300):
        state = rng.choice(4, p=planted.initial)
        states, lengths, observed = [], [], []
        for _ in range(40):  # whole segments, so that the end of a sequence cuts none
            states.append(planted.states[state])
            lengths.append(int(rng.choice(30, p=planted.durations[state])) + 1)
            observed.append(rng.choice(5, p=planted.emissions[state], size=lengths[-1]))
            state = rng.choice(4, p=planted.transitions[state])
        symbols = np.array(planted.symbols, dtype=object)[np.concatenate(observed)]
        records.append(
            hsmm.count(segment_table(states, lengths, f"r{r}"), symbols, planted.states, planted.symbols, 30)
        )
    total = records[0]
    for counts in records[1:]:
        total = total + counts
    model = hsmm.estimate(total, floor=1e-9)
    for name in ("initial", "transitions", "emissions", "durations"):
        truth = np.atleast_2d(getattr(planted, name))
        found = np.atleast_2d(getattr(model, name))
        n = np.atleast_2d(getattr(total, name)).sum(axis=1)
        for row in range(len(truth)):
            expected, counted = truth[row] * n[row], found[row] * n[row]
            common = expected >= 5
            expected = np.append(expected[common], expected[~common].sum())
            counted = np.append(counted[common], counted[~common].sum())
            kept = expected > 0.5
            statistic = ((counted - expected)[kept] ** 2 / expected[kept]).sum()
            f = kept.sum() - 1
            quantile = f * (1 - 2 / (9 * f) + 3.0902 * math.sqrt(2 / (9 * f))) ** 3
            assert statistic < quantile, (name, row, statistic, quantile)


# ---------------------------------------------------------------- invalid input


def test_wrong_input_is_named():
    model = hsmm.floored(random_model(np.random.default_rng(0), 2, 2, 3), 1e-6)
    with pytest.raises(UserError, match="label 'p9' at 1; known are p1, p2"):
        hsmm.decode(model, ["p1", "p9"])
    with pytest.raises(UserError, match="no frame"):
        hsmm.decode(model, [])
    with pytest.raises(UserError, match="cover 3 frames, its observations 2"):
        hsmm.count(segment_table(["a"], [3]), ["p1", "p1"], ("a",), ("p1",), 4)
    with pytest.raises(UserError, match="label 'x'"):
        hsmm.count(segment_table(["x"], [2]), ["p1", "p1"], ("a",), ("p1",), 4)


@pytest.mark.parametrize("floor", [0.0, 1e-4])
@pytest.mark.parametrize("n_bins", [5, 41, 120])
@pytest.mark.parametrize("censoring", ["none", "right"])
def test_long_sequences_get_the_best_score_of_the_plain_recursion(censoring, n_bins, floor):
    # Longer than the window of frames whose scores are kept, with sparse durations.
    rng = np.random.default_rng(21)
    n_frames = 2 * hsmm_kernels.SPAN + 77
    model = random_model(rng, 3, 4, n_bins, zeros=True)
    model.durations[:2, rng.random(n_bins) > 0.1] = 0.0
    model.durations[:, -1] = 0.5
    model = dataclasses.replace(model, durations=hsmm._floored(model.durations, floor))
    codes = rng.integers(4, size=n_frames)
    with np.errstate(divide="ignore"):
        initial, transitions, durations = (
            np.log(values) for values in (model.initial, model.transitions, model.durations)
        )
        closing = np.log(np.minimum(np.cumsum(model.durations[:, ::-1], axis=1)[:, ::-1], 1.0))
    emitted = np.vstack([np.zeros(3), np.cumsum(np.log(model.emissions)[:, codes].T, axis=0)])
    starting, ending = np.full((2, n_frames + 1, 3), -np.inf)
    starting[0] = initial
    for t in range(1, n_frames + 1):
        lasting = closing if t == n_frames and censoring == "right" else durations
        for k in range(1, min(n_bins, t) + 1):
            ending[t] = np.maximum(ending[t], starting[t - k] + lasting[:, k - 1] + emitted[t] - emitted[t - k])
        starting[t] = (ending[t][:, None] + transitions).max(axis=0)
    path = hsmm.decode(model, np.array(model.symbols, dtype=object)[codes], censoring=censoring)
    assert path.log_score == pytest.approx(ending[n_frames].max(), rel=1e-12)
    assert np.diff(np.append(path.starts, n_frames)).max() <= n_bins
