"""The parallel HMM against the sum and the maximum over all its paths, against hmmlearn, and on planted models."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM
from small import expected_counts, random_clamp, random_model, sample, weighted_paths

from cospeech.errors import UserError
from cospeech.markov import parallel
from cospeech.markov.parallel import FREE, MUST, NEVER, Clamp, ParallelHMM
from cospeech.markov.parallel_density import BLOCK
from cospeech.markov.parallel_scaled import KEPT

SHAPES = [(1, 1), (1, 2), (2, 1), (2, 2), (3, 1), (2, 3), (3, 2)]
FLOOR = 1e-3


def counts_of(expect, model, frames, clamp):
    """Return log-likelihood and counts of one implementation, by (branch, place) and with raw moments."""
    branches, states, features = model.mean.shape
    forms = parallel._forms(model)
    counts = expect(forms, frames, clamp or parallel.unclamped(branches))
    if np.isnan(counts.log_likelihood):
        return counts.log_likelihood, ()
    if isinstance(counts, parallel.Sums):
        counts = parallel._counts(forms, counts)
    pivot = counts.pivot[:, None]
    second = counts.second + 2 * pivot * counts.first + pivot**2 * counts.occupied
    first = counts.first + pivot * counts.occupied
    by_place = [values.reshape(states, branches).T for values in (counts.occupied, counts.stayed, counts.left)]
    moments = [values.T.reshape(states, branches, features).swapaxes(0, 1) for values in (first, second)]
    return counts.log_likelihood, (counts.entered, *by_place, *moments)


@pytest.mark.parametrize("clamped", [False, True])
def test_equals_all_paths_of_tiny_models(clamped):
    rng = np.random.default_rng(7 + clamped)
    possible = 0
    for trial in range(210):
        branches, states = SHAPES[trial % len(SHAPES)]
        n_frames = int(rng.integers(1, 7))
        model = random_model(rng, branches, states, 2)
        frames = rng.normal(size=(n_frames, 2))
        clamp = random_clamp(rng, branches, n_frames) if clamped else None
        paths, joint = weighted_paths(model, frames, clamp)
        if not joint.sum():
            assert parallel.log_likelihood(model, frames, clamp) == -np.inf
            with pytest.raises(UserError, match="no path"):
                parallel.decode(model, frames, clamp)
            with pytest.raises(UserError, match="no path"):
                parallel.expect(model, [frames], [clamp])
            continue
        possible += 1
        expected = expected_counts(model, frames, paths, joint / joint.sum())
        for expect in (parallel._expect_scaled, parallel._expect_exact):
            log_likelihood, counts = counts_of(expect, model, frames, clamp)
            assert log_likelihood == pytest.approx(np.log(joint.sum()), rel=1e-12, abs=1e-12)
            for found, true in zip(counts, expected, strict=True):
                np.testing.assert_allclose(found, true, rtol=1e-9, atol=1e-11)
        path = parallel.decode(model, frames, clamp)
        best = paths[int(joint.argmax())]
        assert path.score == pytest.approx(np.log(joint.max()), rel=1e-12, abs=1e-12)
        assert path.branch.tolist() == [m for m, _, _ in best]
        assert path.begins.tolist() == [begin for _, _, begin in best]
    assert possible > 100


def dense(model):
    """Return the model in the form of hmmlearn, states branch by branch."""
    branches, states, features = model.mean.shape
    first = np.arange(branches) * states
    transitions = np.diag(model.stay.ravel())
    for m in range(branches):
        for n in range(states):
            leave = 1 - model.stay[m, n]
            if n + 1 < states:
                transitions[m * states + n, m * states + n + 1] += leave
            else:
                transitions[m * states + n, first] += leave * model.entry
    peer = GaussianHMM(branches * states, covariance_type="diag", n_iter=1, init_params="", implementation="log")
    peer.startprob_ = np.zeros(branches * states)
    peer.startprob_[first] = model.entry
    peer.transmat_ = transitions
    peer.means_ = model.mean.reshape(-1, features)
    peer.covars_ = model.variance.reshape(-1, features)
    return peer


@pytest.mark.parametrize(("branches", "states"), [(1, 1), (3, 2), (8, 3), (5, 9), (11, 3)])
def test_equals_hmmlearn(branches, states):
    rng = np.random.default_rng([branches, states])
    model = random_model(rng, branches, states, 6)
    frames = [sample(model, n, rng)[0] for n in (1, BLOCK - 1, BLOCK, BLOCK + 1, 500)]
    peer = dense(model)
    for sequence in frames:
        assert parallel.log_likelihood(model, sequence) == pytest.approx(peer.score(sequence), rel=1e-9)
        if states > 1:  # with one state, staying and returning are one transition in hmmlearn and two here
            score, _ = peer.decode(sequence)
            assert parallel.decode(model, sequence).score == pytest.approx(score, rel=1e-9)


def test_counts_of_a_sequence_longer_than_what_is_kept_equal_the_exact_ones():
    rng = np.random.default_rng(5)
    model = random_model(rng, 3, 9, 2)  # nine vectors
    frames = sample(model, (KEPT // 9 + 2) * BLOCK + 5, rng)[0]
    (scaled, counts), (exact, true) = (
        counts_of(expect, model, frames, None) for expect in (parallel._expect_scaled, parallel._expect_exact)
    )
    assert scaled == pytest.approx(exact, rel=1e-12)
    for found, expected in zip(counts, true, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.filterwarnings("ignore:Setting the shape on a NumPy array:DeprecationWarning:hmmlearn.utils")
def test_one_update_equals_hmmlearn_s():
    # One branch is a ring, which hmmlearn can express; here its means and variances have no prior.
    rng = np.random.default_rng(3)
    model = random_model(rng, 1, 4, 3)
    sequences = [sample(random_model(rng, 1, 4, 3), n, rng)[0] for n in (200, 150)]
    peer = dense(model)
    peer.set_params(covars_prior=0.0, covars_weight=1.0, means_weight=0.0, min_covar=0.0, params="stmc")
    peer.fit(np.concatenate(sequences), [200, 150])
    after = parallel.maximise(model, parallel.expect(model, sequences), np.zeros(3))
    np.testing.assert_allclose(after.mean[0], peer.means_, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(after.variance[0], np.array([np.diag(c) for c in peer.covars_]), rtol=1e-9)
    np.testing.assert_allclose(after.stay[0], np.diag(peer.transmat_), rtol=1e-9)


@pytest.mark.parametrize("floor", [1e-6, 0.3, 5.0])
@pytest.mark.parametrize("clamped", [False, True])
def test_likelihood_never_falls(floor, clamped):
    rng = np.random.default_rng([int(floor * 10), clamped])
    for trial in range(12):
        branches, states = [(3, 2), (4, 3), (2, 5)][trial % 3]
        true = random_model(rng, branches, states, 3, spread=2.0)
        sequences = [sample(true, n, rng)[0] for n in (130, 70)]
        clamps = None
        if clamped:
            allowed = rng.random((200, branches)) < 0.9
            allowed[~allowed.any(axis=1)] = True
            clamps = [Clamp(a, np.zeros(len(a), np.int8)) for a in (allowed[:130], allowed[130:])]
            clamps = [c._replace(allowed=np.ones_like(c.allowed)) if trial % 2 else c for c in clamps]
            for clamp in clamps:
                clamp.cuts[40], clamp.cuts[50:60] = MUST, NEVER
            if any(parallel.log_likelihood(true, x, c) == -np.inf for x, c in zip(sequences, clamps, strict=True)):
                continue
        start = random_model(rng, branches, states, 3, spread=2.0)
        fit = parallel.fit(start, sequences, np.full(3, floor), 40, 0.0, clamps)
        steps = np.diff(fit.log_likelihoods)
        # A step may have no gain, apart from the rounding of sums of 200 terms.
        assert (steps >= -1e-12 * np.abs(fit.log_likelihoods[1:])).all()
        assert fit.model.variance.min() >= floor
        assert np.isfinite(np.concatenate([values.ravel() for values in fit.model])).all()


def test_finds_a_planted_model_again():
    rng = np.random.default_rng(11)
    true = ParallelHMM(
        np.array([0.5, 0.3, 0.2]),
        np.array([[0.8, 0.7], [0.85, 0.8], [0.6, 0.9]]),
        rng.normal(0, 3, (3, 2, 4)),
        rng.uniform(0.3, 1.0, (3, 2, 4)),
    )
    sequences = [sample(true, 5000, rng)[0] for _ in range(4)]
    start = true._replace(
        entry=np.full(3, 1 / 3), stay=np.full((3, 2), 0.5), mean=true.mean + rng.normal(0, 0.5, true.mean.shape)
    )
    found = parallel.fit(start, sequences, np.full(4, FLOOR), 60, 1e-9).model
    # Four standard errors of 20,000 frames in six states, about 3,000 per state and 300 passes through a branch.
    np.testing.assert_allclose(found.entry, true.entry, atol=4 * np.sqrt(0.25 / 1300))
    np.testing.assert_allclose(found.stay, true.stay, atol=4 * np.sqrt(0.16 / 1200))
    np.testing.assert_allclose(found.mean, true.mean, atol=4 * np.sqrt(1.0 / 1200))
    np.testing.assert_allclose(found.variance, true.variance, rtol=4 * np.sqrt(2.0 / 1200))


def test_training_stops_at_a_gain_per_frame_whatever_the_length_of_the_data():
    rng = np.random.default_rng(3)
    planted = random_model(rng, 2, 2, 2)
    sequences, start = [sample(planted, 200, rng)[0] for _ in range(2)], random_model(rng, 2, 2, 2)
    floor, tolerance = np.full(2, FLOOR), 0.003
    once = parallel.fit(start, sequences, floor, 100, tolerance).log_likelihoods
    many = parallel.fit(start, sequences * 5, floor, 100, tolerance).log_likelihoods
    gains = np.diff(once) / 400
    assert 3 < len(once) < 100
    assert (gains[:-1] >= tolerance).all()
    assert gains[-1] < tolerance
    np.testing.assert_allclose(many, 5 * once)


def test_a_state_that_no_frame_visits_keeps_its_parameters():
    rng = np.random.default_rng(5)
    model = random_model(rng, 3, 2, 2)
    far = model._replace(mean=model.mean.copy())
    far.mean[2] += 1e4
    fit = parallel.fit(far, [sample(model, 300, rng)[0]], np.full(2, FLOOR), 10)
    assert np.isfinite(np.concatenate([values.ravel() for values in fit.model])).all()
    np.testing.assert_array_equal(fit.model.mean[2], far.mean[2])
    np.testing.assert_array_equal(fit.model.stay[2], far.stay[2])
    assert fit.model.entry[2] < 1e-12


def test_extreme_outliers_are_survived_and_exact():
    rng = np.random.default_rng(9)
    model = random_model(rng, 4, 3, 6)
    model = model._replace(variance=model.variance * 0.01)
    frames = sample(model, 3000, rng)[0]
    frames[rng.choice(3000, 30)] *= 1e4
    frames[1500] = 1e8
    log_likelihood = parallel.log_likelihood(model, frames)
    assert np.isfinite(log_likelihood)
    assert log_likelihood == pytest.approx(dense(model).score(frames), rel=1e-9)
    fit = parallel.fit(model, [frames], np.full(6, FLOOR), 5)
    assert (np.diff(fit.log_likelihoods) > 0).all()


def test_scaled_probabilities_know_when_they_lose_the_path():
    # To leave the first branch, the path must pass through a state that fits no frame, with a probability that
    # underflows; staying costs little per frame, but more in total. The forward pass loses the best path, and the two
    # bounds must show it.
    model = ParallelHMM(
        np.array([1.0 - 1e-9, 1e-9]),
        np.full((2, 2), 0.5),
        np.array([[[0.0], [300.0]], [[8.0], [8.0]]]),
        np.ones((2, 2, 1)),
    )
    frames = np.concatenate([np.zeros((50, 1)), np.full((3000, 1), 8.0)])
    scaled, _ = counts_of(parallel._expect_scaled, model, frames, None)
    exact, _ = counts_of(parallel._expect_exact, model, frames, None)
    assert np.isnan(scaled)
    assert parallel.log_likelihood(model, frames) == exact == pytest.approx(dense(model).score(frames), rel=1e-9)


def test_two_passes_through_one_branch_are_two_segments():
    model = ParallelHMM(
        np.array([0.5, 0.5]),
        np.full((2, 2), 0.5),
        np.array([[[0.0], [5.0]], [[-5.0], [-9.0]]]),
        np.ones((2, 2, 1)),
    )
    frames = np.array([0, 0, 5, 5, 0, 5, 5, -5, -9], dtype=float)[:, None]
    path = parallel.decode(model, frames)
    assert path.branch.tolist() == [0] * 7 + [1] * 2
    assert np.flatnonzero(path.begins).tolist() == [0, 4, 7]


def test_clamped_spans_keep_branch_and_boundaries():
    rng = np.random.default_rng(2)
    model = random_model(rng, 3, 2, 2)
    frames = rng.normal(size=(40, 2))
    allowed = np.ones((40, 3), bool)
    allowed[10:20] = [False, False, True]
    cuts = np.full(40, FREE, np.int8)
    cuts[[10, 20]], cuts[11:20] = MUST, NEVER
    path = parallel.decode(model, frames, Clamp(allowed, cuts))
    assert (path.branch[10:20] == 2).all()
    assert np.flatnonzero(path.begins[10:21]).tolist() == [0, 10]


def test_alpha_and_beta_equal_all_paths():
    rng = np.random.default_rng(4)
    model = random_model(rng, 3, 2, 2)
    frames = [rng.normal(size=(n, 2)) for n in (9, 6)]
    paths = [parallel.decode(model, x) for x in frames]
    total = 0.0
    for x, path in zip(frames, paths, strict=True):
        starts = [*np.flatnonzero(path.begins), len(x)]
        for start, end in pairwise(starts):
            alone = []
            for m in range(3):
                branch = ParallelHMM(np.ones(1), *(values[m : m + 1] for values in model[1:]))
                never = Clamp(np.ones((end - start, 1), bool), np.full(end - start, NEVER, np.int8))
                alone.append(np.log(weighted_paths(branch, x[start:end], never)[1].sum()))
            first, second = sorted(alone, reverse=True)[:2]
            total += first - second
    assert parallel.beta(model, frames, paths) == pytest.approx(total / 15, rel=1e-12)
    assert parallel.alpha(-30.0, 15) == -2.0


def test_the_same_bytes_each_time():
    rng = np.random.default_rng(8)
    model = random_model(rng, 5, 3, 6)
    sequences = [sample(model, n, rng)[0] for n in (400, 300)]
    one, two = (
        parallel.fit(random_model(np.random.default_rng(1), 5, 3, 6), sequences, np.full(6, FLOOR), 8) for _ in "ab"
    )
    for first, second in zip(one.model, two.model, strict=True):
        assert first.tobytes() == second.tobytes()


def test_branches_beyond_one_vector_are_counted_as_in_logarithms():
    rng = np.random.default_rng(6)
    model = random_model(rng, 11, 3, 2)
    frames = sample(model, 2 * BLOCK + 5, rng)[0]
    clamp = random_clamp(rng, 11, len(frames))
    clamp = clamp._replace(cuts=np.where(clamp.cuts == MUST, FREE, clamp.cuts).astype(np.int8))
    for given in (None, clamp):
        (one, scaled), (other, exact) = (
            counts_of(expect, model, frames, given) for expect in (parallel._expect_scaled, parallel._expect_exact)
        )
        assert one == pytest.approx(other, rel=1e-12)
        for found, true in zip(scaled, exact, strict=True):
            np.testing.assert_allclose(found, true, rtol=1e-9, atol=1e-10)
