"""Small random models of a body section, paths drawn from them, and their forward probabilities by enumeration."""

from __future__ import annotations

import itertools

import numpy as np
from scipy import special

from cospeech.synthesis.bodylanguage import chain, observations


def random_chain(rng, n_clusters):
    leaving = rng.dirichlet(np.ones(n_clusters + 1), n_clusters)
    emissions = np.zeros((observations.N_OBSERVATIONS, 2, n_clusters))
    emissions[list(observations.OCCURRING)] = np.moveaxis(
        rng.dirichlet(np.full(len(observations.OCCURRING), 0.5), (2, n_clusters)), 2, 0
    )
    return chain.Chain(
        rng.dirichlet(np.ones(n_clusters)),
        leaving[:, 0].copy(),
        leaving[:, 1:].copy(),
        rng.dirichlet(np.ones(n_clusters), n_clusters),
        emissions,
        np.column_stack([rng.uniform(0.0, 3.0, n_clusters), rng.uniform(-6.0, -1.0, n_clusters)]),
        rng.uniform(0.3, 1.5, n_clusters),
    )


def continuation(model, cluster, elapsed):
    intercept, slope = model.logit[cluster]
    return special.expit(intercept + slope * elapsed)


def transition(model, cluster, started, elapsed):
    """The next states (cluster, started) and their probabilities; ``elapsed`` is that at the observation."""
    n = len(model.initial)
    if started:
        stay, others = model.continuing[cluster], model.after_start[cluster]
    else:
        stay = continuation(model, cluster, elapsed)
        others = (1.0 - stay) * model.after[cluster]
    return {(cluster, False): stay} | {(j, True): others[j] for j in range(n)}


def enumerated(model, seen, passed_s, ended=None):
    """The exact joint probability of each last state and its elapsed share, over all paths, normalised.

    Returns alpha (2, N) of start and continuation states, and the expected elapsed share of each c_i.
    """
    n = len(model.initial)
    states = [(i, started) for i in range(n) for started in (True, False)]
    alpha, moment = np.zeros((2, n)), np.zeros(n)
    for path in itertools.product(states, repeat=len(seen)):
        for first in range(n):
            cluster, started, elapsed, weight = first, True, 0.0, model.initial[first]
            for t, (following, begins) in enumerate(path):
                reached = elapsed + passed_s[t] / model.length_s[cluster]
                if not begins and following != cluster:
                    weight = 0.0
                    break
                weight *= transition(model, cluster, started, reached)[(following, begins)]
                weight *= model.emissions[seen[t], int(not begins), following]
                elapsed = 0.0 if begins else reached
                cluster, started = following, begins
            if ended is not None and not started and ended[cluster]:
                weight = 0.0
            alpha[int(not started), cluster] += weight
            if not started:
                moment[cluster] += weight * elapsed
    total = alpha.sum()
    return alpha / total, moment / np.where(alpha[1] > 0.0, alpha[1], 1.0)


def drawn_path(model, rng, n_steps, alike=False):
    """A path of the model. The elapsed share at each step is that at its end, which decides about going on.

    If ``alike``, f_i also decides at the first step of a subunit, instead of T_si,ci.
    """
    cluster, started, elapsed = int(rng.choice(len(model.initial), p=model.initial)), True, 0.0
    occurring = np.arange(observations.N_OBSERVATIONS)
    rows = []
    for _ in range(n_steps):
        seen = rng.choice(occurring, p=model.emissions[:, int(not started), cluster])
        elapsed += rng.uniform(0.05, 0.4) / model.length_s[cluster]
        options = transition(model, cluster, started and not alike, elapsed)
        rows.append((seen, cluster, started, elapsed))
        keys = list(options)
        cluster, started = keys[rng.choice(len(keys), p=list(options.values()))]
        elapsed = 0.0 if started else elapsed
    seen, clusters, starts, shares = (np.array(column) for column in zip(*rows, strict=True))
    return chain.Path(seen, clusters, starts, shares)
