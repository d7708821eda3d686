"""Tiny parallel HMMs for the tests: random models, sequences drawn from them, and all their paths."""

from __future__ import annotations

import numpy as np

from cospeech.markov.parallel import FREE, MUST, NEVER, Clamp, ParallelHMM


def random_model(rng, branches, states, features, spread=1.0):
    return ParallelHMM(
        rng.dirichlet(np.ones(branches)),
        rng.uniform(0.2, 0.95, (branches, states)),
        rng.normal(0, spread, (branches, states, features)),
        rng.uniform(0.3, 1.5, (branches, states, features)),
    )


def sample(model, n_frames, rng):
    """Draw a sequence (T, D), the branch of every frame, and whether a segment begins there."""
    frames, branch, begins = [], [], []
    m, n, begin = rng.choice(len(model.entry), p=model.entry), 0, True
    while len(frames) < n_frames:
        frames.append(rng.normal(model.mean[m, n], np.sqrt(model.variance[m, n])))
        branch.append(m)
        begins.append(begin)
        begin = False
        if rng.random() >= model.stay[m, n]:
            n += 1
            if n == model.stay.shape[1]:
                m, n, begin = rng.choice(len(model.entry), p=model.entry), 0, True
    return np.array(frames), np.array(branch), np.array(begins)


def random_clamp(rng, branches, n_frames):
    cuts = rng.choice([FREE, MUST, NEVER], p=[0.8, 0.1, 0.1], size=n_frames)
    return Clamp(rng.random((n_frames, branches)) < 0.8, cuts.astype(np.int8))


def all_paths(model, n_frames, clamp=None):
    """Yield every path as a list of (branch, place, begins), with its probability before any density."""
    branches, states = model.stay.shape

    def steps(path):
        if not path:
            return [(m, 0, True, model.entry[m]) for m in range(branches)]
        cut = FREE if clamp is None else clamp.cuts[len(path)]
        m, n, _ = path[-1]
        stay, leave = model.stay[m, n], 1 - model.stay[m, n]
        ways = [] if cut == MUST else [(m, n, False, stay)]
        if n + 1 < states:
            return ways if cut == MUST else [*ways, (m, n + 1, False, leave)]
        return ways if cut == NEVER else ways + [(k, 0, True, leave * model.entry[k]) for k in range(branches)]

    def extend(path, probability):
        if len(path) == n_frames:
            yield path, probability
            return
        for m, n, begin, share in steps(path):
            if clamp is None or clamp.allowed[len(path), m]:
                yield from extend([*path, (m, n, begin)], probability * share)

    yield from extend([], 1.0)


def density(model, frame, m, n):
    variance = model.variance[m, n]
    return np.prod(np.exp(-0.5 * (frame - model.mean[m, n]) ** 2 / variance) / np.sqrt(2 * np.pi * variance))


def weighted_paths(model, frames, clamp=None):
    """Return all paths and their joint probabilities with the frames."""
    paths, joint = [], []
    for path, probability in all_paths(model, len(frames), clamp):
        paths.append(path)
        joint.append(
            probability * np.prod([density(model, x, m, n) for x, (m, n, _) in zip(frames, path, strict=True)])
        )
    return paths, np.array(joint)


def expected_counts(model, frames, paths, weights):
    """Return entered, occupied, stayed, left, first and second, averaged over the paths; all by (branch, place)."""
    branches, states = model.stay.shape
    entered, occupied = np.zeros(branches), np.zeros((branches, states))
    stayed, left = np.zeros((branches, states)), np.zeros((branches, states))
    first, second = np.zeros(model.mean.shape), np.zeros(model.mean.shape)
    for path, weight in zip(paths, weights, strict=True):
        for t, (m, n, begin) in enumerate(path):
            entered[m] += weight * begin
            occupied[m, n] += weight
            first[m, n] += weight * frames[t]
            second[m, n] += weight * frames[t] ** 2
            if t + 1 < len(path):
                again = path[t + 1] == (m, n, False)
                stayed[m, n] += weight * again
                left[m, n] += weight * (not again)
    return entered, occupied, stayed, left, first, second
