"""The inference layer: from prosody to beliefs over the hidden states of gesture kinematics (Levine et al. 2010, 6).

Training has two stages (6.2). A Gaussian HMM learns the hidden states from the kinematics alone. Its posterior is
then fixed, and a conditional random field learns to infer it from prosody; its features are the probabilities that
the prosody of the last few time steps belongs to each of K clusters. The remapped HMM of Brand (1999), with which
figure 4 compares it, keeps the chain of the first HMM and replaces the densities of kinematics by those of prosody.

Kinematics and prosody are step functions, sampled at the same time steps of 1/15 to 1/10 s. The paper does not state
its step; at 60 Hz, an input window of four steps would span 50 ms, less than a syllable.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.kernels.jit import njit
from cospeech.markov import crf, crf_chain, gaussian_hmm
from cospeech.markov.crf import CRF, Targets
from cospeech.markov.gaussian_hmm import GaussianHMM
from cospeech.synthesis.controller import clusters, clusters_kernels
from cospeech.synthesis.controller.clusters import Clusters, Range

KINEMATICS = ("temporal_extent", "spatial_extent", "velocity", "acceleration", "curvature", "height")

PROSODY = ("intensity", "length", "f0")
"""The order of prosody features; F0 is NaN where a syllable is unvoiced."""

SMALLEST_BELIEF = 1e-300


class Settings(NamedTuple):
    """How to train the layer.

    Attributes
    ----------
    n_states : numbers of hidden states to choose from by held-out likelihood; 25 in the paper, for 12 minutes.
    n_clusters : clusters of prosody; not stated in the paper.
    window : time steps of the input window; 4 in the paper (figure 4).
    floor : minimum variances, as a share of the variance of each feature.
    hmm_iterations, cluster_iterations, crf_iterations : of EM, and of L-BFGS.
    penalty : of the squared weights of the CRF.
    """

    n_states: tuple[int, ...] = (25,)
    n_clusters: int = 10
    window: int = 4
    floor: float = 0.01
    hmm_iterations: int = 25
    cluster_iterations: int = 30
    crf_iterations: int = 80
    penalty: float = 1.0


class Scale(NamedTuple):
    """Brings features to a common range: ``mean`` (D,) is subtracted, and the result divided by ``sd`` (D,).

    For kinematics, these are the constants of 5.1: W = 1 / sd and B = exp(-mean).
    """

    mean: Floats
    sd: Floats

    def apply(self, values: Floats) -> Floats:
        """Return the scaled features (..., D)."""
        return (values - self.mean) / self.sd


class Inference(NamedTuple):
    """A trained inference layer.

    Attributes
    ----------
    kinematics, prosody : scales of the features.
    hmm : the HMM of scaled kinematics, whose Gaussians belong to the hidden states.
    clusters, f0 : clusters of scaled prosody, and the range of scaled F0 of unvoiced syllables.
    window : time steps of the input window.
    crf : infers the hidden states from prosody.
    """

    kinematics: Scale
    prosody: Scale
    hmm: GaussianHMM
    clusters: Clusters
    f0: Range
    window: int
    crf: CRF


class Training(NamedTuple):
    """A trained layer, and how its training went.

    Attributes
    ----------
    hmm, clusters : log-likelihoods during EM.
    objective : of the CRF, at the end.
    states : the choice of the number of states; None if there was only one candidate.
    """

    layer: Inference
    hmm: Floats
    clusters: Floats
    objective: float
    states: gaussian_hmm.Choice | None


class Remapped(NamedTuple):
    """The remapped HMM: the chain of the HMM of kinematics, with Gaussians of prosody.

    Attributes
    ----------
    initial, transitions : (S,) and (S, S).
    mean, covariance : (W, S, D) and (W, S, D, D), for each time step of the window, the latest first.
    """

    initial: Floats
    transitions: Floats
    mean: Floats
    covariance: Floats


class Scores(NamedTuple):
    """How well a model explains a pair of prosody and kinematics, per time step, in nats (6.3, figure 4).

    The paper reports a "likelihood per time step" without saying of what.

    Attributes
    ----------
    chain : expectation of log P(q | x) of the whole state sequence, over the posterior of the HMM of kinematics. It
        mostly rewards self transitions.
    filtered : expectation of log P(q_t | x_1 ... x_t), which an online controller works with.
    kinematics : log density of the kinematics under the filtered beliefs.
    """

    chain: float
    filtered: float
    kinematics: float


def fitted_scale(sequences: Sequence[Floats], names: Sequence[str]) -> Scale:
    """Return the scale that gives the known values of each feature a mean of 0 and a standard deviation of 1.

    Raises
    ------
    UserError : if a feature does not vary.
    """
    pooled = np.concatenate([*sequences])
    mean, sd = np.nanmean(pooled, axis=0), np.nanstd(pooled, axis=0)
    for name, value in zip(names, sd, strict=True):
        if not value > 0.0:
            raise UserError(
                f"{name} is the same at all time steps of the training records; leave these out or give more motion"
            )
    return Scale(mean, sd)


def train(
    kinematics: Sequence[Floats], prosody: Sequence[Floats], f0: Range, settings: Settings, seed: int
) -> Training:
    """Train the layer.

    Parameters
    ----------
    kinematics : (T, 6) of each record, in the order of ``KINEMATICS``, on a log scale.
    prosody : (T, 3) of each record, in the order of ``PROSODY``, at the same time steps.
    f0 : range of the F0 of unvoiced syllables, in the unit of the feature.

    Raises
    ------
    UserError : if a feature does not vary, or there is too little data.
    """
    rng = np.random.default_rng(seed)
    output_scale, input_scale = fitted_scale(kinematics, KINEMATICS), fitted_scale(prosody, PROSODY)
    outputs = [output_scale.apply(values) for values in kinematics]
    inputs = [input_scale.apply(values) for values in prosody]
    scaled_f0 = Range(*((np.array(f0) - input_scale.mean[-1]) / input_scale.sd[-1]))
    floor = np.full(len(KINEMATICS), settings.floor)
    choice = None
    n_states = settings.n_states[0]
    if len(settings.n_states) > 1:
        choice = gaussian_hmm.choose(outputs, settings.n_states, floor, settings.hmm_iterations, seed)
        n_states = choice.n_states
    begun = gaussian_hmm.start(outputs, n_states, floor, rng)
    hmm = gaussian_hmm.fit(begun, outputs, floor, settings.hmm_iterations)
    found = clusters.fit(
        np.concatenate(inputs), settings.n_clusters, scaled_f0, np.full(len(PROSODY), settings.floor),
        settings.cluster_iterations, rng,
    )  # fmt: skip
    features = _features(found.clusters, inputs, scaled_f0, settings.window)
    field = crf.fit(features, posteriors(hmm.model, outputs), settings.penalty, settings.crf_iterations)
    layer = Inference(output_scale, input_scale, hmm.model, found.clusters, scaled_f0, settings.window, field.model)
    return Training(layer, hmm.log_likelihoods, found.log_likelihoods, field.objective, choice)


def posteriors(hmm: GaussianHMM, outputs: Sequence[Floats]) -> list[Targets]:
    """Return the distribution over the hidden states of each sequence of scaled kinematics (T, 6)."""
    return [Targets(*gaussian_hmm.posterior(hmm, values)[1:]) for values in outputs]


def _features(found: Clusters, inputs: Sequence[Floats], f0: Range, window: int) -> list[Floats]:
    return clusters.windows([clusters.memberships(found, values, f0) for values in inputs], window)


def features(layer: Inference, prosody: Floats) -> Floats:
    """Return the features of the CRF, (T, window * K), of prosody (T, 3)."""
    return _features(layer.clusters, [layer.prosody.apply(prosody)], layer.f0, layer.window)[0]


def filtered(layer: Inference, prosody: Floats) -> Floats:
    """Return the online beliefs alpha_t (T, S), each given the prosody (T, 3) up to its time step."""
    return crf.filtered(layer.crf, features(layer, prosody))


def smoothed(layer: Inference, prosody: Floats) -> Floats:
    """Return the offline beliefs gamma_t (T, S), each given the prosody (T, 3) of the whole utterance."""
    return crf.smoothed(layer.crf, features(layer, prosody)).beliefs


@njit
def _step(
    prosody: Floats,
    mean: Floats,
    sd: Floats,
    f0: Floats,
    cluster_means: Floats,
    cluster_factors: Floats,
    cluster_weights: Floats,
    transitions: Floats,
    observations: Floats,
    recent: Floats,
    ahead: Floats,
    belief: Floats,
    begun: bool,
) -> None:
    """Continue the forward algorithm by one time step.

    Parameters
    ----------
    prosody : (1, 3), mean, sd : (3,) scale. f0 : (2,) range of an unknown F0.
    cluster_means, cluster_factors, cluster_weights : means (K, 3), Cholesky factors (K, 3, 3), and logarithms of the
        weights (K,).
    transitions, observations : of the CRF: exponentials of the transition weights (S, S), and observation weights
        (W * K, S).
    recent : (W, K) probabilities of the clusters, the latest first; updated.
    ahead, belief : what the last belief predicts, and the last belief, (S,) each; updated.
    begun : whether there was a time step before.
    """
    window, n_clusters = recent.shape
    frame, scores = np.empty((1, len(mean))), np.empty((1, n_clusters))
    for d in range(len(mean)):
        frame[0, d] = (prosody[0, d] - mean[d]) / sd[d]
    clusters_kernels.log_densities(frame, cluster_means, cluster_factors, f0[0], f0[1], scores)
    for lag in range(window - 1, 0, -1):
        recent[lag] = recent[lag - 1]
    clusters_kernels.shares(scores, cluster_weights, recent[:1])
    if not begun:
        recent[1:] = recent[0]
    if begun:
        crf_chain.predict(belief, transitions, ahead)
    observed = np.empty((1, len(belief)))
    crf_chain.products(recent.reshape(1, window * n_clusters), observations, observed)
    crf_chain.weigh(ahead, observed[0], belief)


class Beliefs:
    """The online beliefs, one time step at a time; equal to ``filtered`` to the last bit."""

    def __init__(self, layer: Inference) -> None:
        known = clusters.Memberships(layer.clusters, layer.f0)
        n_states = len(layer.hmm.mean)
        self._fixed = (
            layer.prosody.mean, layer.prosody.sd, np.array(layer.f0), layer.clusters.mean, known.factors,
            known.weights, crf.path_factors(layer.crf)[0], layer.crf.observations,
        )  # fmt: skip
        self._recent = np.zeros((layer.window, len(layer.clusters.weight)))
        self._memory = (np.ones(n_states), np.empty(n_states))
        self._begun = False

    def step(self, prosody: Floats) -> Floats:
        """Return the belief (S,), given the prosody (3,) of the next time step and of all earlier ones."""
        _step(prosody[None], *self._fixed, self._recent, *self._memory, self._begun)
        self._begun = True
        return self._memory[1].copy()


def remap(layer: Inference, targets: Sequence[Targets], prosody: Sequence[Floats], settings: Settings) -> Remapped:
    """Return the remapped HMM, whose densities are estimated with the fixed distribution over the hidden states.

    The time steps of the window are treated as independent given the state. They are not, and so the HMM gets worse
    with longer windows (6.3).

    Parameters
    ----------
    targets : the distribution over the states of each training record.
    prosody : (T, 3) of each training record.
    """
    inputs = [layer.prosody.apply(values) for values in prosody]
    weights = np.concatenate([target.beliefs for target in targets])
    floor = np.full(len(PROSODY), settings.floor)
    n_states = len(layer.hmm.mean)
    means, covariances = [], []
    for frames in _lagged(inputs, settings.window):
        mean, covariance = np.zeros((n_states, len(PROSODY))), np.tile(np.eye(len(PROSODY)), (n_states, 1, 1))
        for _ in range(settings.cluster_iterations):
            mean, covariance = clusters.weighted_gaussians(frames, weights, mean, covariance, layer.f0, floor)
        means.append(mean)
        covariances.append(covariance)
    return Remapped(layer.hmm.initial, layer.hmm.transitions, np.array(means), np.array(covariances))


def _lagged(inputs: Sequence[Floats], window: int) -> Floats:
    """Return the frames of all sequences at each lag, (W, T, D)."""
    stacked = np.concatenate(clusters.windows(inputs, window))
    return np.moveaxis(stacked.reshape(len(stacked), window, -1), 1, 0)


def _remapped_scores(model: Remapped, layer: Inference, prosody: Floats) -> Floats:
    """Return the log density of the prosody in each state, (T, S)."""
    frames = _lagged([layer.prosody.apply(prosody)], len(model.mean))
    parts = zip(frames, model.mean, model.covariance, strict=True)
    return sum(
        (clusters.log_densities(values, mean, covariance, layer.f0) for values, mean, covariance in parts),
        np.zeros((len(prosody), len(model.initial))),
    )


def score(layer: Inference, kinematics: Floats, prosody: Floats) -> Scores:
    """Return how well the CRF explains a record (T, 6) and (T, 3)."""
    outputs = layer.kinematics.apply(kinematics)
    target = posteriors(layer.hmm, [outputs])[0]
    chain = crf.expected_log_probability(layer.crf, features(layer, prosody), target)
    return _scores(layer, chain, target, filtered(layer, prosody), outputs)


def score_remapped(model: Remapped, layer: Inference, kinematics: Floats, prosody: Floats) -> Scores:
    """Return how well the remapped HMM explains a record (T, 6) and (T, 3)."""
    outputs = layer.kinematics.apply(kinematics)
    target = posteriors(layer.hmm, [outputs])[0]
    densities = _remapped_scores(model, layer, prosody)
    total, beliefs = gaussian_hmm.filtered(model.initial, model.transitions, densities)
    chain = (
        float(target.beliefs[0] @ np.log(model.initial))
        + float((target.transitions * np.log(model.transitions)).sum())
        + float((target.beliefs * densities).sum())
        - total
    )
    return _scores(layer, chain, target, beliefs, outputs)


def _scores(layer: Inference, chain: float, target: Targets, beliefs: Floats, outputs: Floats) -> Scores:
    n_steps = len(outputs)
    logs = np.log(np.maximum(beliefs, SMALLEST_BELIEF))
    densities = gaussian_hmm.log_densities(outputs, layer.hmm.mean, layer.hmm.covariance)
    explained = np.logaddexp.reduce(logs + densities, axis=1)
    return Scores(chain / n_steps, float((target.beliefs * logs).sum()) / n_steps, float(explained.mean()))
