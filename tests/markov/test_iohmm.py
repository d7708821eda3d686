"""The input-output HMM against all its paths, its training and its predictions."""

import numpy as np
import pytest
from chains import all_paths
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.markov import iohmm
from cospeech.markov.iohmm import Predictor, Sequence

N_INPUTS, N_STATES, N_OUTPUTS, N_FRAMES = 2, 3, 2, 5


def random_case(seed, n_frames=N_FRAMES):
    rng = np.random.default_rng(seed)
    model = iohmm.start(N_INPUTS, N_STATES, N_OUTPUTS, rng)
    return model, Sequence(rng.integers(N_INPUTS, size=n_frames), rng.integers(N_OUTPUTS, size=n_frames))


def enumerated(model, inputs):
    """All paths, and the probability of each given the inputs."""
    paths = all_paths(N_STATES, len(inputs))
    found = model.initial[inputs[0], paths[:, 0]]
    return paths, found * model.transitions[inputs[1:], paths[:, :-1], paths[:, 1:]].prod(axis=1)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_counts_are_those_of_all_paths(seed):
    model, (inputs, outputs) = random_case(seed)
    paths, prior = enumerated(model, inputs)
    own = prior * model.emissions[inputs, paths, outputs].prod(axis=1)
    counts = iohmm.expect(model, [Sequence(inputs, outputs)])
    assert counts.log_likelihood == pytest.approx(np.log(own.sum()), abs=1e-10)
    own /= own.sum()
    expected = tuple(np.zeros_like(values) for values in model)
    np.add.at(expected[0][inputs[0]], paths[:, 0], own)
    for t in range(N_FRAMES):
        np.add.at(expected[2][inputs[t]], (paths[:, t], outputs[t]), own)
        if t > 0:
            np.add.at(expected[1][inputs[t]], (paths[:, t - 1], paths[:, t]), own)
    for found, true in zip(counts[1:], expected, strict=True):
        np.testing.assert_allclose(found, true, atol=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, N_FRAMES))
def test_predictions_are_those_of_all_paths_and_need_only_the_past(seed, cut):
    model, (inputs, _) = random_case(seed)
    predictor = Predictor(model)
    found = np.concatenate([predictor.hear(inputs[:cut]), predictor.hear(inputs[cut:])])
    paths, prior = enumerated(model, inputs)
    for t in range(N_FRAMES):
        expected = (prior[:, None] * model.emissions[inputs[t], paths[:, t]]).sum(axis=0)
        np.testing.assert_allclose(found[t], expected, atol=1e-12)


@pytest.mark.parametrize("pseudo", [0.0, 0.1])
def test_training_never_lowers_the_objective(pseudo):
    for seed in range(8):
        model, sequence = random_case(seed, 200)
        objective = iohmm.fit(model, [sequence, sequence], 25, pseudo=pseudo).objective
        assert np.diff(objective).min() > -1e-9 * abs(objective[0])


def test_an_output_that_echoes_the_input_before_is_learnt():
    rng = np.random.default_rng(3)
    inputs = rng.integers(2, size=600)
    outputs = np.append(0, inputs[:-1])
    fits = [iohmm.fit(iohmm.start(2, 4, 2, rng), [Sequence(inputs, outputs)], 60) for _ in range(4)]
    best = max(fits, key=lambda fit: fit.objective[-1]).model
    fresh = rng.integers(2, size=400)
    found = Predictor(best).hear(fresh).argmax(axis=1)
    assert (found[1:] == fresh[:-1]).mean() > 0.99
