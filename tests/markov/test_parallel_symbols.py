"""The two-stream parallel HMM against all its paths, its training, and its decoding with a lag."""

import itertools

import numpy as np
import pytest
from chains import all_paths
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.markov import fixed_lag, parallel_symbols
from cospeech.markov.fixed_lag import FixedLag
from cospeech.markov.fixed_lag_beliefs import FixedLagBeliefs
from cospeech.markov.parallel import flat
from cospeech.markov.parallel_symbols import SymbolHMM

N_FRAMES = 4


def random_model(rng, branches, states, sizes=(2, 3), weights=(1.0, 1.0)):
    emissions = tuple(rng.dirichlet(np.ones(size), (branches, states)) for size in sizes)
    entry, stay = rng.dirichlet(np.ones(branches)), rng.uniform(0.1, 0.9, (branches, states))
    return SymbolHMM(entry, stay, emissions, weights)


def random_symbols(rng, n_frames=N_FRAMES, sizes=(2, 3)):
    return np.column_stack([rng.integers(size, size=n_frames) for size in sizes])


def dense(model):
    """Initial and transition probabilities of all states, written out; state s = n * M + m."""
    n_branches, n_states = len(model.entry), model.stay.size
    stay, moves = flat(model.stay), np.zeros((n_states, n_states))
    for s in range(n_states):
        moves[s, s] += stay[s]
        if s + n_branches < n_states:
            moves[s, s + n_branches] += 1 - stay[s]
        else:
            moves[s, :n_branches] += (1 - stay[s]) * model.entry
    return np.append(model.entry, np.zeros(n_states - n_branches)), moves


def enumerated(model, symbols):
    """All paths, and the weight of each by eq. 4.18."""
    initial, moves = dense(model)
    paths = all_paths(len(initial), len(symbols))
    weights = initial[paths[:, 0]] * moves[paths[:, :-1], paths[:, 1:]].prod(axis=1)
    for stream, (values, weight) in enumerate(zip(model.emissions, model.weights, strict=True)):
        weights = weights * (flat(values)[paths, symbols[:, stream]] ** weight).prod(axis=1)
    return paths, weights


def tiny(seed, weights=(1.0, 1.0), fewest=1):
    rng = np.random.default_rng(seed)
    branches, states = int(rng.integers(1, 4)), int(rng.integers(fewest, 3))
    return random_model(rng, branches, states, weights=weights), random_symbols(rng)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([(1.0, 1.0), (1.0, 0.2), (0.5, 2.0)]))
def test_counts_are_those_of_all_paths(seed, weights):
    model, symbols = tiny(seed, weights)
    paths, own = enumerated(model, symbols)
    counts = parallel_symbols.expect(model, [symbols])
    assert counts.score == pytest.approx(np.log(own.sum()), abs=1e-10)
    own /= own.sum()
    occupied = np.zeros_like(counts.occupied)
    together = parallel_symbols.combined(model, symbols)
    for t in range(N_FRAMES):
        np.add.at(occupied[together[t]], paths[:, t], own)
    np.testing.assert_allclose(counts.occupied, occupied, atol=1e-12)
    np.testing.assert_allclose(counts.final, np.bincount(paths[:, -1], own, model.stay.size), atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_the_best_path_is_that_of_all_paths(seed):
    model, symbols = tiny(seed, fewest=2)  # with one state, two ways to stay in it are two paths
    paths, own = enumerated(model, symbols)
    path = parallel_symbols.decode(model, symbols)
    found = path.state * len(model.entry) + path.branch
    assert own[(paths == found).all(axis=1)] == pytest.approx(own.max(), rel=1e-9)
    assert path.score == pytest.approx(np.log(own.max()), abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 6))
def test_beliefs_are_those_of_all_paths_up_to_the_lag(seed, lag):
    model, symbols = tiny(seed)
    densities = np.exp(parallel_symbols.log_densities(model))[parallel_symbols.combined(model, symbols)]
    beliefs = FixedLagBeliefs(model.entry, model.stay, lag)
    found = np.concatenate([*(beliefs.hear(densities[t : t + 1]) for t in range(N_FRAMES)), beliefs.end()])
    assert found.shape == densities.shape
    for t in range(N_FRAMES):
        paths, own = enumerated(model, symbols[: min(N_FRAMES, t + lag + 1)])
        expected = np.bincount(paths[:, t], own, model.stay.size) / own.sum()
        np.testing.assert_allclose(found[t], expected, atol=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 8))
def test_states_with_a_lag_are_on_the_best_path_to_the_end_of_the_lag(seed, lag):
    rng = np.random.default_rng(seed)
    model, n_frames = random_model(rng, 3, 2), 30
    densities = parallel_symbols.log_densities(model)[parallel_symbols.combined(model, random_symbols(rng, n_frames))]
    path = FixedLag(model.entry, model.stay, lag)
    found = np.concatenate([path.hear(densities[:7]), path.hear(densities[7:]), path.end()])
    expected = [
        fixed_lag.best_path(model.entry, model.stay, densities[: min(n_frames, t + lag + 1)])[0][t]
        for t in range(n_frames)
    ]
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("weights", [(1.0, 1.0), (1.0, 0.2)])
@pytest.mark.parametrize("pseudo", [0.0, 0.5])
def test_training_never_lowers_the_objective(weights, pseudo):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        sequences = [random_symbols(rng, 60, (3, 4)).repeat(2, axis=0) for _ in range(3)]
        start = parallel_symbols.start(sequences, (3, 4), weights, 3, 2, 8, rng)
        objective = parallel_symbols.fit(start, sequences, 25, pseudo=pseudo).objective
        assert np.diff(objective).min() > -1e-9 * abs(objective[0])


def test_split_models_share_all_but_their_emissions():
    model = random_model(np.random.default_rng(1), 3, 2)
    for stream in range(2):
        own = parallel_symbols.split(model, stream)
        assert own.entry is model.entry
        assert own.stay is model.stay
        assert own.emissions == (model.emissions[stream],)


def test_joint_patterns_of_the_example_are_found_with_their_asynchrony():
    """Figure 4.3 of the thesis: two joint patterns of two streams, which change at different times."""
    rng = np.random.default_rng(0)
    planted, symbols = [], []
    while len(planted) < 600:
        kind, early = int(rng.integers(2)), int(rng.integers(1, 4))
        first, second = ((0, 1), (2, 0))[kind]
        symbols += [(first, 2 if kind else 1)] * early + [(first, second)] * 8 + [(1, second)] * early
        planted += [kind] * (8 + 2 * early)
    symbols = np.array(symbols)
    fits = [
        parallel_symbols.fit(parallel_symbols.start([symbols], (3, 3), (1.0, 1.0), 2, 3, 12, rng), [symbols], 40)
        for _ in range(6)
    ]
    best = max(fits, key=lambda fit: fit.objective[-1]).model
    branch = parallel_symbols.decode(best, symbols).branch
    agreement = (branch == np.array(planted)).mean()
    assert max(agreement, 1 - agreement) > 0.95


def test_beta_is_the_mean_advantage_of_the_best_branch():
    rng = np.random.default_rng(2)
    model, symbols = random_model(rng, 2, 1), random_symbols(rng, 20)
    path = parallel_symbols.decode(model, symbols)
    densities = parallel_symbols.log_densities(model)[parallel_symbols.combined(model, symbols)]
    edges = np.append(np.flatnonzero(path.begins), len(symbols))
    total = 0.0
    for begin, end in itertools.pairwise(edges):
        own = densities[begin:end].sum(axis=0) + (end - begin - 1) * np.log(model.stay[:, 0])
        total += abs(own[0] - own[1])
    assert parallel_symbols.beta(model, [symbols], [path]) == pytest.approx(total / len(symbols))
