"""Mixture HMMs and networks of them against the sum and the maximum over all paths, and against hmmlearn."""

import itertools

import numpy as np
import pytest
from hmmlearn.hmm import GMMHMM
from scipy import special, stats

from cospeech.errors import UserError
from cospeech.markov import mixture_hmm
from cospeech.markov.mixture_hmm import MixtureHMM
from cospeech.markov.word_hmm import Clips


def draw_model(rng, n_states, n_components, n_features):
    weight = rng.dirichlet(np.full(n_components, 2.0), n_states)
    shape = (n_states, n_components, n_features)
    return MixtureHMM(rng.uniform(0.2, 0.8, n_states), weight, rng.normal(size=shape), rng.uniform(0.3, 2.0, shape))


def draw_clips(rng, lengths, n_features):
    length = np.array(lengths)
    return Clips(rng.normal(size=(length.sum(), n_features)), np.cumsum(length) - length, length)


def densities(model, frames):
    """Log densities from their definition, (T, S)."""
    parts = stats.norm(model.mean, np.sqrt(model.variance)).logpdf(frames[:, None, None]).sum(axis=-1)
    return special.logsumexp(parts + np.log(model.weight), axis=-1)


def paths_of_clip(model, frames):
    """Log-probabilities of all paths of a clip through a model, with its frames."""
    own, found = densities(model, frames), []
    for moves in itertools.combinations(range(1, len(frames)), len(model.stay) - 1):
        states = np.zeros(len(frames), dtype=int)
        states[list(moves)] = 1
        states = states.cumsum()
        leaves = np.append(states[1:] != states[:-1], True)
        steps = np.where(leaves, np.log1p(-model.stay[states]), np.log(model.stay[states]))
        found.append(own[np.arange(len(frames)), states].sum() + steps.sum())
    return np.array(found)


@pytest.mark.parametrize(("n_states", "n_components"), [(1, 1), (2, 3), (4, 2)])
def test_the_likelihood_is_the_sum_over_all_paths(n_states, n_components):
    rng = np.random.default_rng(n_states)
    for n_frames in range(n_states, 8):
        model, frames = draw_model(rng, n_states, n_components, 2), rng.normal(size=(n_frames, 2))
        expected = special.logsumexp(paths_of_clip(model, frames))
        assert mixture_hmm.log_likelihood(model, frames) == pytest.approx(expected, rel=1e-12)


def test_a_clip_shorter_than_the_model_is_impossible():
    rng = np.random.default_rng(1)
    assert mixture_hmm.log_likelihood(draw_model(rng, 3, 1, 2), rng.normal(size=(2, 2))) == -np.inf


def test_the_decoded_path_is_the_best_of_all_sequences_of_models():
    rng = np.random.default_rng(2)
    for _ in range(6):
        models = [draw_model(rng, n_states, 2, 2) for n_states in (1, 2, 3)]
        frames, prior = rng.normal(size=(6, 2)), rng.dirichlet(np.ones(3))
        best = -np.inf
        for n_passes in range(1, 7):
            for cuts in itertools.combinations(range(1, 6), n_passes - 1):
                bounds = [0, *cuts, 6]
                # Passes are independent of one another, so that each takes its best model.
                total = sum(
                    max(
                        np.log(prior[m]) + max(paths_of_clip(model, frames[a:b]), default=-np.inf)
                        for m, model in enumerate(models)
                    )
                    for a, b in itertools.pairwise(bounds)
                )
                best = max(best, total)
        found = mixture_hmm.decode(models, prior, frames)
        assert found.log_score == pytest.approx(best, rel=1e-12)
        starts = np.flatnonzero(found.begins)
        assert starts[0] == 0
        own = 0.0
        for a, b in zip(starts, [*starts[1:], 6], strict=True):
            assert len(set(found.branch[a:b])) == 1
            own += np.log(prior[found.branch[a]]) + paths_of_clip(models[found.branch[a]], frames[a:b]).max()
        assert own == pytest.approx(best, rel=1e-12)


def test_training_never_decreases_the_likelihood():
    rng = np.random.default_rng(3)
    for case in range(10):
        clips = draw_clips(rng, rng.integers(4, 12, 8), 3)
        floor = 0.05 * clips.frames.var(axis=0)
        first = mixture_hmm.start(clips, 3, 1 + case % 4, floor, rng)
        history = mixture_hmm.fit(first, clips, floor, 15).log_likelihoods
        assert np.all(np.diff(history) >= -1e-9 * np.abs(history[:-1]))


def test_expected_counts_equal_those_of_hmmlearn():
    rng = np.random.default_rng(4)
    ours = draw_model(rng, 3, 2, 2)
    frames = rng.normal(size=(30, 2))
    # hmmlearn may end in any state. Only the last one can have the last frame, so that its paths are ours.
    frames[-1] = 60.0
    ours.mean[2, 1] = 60.0
    peer = GMMHMM(3, 2, covariance_type="diag", n_iter=1, init_params="", params="mw", implementation="log",
                  means_weight=0.0, weights_prior=1.0, random_state=0)  # fmt: skip
    stay = np.append(ours.stay[:-1], 1.0)
    peer.startprob_, peer.transmat_ = np.array([1.0, 0.0, 0.0]), np.diag(stay) + np.diag(1.0 - stay[:-1], 1)
    peer.weights_, peer.means_, peer.covars_ = ours.weight, ours.mean, ours.variance
    as_peer = ours._replace(stay=np.append(ours.stay[:-1], 1.0 - 1e-12))
    clips = Clips(frames, np.array([0]), np.array([30]))
    updated = mixture_hmm.fit(as_peer, clips, np.full(2, 1e-6), 1).model
    assert mixture_hmm.log_likelihood(as_peer, frames) - np.log(1e-12) == pytest.approx(peer.score(frames), rel=1e-5)
    peer.fit(frames)
    assert np.allclose(updated.mean, peer.means_, rtol=1e-6)
    assert np.allclose(updated.weight, peer.weights_, rtol=1e-6)


def test_a_recording_shorter_than_every_model_is_refused():
    rng = np.random.default_rng(5)
    with pytest.raises(UserError, match="2 frames is shorter than every model"):
        mixture_hmm.decode([draw_model(rng, 3, 1, 2)], np.ones(1), rng.normal(size=(2, 2)))


def test_a_clip_shorter_than_the_model_is_refused():
    rng = np.random.default_rng(6)
    with pytest.raises(UserError, match="a clip of 2 frames is too short for a model of 3 states"):
        mixture_hmm.start(draw_clips(rng, [5, 2], 2), 3, 1, np.full(2, 1e-3), rng)


def test_planted_words_are_found_in_a_recording():
    rng = np.random.default_rng(7)
    means = {"noise": [0.0], "word": [3.0, -3.0, 3.0]}
    clips = {
        name: Clips(
            np.concatenate(
                [np.repeat(own, 6)[:, None] + 0.5 * rng.normal(size=(6 * len(own), 1)) for _ in range(20)]
            ),
            np.arange(20) * 6 * len(own),
            np.full(20, 6 * len(own)),
        )
        for name, own in means.items()
    }
    floor = np.array([0.01])
    models = [
        mixture_hmm.fit(mixture_hmm.start(clips[name], len(own), 1, floor, rng), clips[name], floor, 10).model
        for name, own in means.items()
    ]
    frames = np.concatenate([np.zeros(20), np.repeat(means["word"], 6), np.zeros(15)])[:, None]
    found = mixture_hmm.decode(models, np.array([0.5, 0.5]), frames + 0.5 * rng.normal(size=frames.shape))
    assert np.array_equal(np.flatnonzero(found.branch == 1), np.arange(20, 38))
