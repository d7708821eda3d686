"""The conditional random field against the sum over all label sequences, and its training against differences."""

import numpy as np
import pycrfsuite
import pytest
from chains import all_paths, draw, expectations, path_weights, random_hmm
from scipy import special

from cospeech.errors import UserError
from cospeech.markov import crf, gaussian_hmm
from cospeech.markov.crf import CRF, Targets


def random_case(rng, labels, n_features, n_frames, scale=1.0):
    model = CRF(rng.normal(0, scale, (labels, labels)), rng.normal(0, scale, (n_features, labels)))
    return model, rng.normal(size=(n_frames, n_features))


def random_targets(rng, labels, n_frames):
    """A distribution over label sequences, with the paths and their probabilities."""
    paths = all_paths(labels, n_frames)
    probabilities = rng.dirichlet(np.full(len(paths), 0.3))
    return Targets(*expectations(paths, probabilities, labels)), paths, probabilities


@pytest.mark.parametrize("scale", [0.1, 1.0, 30.0])
def test_equals_the_sum_over_all_label_sequences(scale):
    rng = np.random.default_rng(1)
    for trial in range(60):
        labels, n_frames = 1 + trial % 4, 1 + trial % 6
        model, features = random_case(rng, labels, 3, n_frames, scale)
        paths = all_paths(labels, n_frames)
        weights = path_weights(np.zeros(labels), model.transitions, features @ model.observations, paths)
        beliefs, transitions = expectations(paths, special.softmax(weights), labels)
        found = crf.smoothed(model, features)
        assert found.log_partition == pytest.approx(special.logsumexp(weights), rel=1e-12, abs=1e-12)
        assert crf.log_partition(model, features) == found.log_partition
        np.testing.assert_allclose(found.beliefs, beliefs, atol=1e-11)
        np.testing.assert_allclose(found.transitions, transitions, atol=1e-11)
        targets, _, probabilities = random_targets(rng, labels, n_frames)
        expected = probabilities @ (weights - special.logsumexp(weights))
        assert crf.expected_log_probability(model, features, targets) == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_filtered_beliefs_are_those_of_the_frames_so_far():
    rng = np.random.default_rng(2)
    for _ in range(20):
        model, features = random_case(rng, 4, 3, 12)
        found = crf.filtered(model, features)
        for t in range(12):
            np.testing.assert_allclose(found[t], crf.smoothed(model, features[: t + 1]).beliefs[-1], atol=1e-12)


def test_lagged_beliefs_are_those_of_the_frames_up_to_the_delay():
    rng = np.random.default_rng(8)
    for delay in (0, 1, 3, 20):
        model, features = random_case(rng, 3, 2, 9)
        found = crf.lagged(model, features, delay)
        for t in range(9):
            known = crf.smoothed(model, features[: t + delay + 1]).beliefs
            inside = known[t : t + delay + 1]
            np.testing.assert_allclose(found[t, : len(inside)], inside, atol=1e-12)
            assert np.isnan(found[t, len(inside) :]).all()


def test_gradient_equals_differences_of_the_objective():
    rng = np.random.default_rng(3)
    for _ in range(15):
        labels, n_features = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        sequences, targets = [], []
        for n_frames in (1, 3, 4):
            model, features = random_case(rng, labels, n_features, n_frames)
            sequences.append(features)
            targets.append(random_targets(rng, labels, n_frames)[0])
        value, gradient = crf.objective(model, sequences, targets, 0.3)
        penalty = 0.15 * sum((weights**2).sum() for weights in model)
        expected = sum(crf.expected_log_probability(model, *pair) for pair in zip(sequences, targets, strict=True))
        assert value == pytest.approx(penalty - expected, rel=1e-12)
        for part in range(2):
            for place in np.ndindex(model[part].shape):
                values = []
                for step in (1e-5, -1e-5):
                    moved = [weights.copy() for weights in model]
                    moved[part][place] += step
                    values.append(crf.objective(CRF(*moved), sequences, targets, 0.3)[0])
                assert gradient[part][place] == pytest.approx((values[0] - values[1]) / 2e-5, rel=1e-6, abs=1e-7)


def test_training_ends_where_the_gradient_is_zero():
    rng = np.random.default_rng(4)
    sequences = [rng.normal(size=(n, 3)) for n in (20, 35)]
    targets = [Targets(*crf.smoothed(random_case(rng, 3, 3, 1)[0], features)[1:]) for features in sequences]
    fit = crf.fit(sequences, targets, penalty=0.5, iterations=500, tolerance=1e-9)
    value, gradient = crf.objective(fit.model, sequences, targets, 0.5)
    assert fit.objective == pytest.approx(value, rel=1e-12)
    assert max(np.abs(part).max() for part in gradient) < 1e-5
    for _ in range(20):  # convex: no other model is better
        other = CRF(*(weights + rng.normal(0, 0.1, weights.shape) for weights in fit.model))
        assert crf.objective(other, sequences, targets, 0.5)[0] > value


def test_finds_the_field_that_soft_targets_were_computed_with():
    rng = np.random.default_rng(5)
    planted, _ = random_case(rng, 3, 4, 1)
    sequences = [rng.normal(size=(400, 4)) for _ in range(3)]
    targets = [Targets(*crf.smoothed(planted, features)[1:]) for features in sequences]
    fit = crf.fit(sequences, targets, penalty=1e-6, iterations=500, tolerance=1e-10)
    for features, target in zip(sequences, targets, strict=True):
        np.testing.assert_allclose(crf.smoothed(fit.model, features).beliefs, target.beliefs, atol=1e-4)
    new = rng.normal(size=(50, 4))
    np.testing.assert_allclose(crf.filtered(fit.model, new)[10:], crf.filtered(planted, new)[10:], atol=1e-3)


def test_learns_hidden_states_from_the_posterior_of_an_hmm():
    rng = np.random.default_rng(6)
    hmm = random_hmm(rng, 3, 2, spread=4.0)
    outputs, states = draw(hmm, 2000, rng)
    inputs = np.eye(3)[states] + rng.normal(0, 0.5, (2000, 3))
    posterior = gaussian_hmm.posterior(hmm, outputs[:1500])
    fit = crf.fit([inputs[:1500]], [Targets(posterior.beliefs, posterior.transitions)], iterations=60)
    found = crf.filtered(fit.model, inputs[1500:])
    assert (found.argmax(axis=1) == states[1500:]).mean() > 0.9


def test_training_without_frames_is_refused():
    with pytest.raises(UserError, match="no frames"):
        crf.fit([], [])


def crfsuite(sequences, labels, penalty, path):
    """Train python-crfsuite; return its weights, with 0 where it has none, and its objective."""
    trainer = pycrfsuite.Trainer(algorithm="lbfgs", verbose=False)
    trainer.set_params({"c1": 0.0, "c2": penalty / 2, "max_iterations": 1000, "epsilon": 1e-7, "delta": 1e-10})
    trainer.set_params({"feature.possible_states": True, "feature.possible_transitions": True})
    for features, own in zip(sequences, labels, strict=True):
        items = [{str(f): float(x) for f, x in enumerate(row)} for row in features]
        trainer.append(pycrfsuite.ItemSequence(items), [str(label) for label in own])
    trainer.train(str(path))
    tagger = pycrfsuite.Tagger()
    tagger.open(str(path))
    found = tagger.info()
    n_labels = 1 + max(int(own.max()) for own in labels)
    model = CRF(np.zeros((n_labels, n_labels)), np.zeros((sequences[0].shape[1], n_labels)))
    for (one, other), weight in found.transitions.items():
        model.transitions[int(one), int(other)] = weight
    for (feature, label), weight in found.state_features.items():
        model.observations[int(feature), int(label)] = weight
    return model, trainer.logparser.last_iteration["loss"]


@pytest.mark.parametrize("seed", range(6))
def test_known_labels_give_the_objective_and_the_minimum_of_python_crfsuite(seed, tmp_path):
    """Features are positive: python-crfsuite leaves out those whose sum is not. It prints weights to six digits."""
    rng = np.random.default_rng(seed)
    n_labels, penalty = 2 + seed % 3, (0.3, 1.0, 4.0)[seed % 3]
    labels = [rng.integers(n_labels, size=n) for n in (60, 45)]
    sequences = [np.exp(np.eye(n_labels)[own] + rng.normal(0, 0.7, (len(own), n_labels))) for own in labels]
    targets = []
    for own in labels:
        beliefs = np.eye(n_labels)[own]
        targets.append(Targets(beliefs, beliefs[:-1].T @ beliefs[1:]))
    theirs, loss = crfsuite(sequences, labels, penalty, tmp_path / "model.crfsuite")
    value, gradient = crf.objective(theirs, sequences, targets, penalty)
    assert value == pytest.approx(loss, rel=1e-6)
    assert max(np.abs(part).max() for part in gradient) < 1e-2
    ours = crf.fit(sequences, targets, penalty, 1000, 1e-8)
    assert ours.objective == pytest.approx(loss, rel=1e-6)
    for one, other in zip(ours.model, theirs, strict=True):
        np.testing.assert_allclose(one, other, atol=2e-3)
