"""The inference layer on planted data: prosody that tells, with a lag, the hidden state of the kinematics."""

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.markov import crf, gaussian_hmm
from cospeech.synthesis.controller import inference
from cospeech.synthesis.controller.clusters import Range
from cospeech.synthesis.controller.inference import Settings

F0 = Range(60.0, 400.0)
SETTINGS = Settings((3,), n_clusters=4, window=4, hmm_iterations=15, cluster_iterations=20, crf_iterations=40)


def planted(rng, n_steps, lag=0):
    """Kinematics (T, 6) and prosody (T, 3) of a hidden chain of three states; prosody follows ``lag`` steps later."""
    states = [0]
    while len(states) < n_steps + lag:
        states.append(states[-1] if rng.random() < 0.9 else int(rng.integers(3)))
    states = np.array(states)
    kinematics = (states[lag:, None] - 1.0) * np.linspace(1.0, 2.5, 6) + rng.normal(0, 0.5, (n_steps, 6))
    driving = states[:n_steps]
    prosody = np.column_stack([50 + 6 * driving, -1.5 + 0.3 * driving, 120 + 40 * driving])
    prosody += rng.normal(size=prosody.shape) * [2.0, 0.15, 12.0]
    prosody[rng.random(n_steps) < 0.3, -1] = np.nan
    return kinematics, prosody


def trained(rng, lag=0, settings=SETTINGS, n_steps=1500):
    records = [planted(rng, n_steps, lag) for _ in range(2)]
    kinematics, prosody = ([*values] for values in zip(*records, strict=True))
    return inference.train(kinematics, prosody, F0, settings, seed=1), kinematics, prosody


def test_beliefs_find_the_planted_states():
    rng = np.random.default_rng(1)
    training, _, _ = trained(rng)
    kinematics, prosody = planted(rng, 600)
    layer = training.layer
    truth = gaussian_hmm.posterior(layer.hmm, layer.kinematics.apply(kinematics)).beliefs.argmax(axis=1)
    online, offline = inference.filtered(layer, prosody), inference.smoothed(layer, prosody)
    assert (online.argmax(axis=1) == truth).mean() > 0.85
    assert (offline.argmax(axis=1) == truth).mean() > (online.argmax(axis=1) == truth).mean()
    np.testing.assert_allclose(online.sum(axis=1), 1.0)


def test_online_beliefs_equal_those_of_the_whole_record_to_the_last_bit():
    rng = np.random.default_rng(2)
    layer = trained(rng, n_steps=300)[0].layer
    _, prosody = planted(rng, 80)
    online = inference.Beliefs(layer)
    np.testing.assert_array_equal([online.step(frame) for frame in prosody], inference.filtered(layer, prosody))


def test_a_planted_lag_needs_the_window_and_is_found_to_one_step():
    """The prosody of k steps ago tells the state of the kinematics: the CRF gives that lag the greatest weight."""
    rng = np.random.default_rng(3)
    for lag in (0, 2, 3):
        records = [planted(rng, 1500) for _ in range(2)]
        kinematics = [np.concatenate([np.repeat(values[:1], lag, axis=0), values])[:1500] for values, _ in records]
        prosody = [values for _, values in records]
        layer = inference.train(kinematics, prosody, F0, SETTINGS, seed=1).layer
        weights = layer.crf.observations.reshape(4, -1, 3)
        spread = (weights - weights.mean(axis=2, keepdims=True)).std(axis=(1, 2))
        assert int(np.argmax(spread)) == lag
        if lag > 0:
            new_kinematics, new_prosody = planted(rng, 800)
            new_kinematics = np.concatenate([np.repeat(new_kinematics[:1], lag, axis=0), new_kinematics])[:800]
            short = inference.train(kinematics, prosody, F0, SETTINGS._replace(window=1), seed=1).layer
            scores = [inference.score(one, new_kinematics, new_prosody) for one in (layer, short)]
            assert scores[0].filtered > scores[1].filtered + 0.05
            assert scores[0].kinematics > scores[1].kinematics


def test_remapped_hmm_gets_worse_with_longer_windows_and_the_field_does_not():
    rng = np.random.default_rng(4)
    records = [planted(rng, 1200) for _ in range(2)]
    # Step functions, as syllables are: neighbouring time steps repeat one another.
    held = [(np.repeat(k[::3], 3, axis=0), np.repeat(p[::3], 3, axis=0)) for k, p in records]
    kinematics, prosody = ([*values] for values in zip(*held, strict=True))
    new_kinematics, new_prosody = (np.repeat(values[::3], 3, axis=0) for values in planted(rng, 900))
    fields, remapped = [], []
    for window in (1, 5):
        settings = SETTINGS._replace(window=window)
        layer = inference.train(kinematics, prosody, F0, settings, seed=1).layer
        targets = inference.posteriors(layer.hmm, [layer.kinematics.apply(values) for values in kinematics])
        model = inference.remap(layer, targets, prosody, settings)
        fields.append(inference.score(layer, new_kinematics, new_prosody))
        remapped.append(inference.score_remapped(model, layer, new_kinematics, new_prosody))
    assert remapped[1].chain < remapped[0].chain - 0.1
    assert remapped[1].filtered < remapped[0].filtered - 0.1
    assert fields[1].chain > remapped[1].chain
    assert fields[1].chain > fields[0].chain - 0.02


def test_chain_score_of_the_remapped_hmm_is_that_of_an_equal_field():
    """A CRF whose weights are the logarithms of an HMM has the same P(q | x), apart from the first state."""
    rng = np.random.default_rng(5)
    training, kinematics, prosody = trained(rng, n_steps=200)
    layer = training.layer
    targets = inference.posteriors(layer.hmm, [layer.kinematics.apply(values) for values in kinematics])
    model = inference.remap(layer, targets, prosody, SETTINGS)._replace(initial=np.full(3, 1 / 3))
    densities = inference._remapped_scores(model, layer, prosody[0])
    same = crf.CRF(np.log(model.transitions), np.eye(3))
    chain = inference.score_remapped(model, layer, kinematics[0], prosody[0]).chain
    expected = crf.expected_log_probability(same, densities, targets[0]) / len(densities)
    assert chain == pytest.approx(expected, rel=1e-9)


def test_number_of_states_is_chosen_and_reported():
    rng = np.random.default_rng(6)
    training, _, _ = trained(rng, settings=SETTINGS._replace(n_states=(1, 3, 8)), n_steps=600)
    assert training.states.n_states == 3
    assert sorted(training.states.held_out) == [1, 3, 8]
    assert len(training.layer.hmm.mean) == 3


def test_a_feature_that_does_not_vary_is_refused_by_name():
    rng = np.random.default_rng(7)
    kinematics, prosody = planted(rng, 100)
    kinematics[:, 4] = 1.0
    with pytest.raises(UserError, match="curvature is the same"):
        inference.train([kinematics], [prosody], F0, SETTINGS, seed=1)
