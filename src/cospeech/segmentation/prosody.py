"""Unsupervised clustering of prosody into intonation phrases (Özkul 2012, 4.1-4.2)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.vocabulary import prosody_labels
from cospeech.markov import parallel, parallel_start
from cospeech.markov.parallel import ParallelHMM
from cospeech.segmentation import labelled_hmm as models
from cospeech.segmentation.labelled_hmm import Labelled

FEATURES = ("intensity", "pitch_lag", "pitch_gain", "d_intensity", "d_pitch_lag", "d_pitch_gain")
"""The prosody feature vector (Özkul 2012, eq. 4.5)."""

SEGMENT_FRAMES = (16, 32, 8)
"""Mean length of the random segments that the restarts begin from, in turn: 0.4, 0.8 and 0.2 s at 25 ms a frame."""


class Clusters(NamedTuple):
    """The chosen model, and how the training of every restart went (schema ``hmm_fit``)."""

    model: Labelled
    fit: pd.DataFrame


def train(
    tables: list[pd.DataFrame],
    clusters: int,
    states: int,
    settings: dict[str, Any],
    seed: int,
) -> Clusters:
    """Cluster the prosody of several records into ``clusters`` intonation patterns of ``states`` states.

    Parameters
    ----------
    tables : prosody tables, one a record.
    settings : ``phrases.prosody`` of the configuration: restarts, iterations, tolerance and variance_floor.

    Returns
    -------
    The most likely of all restarts, its clusters named p1 ... pM by rising mean intensity.

    Raises
    ------
    UserError : where a feature never changes, or the records are too short.
    """
    sequences = [models.frames_of(table, FEATURES) for table in tables]
    floor = parallel_start.variance_floor(sequences, FEATURES, settings["variance_floor"])
    fits, rows = [], []
    for restart in range(settings["restarts"]):
        rng = np.random.default_rng([seed, clusters, states, restart])
        length = SEGMENT_FRAMES[restart % len(SEGMENT_FRAMES)]
        start = parallel_start.from_clusters(sequences, clusters, states, length, floor, rng)
        fit = parallel.fit(start, sequences, floor, settings["iterations"], settings["tolerance"])
        fits.append(fit)
        rows.append(models.fit_rows(fit, sequences, restart))
    best = int(np.argmax([fit.log_likelihoods[-1] for fit in fits]))
    table = pd.concat(rows, ignore_index=True)
    table["chosen"] = table["restart"] == best
    return Clusters(Labelled(in_order(fits[best].model), prosody_labels(clusters), FEATURES), table)


def in_order(hmm: ParallelHMM) -> ParallelHMM:
    """Return the model with its branches by rising mean intensity, then mean lag, so that names stay put.

    States count as long as they last, 1 / (1 - stay) frames.
    """
    weight = 1.0 / (1.0 - hmm.stay)
    means = (hmm.mean * weight[:, :, None]).sum(axis=1) / weight.sum(axis=1)[:, None]
    order = np.lexsort((means[:, FEATURES.index("pitch_lag")], means[:, FEATURES.index("intensity")]))
    return ParallelHMM(*(values[order] for values in hmm))


def phrases(model: Labelled, tables: dict[str, pd.DataFrame], frame_s: float) -> pd.DataFrame:
    """Return the intonation phrases of records, by name, at the prosody rate (schema ``segments``)."""
    found = [models.phrases(model, record, table, 1.0 / frame_s) for record, table in tables.items()]
    return pd.concat(found, ignore_index=True)


def summary(fit: pd.DataFrame) -> str:
    """Return one line on the chosen restart."""
    last = fit[fit["chosen"]].iloc[-1]
    return (
        f"restart {int(last['restart'])}, {int(last['iteration'])} iterations, alpha {last['alpha']:.3f}, "
        f"beta {last['beta']:.3f}, {int(last['unused_branches'])} clusters that no frame uses"
    )
