"""Word HMMs against the sum over all paths and against hmmlearn, many at a time and far from their data."""

import itertools

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM
from scipy import special, stats

from cospeech.errors import UserError
from cospeech.markov import word_hmm
from cospeech.markov.word_hmm import Clips, WordHMMs


def draw_clips(rng, n_clips, shortest, longest, n_features, scale=1.0):
    length = rng.integers(shortest, longest + 1, n_clips)
    frames = scale * rng.normal(size=(length.sum(), n_features)) + 3.0
    return Clips(frames, np.cumsum(length) - length, length)


def draw_models(rng, n_models, n_states, n_features):
    stay = rng.uniform(0.2, 0.9, (n_models, n_states))
    stay[:, -1] = 1.0
    shape = (n_models, n_states, n_features)
    return WordHMMs(stay, rng.normal(3.0, 1.0, shape), rng.uniform(0.3, 2.0, shape))


def of_clip(clips, clip):
    return clips.frames[clips.begin[clip] : clips.begin[clip] + clips.length[clip]]


def log_weights(models, model, frames):
    """Paths of one model and their log-probabilities with the frames."""
    n_states = models.stay.shape[1]
    density = stats.norm(models.mean[model], np.sqrt(models.variance[model])).logpdf(frames[:, None]).sum(axis=2)
    paths, found = [], []
    for steps in itertools.product((0, 1), repeat=len(frames) - 1):
        path = np.cumsum([0, *steps])
        if path[-1] < n_states:
            with np.errstate(divide="ignore"):
                moves = np.where(
                    steps, np.log1p(-models.stay[model, path[:-1]]), np.log(models.stay[model, path[:-1]])
                )
            paths.append(path)
            found.append(density[np.arange(len(frames)), path].sum() + moves.sum())
    return np.array(paths), np.array(found)


@pytest.mark.parametrize("n_states", [1, 2, 4])
def test_likelihoods_equal_the_sum_over_all_paths(n_states):
    rng = np.random.default_rng(n_states)
    for n_models in (1, 3, 11):
        models, clips = draw_models(rng, n_models, n_states, 2), draw_clips(rng, 10, 1, 7, 2)
        found = word_hmm.log_likelihoods(models, clips)
        for clip, model in itertools.product(range(10), range(n_models)):
            _, weights = log_weights(models, model, of_clip(clips, clip))
            assert found[clip, model] == pytest.approx(special.logsumexp(weights), rel=1e-12)


def test_expected_counts_equal_those_over_all_paths():
    rng = np.random.default_rng(5)
    models, clips = draw_models(rng, 3, 3, 2), draw_clips(rng, 19, 1, 7, 2)
    owner = rng.integers(3, size=19)
    counts = word_hmm.expect(models, clips, owner)
    occupied, ended, first = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3, 2))
    for clip, model in enumerate(owner):
        frames = of_clip(clips, clip)
        paths, weights = log_weights(models, model, frames)
        shares = special.softmax(weights)
        for state in range(3):
            belief = shares @ (paths == state)
            occupied[model, state] += belief.sum()
            ended[model, state] += belief[-1]
            first[model, state] += belief @ (frames - counts.pivot)
    np.testing.assert_allclose(counts.occupied, occupied, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(counts.ended, ended, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(counts.first, first, rtol=1e-9, atol=1e-10)


def peer_of(models, model):
    n_states = models.stay.shape[1]
    peer = GaussianHMM(n_states, "diag", n_iter=1, init_params="", covars_prior=0.0, implementation="log")
    peer.startprob_ = np.eye(n_states)[0]
    peer.transmat_ = np.diag(models.stay[model]) + np.diag(1.0 - models.stay[model, :-1], 1)
    peer.means_, peer.covars_ = models.mean[model], models.variance[model]
    return peer


@pytest.mark.filterwarnings("ignore:Setting the shape on a NumPy array:DeprecationWarning:hmmlearn.utils")
def test_training_agrees_with_hmmlearn():
    rng = np.random.default_rng(7)
    clips, owner = draw_clips(rng, 24, 20, 40, 3), np.arange(24) % 4
    floor = np.full(3, 1e-9)
    begun = word_hmm.start(clips, owner, 4, 5, floor)
    fit = word_hmm.fit(begun, clips, owner, floor, iterations=6)
    for model in range(4):
        peer, own = peer_of(begun, model), np.flatnonzero(owner == model)
        frames = np.concatenate([of_clip(clips, clip) for clip in own])
        for step in range(6):
            assert fit.log_likelihoods[step, model] == pytest.approx(peer.score(frames, clips.length[own]), rel=1e-10)
            with np.errstate(divide="ignore"):
                peer.fit(frames, clips.length[own])
        np.testing.assert_allclose(fit.models.mean[model], peer.means_, rtol=1e-6)
        np.testing.assert_allclose(fit.models.stay[model], np.diagonal(peer.transmat_), atol=1e-6)


def test_no_update_of_any_model_lowers_its_likelihood_even_at_the_floor():
    rng = np.random.default_rng(11)
    for trial in range(10):
        clips, owner = draw_clips(rng, 9, 4, 15, 2), np.arange(9) % 3
        floor = np.array([0.5, 1e-3])
        begun = word_hmm.start(clips, owner, 3, 1 + trial % 4, floor)
        history = word_hmm.fit(begun, clips, owner, floor, iterations=12).log_likelihoods
        assert (np.diff(history, axis=0) > -1e-9 * np.abs(history[:-1])).all()


def test_models_far_from_the_data_neither_underflow_nor_overflow():
    rng = np.random.default_rng(13)
    models, clips = draw_models(rng, 2, 4, 2), draw_clips(rng, 3, 5, 8, 2, scale=1e4)
    found = word_hmm.log_likelihoods(models, clips)
    for clip, model in itertools.product(range(3), range(2)):
        _, weights = log_weights(models, model, of_clip(clips, clip))
        assert found[clip, model] == pytest.approx(special.logsumexp(weights), rel=1e-12)


def test_a_model_does_not_depend_on_what_is_trained_next_to_it():
    rng = np.random.default_rng(17)
    clips, owner = draw_clips(rng, 30, 10, 30, 2), np.arange(30) % 5
    floor = np.full(2, 1e-3)
    together = word_hmm.fit(word_hmm.start(clips, owner, 5, 3, floor), clips, owner, floor, 5).models
    alone, zeros = clips.chosen(np.flatnonzero(owner == 3)), np.zeros(6, dtype=np.int64)
    single = word_hmm.fit(word_hmm.start(alone, zeros, 1, 3, floor), alone, zeros, floor, 5).models
    np.testing.assert_allclose(together.mean[3], single.mean[0], rtol=1e-10)


def test_a_clip_that_is_too_short_is_refused():
    clips = draw_clips(np.random.default_rng(1), 2, 3, 3, 2)
    with pytest.raises(UserError, match="3 frames is too short for a word model of 4 states"):
        word_hmm.start(clips, np.zeros(2, dtype=np.int64), 1, 4, np.ones(2))
