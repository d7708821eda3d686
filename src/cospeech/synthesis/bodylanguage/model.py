"""The model of an actor's body language: a chain and a set of subunits per body section, and the motion library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.motion.library import Library
from cospeech.synthesis.bodylanguage import alignment, chain, forward, observations
from cospeech.synthesis.bodylanguage.chain import Chain
from cospeech.synthesis.bodylanguage.observations import FEATURES, N_OBSERVATIONS, Observed
from cospeech.synthesis.interface import Training

SECTIONS = ("head", "arms", "legs")
"""The body sections, each a stream of its own. The position of the root belongs to the last one."""


BLENDING = ("velocity", "smooth")
"""How subunits are joined: by the velocity-preserving blending of 5.5, or smoothly (``motion.blending.Transitions``).

On the actors of the demo, who stand still, 95 and 96 % of the joins stay within the accelerations of the recorded
motion, and only smooth transitions make the arms touch the trunk. Where the actor steps and turns (BEAT2, scott), 24
and 56 % of the joins do; if sections were joined in parent space, so that the trunk inclined with the hips of another
recording, it would be 13 and 28 %. Feet on the floor still slide there, at 0.10 m/s instead of 0.03.
"""


class Model(NamedTuple):
    """What is learnt from an actor.

    Attributes
    ----------
    chains : the hidden Markov model of each section.
    printed : (N, 2) the logistic curves as the thesis fits them, of each section, for comparison.
    subunits : section, segment (number within its record), record, start_frame, end_frame, cluster.
    library : the motion of the training records; its ``segment`` is the row of ``subunits``.
    mean, deviation : (4,) statistics of the speech, see ``observations.FEATURES``.
    wait_s : how long a silence is in doubt.
    mode : how the elapsed share is treated, see ``forward``.
    tolerance_deg : how much less similar the first pose of a subunit may be than that of the most similar one.
    blending : how subunits are joined (see ``BLENDING``).
    """

    chains: dict[str, Chain]
    printed: dict[str, Floats]
    subunits: pd.DataFrame
    library: Library
    mean: Floats
    deviation: Floats
    wait_s: float
    mode: str
    tolerance_deg: float
    blending: str


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the model of an actor.

    Parameters
    ----------
    settings : ``elapsed``, see ``forward.MODES``, ``blending``, see ``BLENDING``, and ``pose_tolerance_deg``.

    Raises
    ------
    UserError : if a setting is impossible, or the training records have no subunits.
    """
    for name, known in (("elapsed", forward.MODES), ("blending", BLENDING)):
        if settings[name] not in known:
            where = f"config: synthesis.systems.bodylanguage.{name}"
            raise UserError(f"{where}: '{settings[name]}' is unknown; use {', '.join(known)}")
    if settings["pose_tolerance_deg"] < 0.0:
        raise UserError("config: synthesis.systems.bodylanguage.pose_tolerance_deg must not be negative")
    records = [record for record in training.motions if record in training.subunits]
    if not records:
        raise UserError(f"actor {training.actor}: no training record has gesture subunits; add one with motion")
    subunits = _subunits(training, records)
    heard = observe(training)
    mean, deviation = observations.statistics_of(training.syllables.values())
    chains, printed = {}, {}
    for section, rows in subunits.groupby("section", sort=False):
        names, labels = rows["cluster"].max() + 1, rows["cluster"].to_numpy(dtype=np.int64)
        lengths = (rows["end_s"] - rows["start_s"]).to_numpy(dtype=float)
        paths = [
            alignment.align(heard[record], rows[rows["record"] == record])
            for record in records
            if len(heard.get(record, [])) > 1
        ]
        count = np.bincount(labels, minlength=names)
        chains[str(section)] = chain.estimate(paths, np.bincount(labels, lengths, names) / np.maximum(count, 1))
        printed[str(section)] = chain.printed_fit(paths, names)
    kept = subunits.drop(columns=["start_s", "end_s"])
    return Model(
        chains,
        printed,
        kept,
        _library(kept, training.motions),
        mean,
        deviation,
        observations.waiting_time_s(training.syllables.values()),
        settings["elapsed"],
        float(settings["pose_tolerance_deg"]),
        settings["blending"],
    )


def observe(training: Training) -> dict[str, list[Observed]]:
    """Return the observations of each training record."""
    wait_s = observations.waiting_time_s(training.syllables.values())
    found = {}
    for record, syllables in training.syllables.items():
        motion = training.motions[record]
        duration_s = len(motion) / skeleton.frame_rate(motion)
        found[record] = observations.observe(syllables, duration_s, training.frame_s, wait_s)
    return found


def _subunits(training: Training, records: list[str]) -> pd.DataFrame:
    """Return the subunits of all sections and records, with clusters numbered from 0 in each section.

    A cluster without subunits in these records, which a fold has left out, has no number.
    """
    parts = []
    for section in SECTIONS:
        table = pd.concat([training.subunits[record][section] for record in records], ignore_index=True)
        table["cluster"] = np.unique(table["cluster"], return_inverse=True)[1]
        table.insert(0, "section", section)
        parts.append(table)
    columns = ["section", "segment", "record", "start_frame", "end_frame", "cluster", "start_s", "end_s"]
    return pd.concat(parts, ignore_index=True)[columns]


def _library(subunits: pd.DataFrame, motions: Mapping[str, pd.DataFrame]) -> Library:
    """Return the motion library of the subunits of all sections; segments are numbered by their rows."""
    return Library.of_motions(subunits.assign(segment=np.arange(len(subunits))), motions)


# ---------------------------------------------------------------- tables


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return the model as tables; the motion of the library is that of the training records."""
    clusters, successors, seen = [], [], []
    for section, one in model.chains.items():
        n = len(one.initial)
        printed = model.printed[section]
        clusters.append(
            pd.DataFrame(
                {
                    "section": section,
                    "cluster": np.arange(n),
                    "length_s": one.length_s,
                    "initial": one.initial,
                    "continuing": one.continuing,
                    "intercept": one.logit[:, 0],
                    "slope": one.logit[:, 1],
                    "printed_intercept": printed[:, 0],
                    "printed_slope": printed[:, 1],
                }
            )
        )
        successors.append(
            pd.DataFrame(
                {
                    "section": section,
                    "from_cluster": np.repeat(np.arange(n), n),
                    "to_cluster": np.tile(np.arange(n), n),
                    "after_start": one.after_start.ravel(),
                    "after_continuation": one.after.ravel(),
                }
            )
        )
        seen.append(
            pd.DataFrame(
                {
                    "section": section,
                    "observation": np.repeat(np.arange(N_OBSERVATIONS), n),
                    "cluster": np.tile(np.arange(n), N_OBSERVATIONS),
                    "start": one.emissions[:, 0].ravel(),
                    "continuation": one.emissions[:, 1].ravel(),
                }
            )
        )
    return {
        "subunits": model.subunits,
        "clusters": pd.concat(clusters, ignore_index=True),
        "successors": pd.concat(successors, ignore_index=True),
        "observations": pd.concat(seen, ignore_index=True),
        "settings": pd.DataFrame(
            {
                "wait_s": [model.wait_s],
                "elapsed": [model.mode],
                "pose_tolerance_deg": [model.tolerance_deg],
                "blending": [model.blending],
            }
        ),
        "speech": pd.DataFrame({"feature": FEATURES, "mean": model.mean, "deviation": model.deviation}),
    }


def from_tables(tables: Mapping[str, pd.DataFrame]) -> Model:
    """Return the model of ``to_tables`` and of the motion tables of the training records, ``motion~<record>``.

    Raises
    ------
    UserError : if the motion of a record, or a probability, is missing.
    """
    chains, printed = {}, {}
    for section in SECTIONS:
        clusters, successors, seen = (
            tables[name][tables[name]["section"] == section] for name in ("clusters", "successors", "observations")
        )
        n = len(clusters)
        if n == 0 or len(successors) != n * n or len(seen) != n * N_OBSERVATIONS:
            raise UserError(
                f"model: the tables of the section '{section}' do not fit together; train the model again"
            )

        def column(name: str, table: pd.DataFrame) -> Floats:
            return table[name].to_numpy(dtype=np.float64).copy()

        emissions = np.stack([column(name, seen).reshape(N_OBSERVATIONS, n) for name in ("start", "continuation")], 1)
        chains[section] = Chain(
            column("initial", clusters),
            column("continuing", clusters),
            column("after_start", successors).reshape(n, n),
            column("after_continuation", successors).reshape(n, n),
            emissions,
            np.column_stack([column("intercept", clusters), column("slope", clusters)]),
            column("length_s", clusters),
        )
        printed[section] = np.column_stack([column("printed_intercept", clusters), column("printed_slope", clusters)])
    motions = {name.removeprefix("motion~"): table for name, table in tables.items() if name.startswith("motion~")}
    settings = tables["settings"].iloc[0]
    speech = tables["speech"].set_index("feature").loc[list(FEATURES)]
    return Model(
        chains,
        printed,
        tables["subunits"],
        _library(tables["subunits"], motions),
        speech["mean"].to_numpy(dtype=np.float64),
        speech["deviation"].to_numpy(dtype=np.float64),
        float(settings["wait_s"]),
        str(settings["elapsed"]),
        float(settings["pose_tolerance_deg"]),
        str(settings["blending"]),
    )
