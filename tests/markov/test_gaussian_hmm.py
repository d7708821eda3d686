"""The Gaussian HMM against the sum over all its paths, against hmmlearn, and on planted models."""

from itertools import pairwise

import numpy as np
import pytest
from chains import all_paths, draw, expectations, path_weights, random_hmm
from hmmlearn.hmm import GaussianHMM as Peer
from scipy import optimize, special, stats

from cospeech.errors import UserError
from cospeech.markov import gaussian_hmm

FLOOR = np.full(2, 1e-3)


def density(model, frames):
    states = range(len(model.mean))
    return np.array([stats.multivariate_normal(model.mean[i], model.covariance[i]).logpdf(frames) for i in states]).T


def test_equals_the_sum_over_all_paths():
    rng = np.random.default_rng(1)
    for trial in range(100):
        states, n_frames = 1 + trial % 4, 2 + trial % 5
        model = random_hmm(rng, states, 2)
        frames = rng.normal(0, 2, (n_frames, 2))
        paths = all_paths(states, n_frames)
        weights = path_weights(np.log(model.initial), np.log(model.transitions), density(model, frames), paths)
        beliefs, transitions = expectations(paths, special.softmax(weights), states)
        found = gaussian_hmm.posterior(model, frames)
        assert found.log_likelihood == pytest.approx(special.logsumexp(weights), rel=1e-12)
        assert gaussian_hmm.log_likelihood(model, frames) == found.log_likelihood
        np.testing.assert_allclose(found.beliefs, beliefs, atol=1e-12)
        np.testing.assert_allclose(found.transitions, transitions, atol=1e-12)
        _, online = gaussian_hmm.filtered(model.initial, model.transitions, density(model, frames))
        for t in range(n_frames):
            known = gaussian_hmm.posterior(model, frames[: t + 1]).beliefs[-1]
            np.testing.assert_allclose(online[t], known, atol=1e-12)


def test_densities_that_underflow_are_summed_in_logarithms():
    model = random_hmm(np.random.default_rng(2), 2, 2)._replace(
        mean=np.array([[0.0, 0.0], [100.0, 0.0]]), covariance=np.tile(1e-2 * np.eye(2), (2, 1, 1)),
        transitions=np.array([[1.0, 0.0], [0.5, 0.5]]), initial=np.array([1.0, 0.0]),
    )  # fmt: skip
    frames = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 0.0]])
    expected = density(model, frames)[:, 0].sum()  # the only path
    found = gaussian_hmm.posterior(model, frames)
    assert found.log_likelihood == pytest.approx(expected, rel=1e-12)
    np.testing.assert_array_equal(found.beliefs, [[1, 0]] * 3)


@pytest.mark.filterwarnings("ignore:Setting the shape on a NumPy array:DeprecationWarning:hmmlearn.utils")
def test_equals_hmmlearn():
    rng = np.random.default_rng(3)
    for states in (1, 2, 5):
        model = random_hmm(rng, states, 3)
        sequences = [draw(model, n, rng)[0] for n in (80, 1, 120)]
        peer = Peer(states, covariance_type="full", n_iter=1, init_params="", covars_prior=0.0, covars_weight=0.0)
        peer.startprob_, peer.transmat_ = model.initial, model.transitions
        peer.means_, peer.covars_ = model.mean, model.covariance
        pooled, lengths = np.concatenate(sequences), [len(frames) for frames in sequences]
        score, beliefs = peer.score_samples(pooled, lengths)
        counts = gaussian_hmm.expect(model, sequences)
        ours = np.concatenate([gaussian_hmm.posterior(model, frames).beliefs for frames in sequences])
        assert counts.log_likelihood == pytest.approx(score, rel=1e-12)
        np.testing.assert_allclose(ours, beliefs, atol=1e-10)
        new = gaussian_hmm.maximise(model, counts, np.full(3, 1e-8))
        peer.fit(pooled, lengths)
        np.testing.assert_allclose(new.mean, peer.means_, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(new.covariance, peer.covars_, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(new.transitions, peer.transmat_, atol=2e-6 * states)
        np.testing.assert_allclose(new.initial, peer.startprob_, atol=2e-6 * states)


def test_the_first_model_is_that_of_the_nearest_centres():
    """Of clusters far apart, the first model has their means, covariances and transitions, each counted from one."""
    rng = np.random.default_rng(8)
    centres = np.array([[-20.0, 3.0], [5.0, -4.0], [30.0, 30.0]])
    labels = rng.integers(3, size=300)
    frames = centres[labels] + rng.normal(0, [1.0, 0.5], (300, 2))
    sequences = [frames[:100], frames[100:]]
    model = gaussian_hmm.start(sequences, 3, FLOOR, rng)
    order = [int(np.argmin(((model.mean - centre) ** 2).sum(axis=1))) for centre in centres]
    counts = np.ones((3, 3))
    for part in (labels[:100], labels[100:]):
        for before, after in pairwise(part):
            counts[before, after] += 1
    np.testing.assert_allclose(model.transitions[np.ix_(order, order)], counts / counts.sum(axis=1)[:, None])
    begun = 1.0 + np.bincount(labels[[0, 100]], minlength=3)
    np.testing.assert_allclose(model.initial[order], begun / begun.sum())
    for i, state in enumerate(order):
        np.testing.assert_allclose(model.mean[state], frames[labels == i].mean(axis=0))
        np.testing.assert_allclose(model.covariance[state], np.cov(frames[labels == i].T, bias=True))


def test_states_without_a_frame_start_with_the_variance_of_all_frames():
    frames = np.array([[1.0, 10.0]] * 4 + [[3.0, 50.0]] * 4)  # two places for four states
    model = gaussian_hmm.start([frames], 4, FLOOR, np.random.default_rng(9))
    variances = sorted(np.diag(one).tolist() for one in model.covariance)
    np.testing.assert_allclose(variances, [FLOOR.tolist()] * 2 + [[1.0, 400.0]] * 2)


def test_training_stops_when_the_gain_per_frame_falls_below_the_tolerance():
    rng = np.random.default_rng(10)
    frames = rng.normal(size=(200, 2))  # without any structure, the gains are small and fall slowly
    model = gaussian_hmm.start([frames], 3, FLOOR, rng)
    everything = gaussian_hmm.fit(model, [frames], FLOOR, 20).log_likelihoods
    gains = np.diff(everything) / len(frames)
    assert (gains > 0).all()
    for stop in range(len(gains)):
        smallest = gains[: stop + 1].min()
        if smallest < gains[:stop].min(initial=np.inf):
            fit = gaussian_hmm.fit(model, [frames], FLOOR, 20, tolerance=smallest * (1 + 1e-9))
            np.testing.assert_allclose(fit.log_likelihoods, everything[: stop + 2])


def test_likelihood_rises_with_every_update_even_at_the_floor():
    rng = np.random.default_rng(4)
    reached = 0
    for trial in range(25):
        frames = np.repeat(rng.normal(size=(12, 2)), rng.integers(2, 9, 12), axis=0)  # held, as kinematics are
        floor = np.array([0.05, 0.2]) * rng.uniform(0.1, 2.0)
        states = 2 + trial % 4
        model = gaussian_hmm.start([frames], states, floor, rng)
        fit = gaussian_hmm.fit(model, [frames], floor, 25)
        for before, after in pairwise(fit.log_likelihoods):
            assert after >= before - 1e-9 * abs(before)
        relative = fit.model.covariance / np.sqrt(np.outer(floor, floor))
        smallest = np.linalg.eigvalsh(relative).min(axis=1)
        assert (smallest >= 1.0 - 1e-9).all()
        reached += (smallest < 1.0 + 1e-9).sum()
        assert fit.model.transitions.min() >= gaussian_hmm.LEAST_TRANSITION * (1 - 1e-9)
    assert reached > 25


def test_floored_covariance_is_the_constrained_maximum():
    rng = np.random.default_rng(5)
    for _ in range(15):
        factor = rng.normal(size=(3, 3)) * rng.uniform(0.1, 1.0, 3)[:, None]
        sample, floor = factor @ factor.T, rng.uniform(0.05, 0.8, 3)

        def cost(vector, sample=sample, floor=floor):
            root = np.zeros((3, 3))
            root[np.tril_indices(3)] = vector
            covariance = np.diag(floor) + root @ root.T
            return np.linalg.slogdet(covariance)[1] + np.trace(np.linalg.solve(covariance, sample))

        found = gaussian_hmm.floored_covariance(sample[None], floor)[0]
        assert np.linalg.eigvalsh(found - np.diag(floor)).min() > -1e-12
        ours = np.linalg.slogdet(found)[1] + np.trace(np.linalg.solve(found, sample))
        others = [optimize.minimize(cost, rng.normal(size=6)).fun for _ in range(3)]
        assert ours <= min(others) + 1e-9


def test_floored_probabilities_are_the_constrained_maximum():
    rng = np.random.default_rng(6)
    for _ in range(30):
        counts, least = rng.exponential(size=4) ** 3, 0.1
        found = gaussian_hmm.floored_probabilities(counts, least)
        assert found.sum() == pytest.approx(1.0)
        assert found.min() >= least - 1e-15
        others = least + (1 - 4 * least) * rng.dirichlet(np.ones(4), 2000)
        assert (np.log(others) @ counts).max() <= np.log(found) @ counts + 1e-9


def test_recovers_a_planted_model_and_its_number_of_states():
    rng = np.random.default_rng(7)
    planted = random_hmm(rng, 3, 2)._replace(mean=np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]]))
    frames, _ = draw(planted, 3000, rng)
    choice = gaussian_hmm.choose([frames[:1500], frames[1500:]], (1, 2, 3, 5, 8), FLOOR, 15, seed=1)
    assert choice.n_states == 3
    fit = gaussian_hmm.fit(gaussian_hmm.start([frames], 3, FLOOR, rng), [frames], FLOOR, 40)
    order = [int(np.argmin(((fit.model.mean - mean) ** 2).sum(axis=1))) for mean in planted.mean]
    np.testing.assert_allclose(fit.model.mean[order], planted.mean, atol=0.15)
    np.testing.assert_allclose(fit.model.covariance[order], planted.covariance, atol=0.2)
    np.testing.assert_allclose(fit.model.transitions[np.ix_(order, order)], planted.transitions, atol=0.05)


def test_too_few_frames_are_refused():
    with pytest.raises(UserError, match="too few for 5 hidden states"):
        gaussian_hmm.start([np.zeros((4, 2))], 5, FLOOR, np.random.default_rng(0))
    with pytest.raises(UserError, match="too few frames"):
        gaussian_hmm.choose([np.zeros((4, 2))], (5,), FLOOR, 2, seed=0)
