"""Unsupervised clustering of prosody into intonation phrases (Özkul 2012, 4.1-4.2)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.vocabulary import prosody_labels
from cospeech.markov import labelled_hmm, parallel, parallel_start
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.markov.parallel import ParallelHMM

FEATURES = ("intensity", "pitch_lag", "pitch_gain", "d_intensity", "d_pitch_lag", "d_pitch_gain")
"""The prosody feature vector (Özkul 2012, eq. 4.5)."""

INITIAL_SEGMENT_FRAMES = (16, 32, 8)
"""Mean length of the random segments that initialise the restarts, in turn: 0.4, 0.8 and 0.2 s at 25 ms per frame."""


class Clusters(NamedTuple):
    """The chosen model, and the training history of all restarts (schema ``hmm_fit``)."""

    model: LabelledHMM
    fit: pd.DataFrame


def train(
    tables: list[pd.DataFrame],
    clusters: int,
    states: int,
    settings: dict[str, Any],
    seed: int,
) -> Clusters:
    """Cluster the prosody of several records into ``clusters`` intonation patterns with ``states`` states each.

    Parameters
    ----------
    tables : prosody tables, one per record.
    clusters, states : number of clusters, and of states per cluster.
    settings : ``phrases.prosody`` of the configuration: restarts, iterations, tolerance and variance_floor.
    seed : seed of the random initialisation.

    Returns
    -------
    The model with the highest likelihood of all restarts, with clusters p1 ... pM in order of mean intensity.

    Raises
    ------
    UserError : if a feature is constant, or the records are too short.
    """
    sequences = [labelled_hmm.feature_matrix(table, FEATURES) for table in tables]
    floor = parallel_start.variance_floor(sequences, FEATURES, settings["variance_floor"])
    fits, rows = [], []
    for restart in range(settings["restarts"]):
        rng = np.random.default_rng([seed, clusters, states, restart])
        length = INITIAL_SEGMENT_FRAMES[restart % len(INITIAL_SEGMENT_FRAMES)]
        start = parallel_start.from_clusters(sequences, clusters, states, length, floor, rng)
        fit = parallel.fit(start, sequences, floor, settings["iterations"], settings["tolerance"])
        fits.append(fit)
        rows.append(labelled_hmm.fit_table(fit, sequences, restart))
    best = int(np.argmax([fit.log_likelihoods[-1] for fit in fits]))
    table = pd.concat(rows, ignore_index=True)
    table["chosen"] = table["restart"] == best
    return Clusters(LabelledHMM(sort_branches(fits[best].model), prosody_labels(clusters), FEATURES), table)


def sort_branches(hmm: ParallelHMM) -> ParallelHMM:
    """Return the model with its branches sorted by mean intensity, then mean lag, so that labels are reproducible.

    States are weighted by their expected duration of 1 / (1 - stay) frames.
    """
    weight = 1.0 / (1.0 - hmm.stay)
    means = (hmm.mean * weight[:, :, None]).sum(axis=1) / weight.sum(axis=1)[:, None]
    order = np.lexsort((means[:, FEATURES.index("pitch_lag")], means[:, FEATURES.index("intensity")]))
    return ParallelHMM(*(values[order] for values in hmm))


def phrases(model: LabelledHMM, tables: dict[str, pd.DataFrame], frame_s: float) -> pd.DataFrame:
    """Return the intonation phrases of all records at the prosody rate (schema ``segments``).

    Parameters
    ----------
    model : the trained clusters.
    tables : prosody tables by record.
    frame_s : prosody frame period in seconds.
    """
    found = [labelled_hmm.phrases(model, record, table, 1.0 / frame_s) for record, table in tables.items()]
    return pd.concat(found, ignore_index=True)


def summary(fit: pd.DataFrame) -> str:
    """Return a one-line summary of the chosen restart for the log."""
    last = fit[fit["chosen"]].iloc[-1]
    return (
        f"restart {int(last['restart'])}, {int(last['iteration'])} iterations, alpha {last['alpha']:.3f}, "
        f"beta {last['beta']:.3f}, {int(last['unused_branches'])} unused clusters"
    )
