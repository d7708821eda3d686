"""The parallel HMM against the sum and the maximum over all its paths, and against hmmlearn."""

import itertools

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM

from cospeech.errors import UserError
from cospeech.markov import parallel, parallel_start
from cospeech.markov.parallel import FREE, MUST, NEVER, Clamp, ParallelHMM


def random_model(rng, branches, states, features, spread=1.0):
    return ParallelHMM(
        rng.dirichlet(np.ones(branches)),
        rng.uniform(0.2, 0.95, (branches, states)),
        rng.normal(0, spread, (branches, states, features)),
        rng.uniform(0.3, 1.5, (branches, states, features)),
    )


def sample(model, n_frames, rng):
    """Draw a sequence (T, D), the branch of every frame and whether a segment begins there."""
    n_states = model.stay.shape[1]
    frames, branch, begins = [], [], []
    m, n, begin = rng.choice(len(model.entry), p=model.entry), 0, True
    while len(frames) < n_frames:
        frames.append(rng.normal(model.mean[m, n], np.sqrt(model.variance[m, n])))
        branch.append(m)
        begins.append(begin)
        begin = False
        if rng.random() >= model.stay[m, n]:
            n += 1
            if n == n_states:
                m, n, begin = rng.choice(len(model.entry), p=model.entry), 0, True
    return np.array(frames), np.array(branch), np.array(begins)


def random_clamp(rng, branches, n_frames):
    allowed = rng.random((n_frames, branches)) < 0.8
    cuts = rng.choice([FREE, MUST, NEVER], p=[0.8, 0.1, 0.1], size=n_frames).astype(np.int8)
    return Clamp(allowed, cuts)


def all_paths(model, n_frames, clamp=None):
    """Yield every path as (branch, place, begins) a frame, and its probability without the densities."""
    branches, states = model.stay.shape
    steps = list(itertools.product(range(branches), range(states)))

    def extend(path, probability):
        t = len(path)
        if t == n_frames:
            yield path, probability
            return
        cut = FREE if clamp is None or t == 0 else clamp.cuts[t]
        ways = []
        if t == 0:
            ways = [(m, 0, True, model.entry[m]) for m in range(branches)]
        else:
            m, n, _ = path[-1]
            leave = 1 - model.stay[m, n]
            if cut != MUST:
                ways.append((m, n, False, model.stay[m, n]))
                if n + 1 < states:
                    ways.append((m, n + 1, False, leave))
            if n + 1 == states and cut != NEVER:
                ways += [(k, 0, True, leave * model.entry[k]) for k in range(branches)]
        for m, n, begin, share in ways:
            if clamp is None or clamp.allowed[t, m]:
                yield from extend([*path, (m, n, begin)], probability * share)

    assert steps
    yield from extend([], 1.0)


def density(model, frame, m, n):
    variance = model.variance[m, n]
    return np.prod(np.exp(-0.5 * (frame - model.mean[m, n]) ** 2 / variance) / np.sqrt(2 * np.pi * variance))


def brute_force(model, frames, clamp=None):
    """Return the likelihood, the posterior of (branch, begins) a frame, and the best path with its probability."""
    total, best, best_path = 0.0, -1.0, None
    posterior = np.zeros((len(frames), *model.stay.shape))
    for path, share in all_paths(model, len(frames), clamp):
        joint = share * np.prod([density(model, x, m, n) for x, (m, n, _) in zip(frames, path, strict=True)])
        total += joint
        for t, (m, n, _) in enumerate(path):
            posterior[t, m, n] += joint
        if joint > best:
            best, best_path = joint, path
    return total, posterior / total if total > 0 else posterior, best, best_path


SHAPES = [(1, 1), (1, 2), (2, 1), (2, 2), (3, 1), (2, 3), (3, 2)]


@pytest.mark.parametrize("clamped", [False, True])
def test_all_paths_of_tiny_models(clamped):
    rng = np.random.default_rng(7 + clamped)
    impossible = 0
    for trial in range(210):
        branches, states = SHAPES[trial % len(SHAPES)]
        n_frames = int(rng.integers(1, 7))
        model = random_model(rng, branches, states, 2)
        frames = rng.normal(size=(n_frames, 2))
        clamp = random_clamp(rng, branches, n_frames) if clamped else None
        total, posterior, best, best_path = brute_force(model, frames, clamp)
        clamps = [clamp] if clamped else None
        if total == 0.0:
            impossible += 1
            assert parallel.log_likelihood(model, frames, clamp) == -np.inf
            with pytest.raises(UserError, match="no path"):
                parallel.decode(model, frames, clamp)
            with pytest.raises(UserError, match="no path"):
                parallel.expect(model, [frames], clamps)
            continue
        assert parallel.log_likelihood(model, frames, clamp) == pytest.approx(np.log(total), rel=1e-12, abs=1e-12)
        path = parallel.decode(model, frames, clamp)
        assert path.score == pytest.approx(np.log(best), rel=1e-12, abs=1e-12)
        assert path.branch.tolist() == [m for m, _, _ in best_path]
        assert path.begins.tolist() == [begin for _, _, begin in best_path]
        counts = parallel.expect(model, [frames], clamps)
        assert counts.log_likelihood == pytest.approx(np.log(total), rel=1e-12, abs=1e-12)
        occupied = np.swapaxes(posterior.sum(axis=0), 0, 1).ravel()
        np.testing.assert_allclose(counts.occupied, occupied, rtol=1e-9, atol=1e-12)
    assert impossible < 150
