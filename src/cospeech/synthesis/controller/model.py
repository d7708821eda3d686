"""The trained gesture controller: an inference layer, a control layer, and how they are learned from an actor.

Styles are learned from the actor's own motion, where the paper has recordings of speakers in other moods (8.2). The
records are cut into stretches of ``STRETCH_S``, which are sorted by the mean speed of the hands; the phases of the
fastest third are the example of the style ``energetic``, those of the slowest third of ``calm``, and all phases are
the neutral data set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Library
from cospeech.synthesis.controller import control, inference, situations, steps, style
from cospeech.synthesis.controller.clusters import Range
from cospeech.synthesis.controller.control import Balance, Control
from cospeech.synthesis.controller.inference import KINEMATICS, Inference
from cospeech.synthesis.controller.style import Transform
from cospeech.synthesis.interface import Training

FASTEST, SLOWEST = "energetic", "calm"

STRETCH_S = 5.0

EXAMPLES = 3
"""The share of stretches that are examples of a style is one in this many."""

FEWEST = 6
"""Stretches that an actor must have for styles; with fewer, there is only the neutral one."""


class Model(NamedTuple):
    """A trained controller.

    Attributes
    ----------
    layer : the inference layer.
    control : the control layer.
    pause_db : intensity of pauses (see ``steps``).
    held_out : log-likelihood per time step of the numbers of hidden states that were tried; empty if there was one.
    """

    layer: Inference
    control: Control
    pause_db: float
    held_out: Mapping[int, float]


class Segments(NamedTuple):
    """A motion library on time steps.

    Attributes
    ----------
    library : its A segments. per_step : motion frames per time step.
    kinematics : (A, 6) in the order of ``KINEMATICS``, on a log scale.
    """

    library: Library
    per_step: int
    kinematics: Floats


class Steps(NamedTuple):
    """The training records on time steps: kinematics (T, 6), and prosody (T, 3) as it is known at each of them."""

    kinematics: list[Floats]
    prosody: list[Floats]


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the controller of an actor, whose motion is also its library.

    Parameters
    ----------
    settings : those of the system (see ``SYSTEMS``).

    Raises
    ------
    UserError : if there is not enough speech and motion.
    """
    found = segments_of(training)
    pause_db = steps.pause_intensity(training.syllables.values())
    known = steps_of(found, training.syllables, pause_db)
    low, high = settings["unvoiced_hz"]
    trained = inference.train(
        known.kinematics, known.prosody, Range(low, high), layer_settings(settings), seed_of(training)
    )
    phases = pd.concat(list(training.phases.values()))
    transforms = tones(trained.layer, phases)
    if settings["situations"]:
        heard = [inference.filtered(trained.layer, prosody) for prosody in known.prosody]
        plan = situations.of_beliefs(heard, settings["situations"], np.random.default_rng(seed_of(training)))
    else:
        plan = situations.of_states(trained.layer.hmm.transitions)
    built = control.build(trained.layer, *found, transforms, {}, balance_of(settings), plan)
    return Model(trained.layer, built, pause_db, trained.states.held_out if trained.states else {})


def layer_settings(settings: Mapping[str, Any]) -> inference.Settings:
    """Return how the inference layer is trained under the settings of the system."""
    return inference.Settings(tuple(settings["states"]), settings["clusters"], settings["window"])


def balance_of(settings: Mapping[str, Any]) -> Balance:
    """Return the settings of the control layer."""
    return Balance(*(settings[name] for name in Balance._fields))


def seed_of(training: Training) -> int:
    """Return the seed of training, which depends on the training records only."""
    return int(random_source(0, "controller", training.actor, *sorted(training.phases)).integers(2**31))


def segments_of(training: Training) -> Segments:
    """Return the motion library of the training records."""
    phases = pd.concat(list(training.phases.values()), ignore_index=True)
    return on_steps(Library.of_motions(phases, training.motions), phases)


def on_steps(library: Library, phases: pd.DataFrame) -> Segments:
    """Return a library whose segments begin and end at time steps.

    Parameters
    ----------
    library : its segments are phases.
    phases : the same phases with their kinematic parameters (schema ``phases``).

    Raises
    ------
    UserError : if no recording is as long as a time step.
    """
    ordered = phases.sort_values(["record", "start_frame"], kind="stable")
    kinematics = ordered[list(KINEMATICS)].to_numpy(dtype=float)
    per_step, parts, kept = steps.frames_per_step(library.fps), [], np.zeros(len(kinematics), dtype=bool)
    for _, rows in library.table.groupby("record", sort=False):
        starts, ends = rows["start_frame"].to_numpy(), rows["end_frame"].to_numpy()
        grid = steps.on_grid(starts, ends, int(rows["n_frames"].iloc[0]), per_step)
        kept[rows.index[grid.kept]] = True
        parts.append(rows[grid.kept].assign(start_frame=grid.start * per_step, end_frame=grid.end * per_step))
    table = pd.concat(parts, ignore_index=True)
    if len(table) == 0:
        raise UserError(f"the motion library has no segment as long as a time step of {per_step} frames; add motion")
    table["segment"] = np.arange(len(table))
    moved = Library(table, library.recordings, library.fps, library.body)
    return Segments(moved, per_step, kinematics[kept])


def steps_of(found: Segments, syllables: Mapping[str, pd.DataFrame], pause_db: float) -> Steps:
    """Return the records of a library with their speech on its time steps."""
    step_s = found.per_step / found.library.fps
    table, known = found.library.table, Steps([], [])
    for record, rows in table.groupby("record", sort=False):
        own = found.kinematics[rows.index]
        lengths = (rows["end_frame"] - rows["start_frame"]).to_numpy() // found.per_step
        known.kinematics.append(np.repeat(own, lengths, axis=0))
        first = int(rows["start_frame"].iloc[0]) // found.per_step
        heard = steps.prosody(
            steps.syllables_of(syllables[str(record)]), first + int(lengths.sum()), step_s, pause_db
        )
        known.prosody.append(heard[first:])
    return known


def tones(layer: Inference, phases: pd.DataFrame) -> dict[str, Transform]:
    """Return the styles of an actor with these phases (schema ``phases``), by name."""
    lasting_s = phases["end_s"] - phases["start_s"]
    moved = pd.DataFrame({"record": phases["record"], "stretch": phases["start_s"] // STRETCH_S})
    moved["lasting_s"], moved["distance_m"] = lasting_s, np.exp(phases["velocity"]) * lasting_s
    stretch = moved.groupby(["record", "stretch"], sort=True).ngroup().to_numpy()
    sums = moved.groupby(stretch)[["lasting_s", "distance_m"]].sum()
    if len(sums) < FEWEST:
        return {}
    order = np.argsort((sums["distance_m"] / sums["lasting_s"]).to_numpy(), kind="stable")
    share = len(sums) // EXAMPLES
    y = layer.kinematics.apply(phases[list(KINEMATICS)].to_numpy(dtype=float))
    floor = np.full(len(KINEMATICS), inference.Settings().floor)
    chosen = {FASTEST: order[-share:], SLOWEST: order[:share]}
    return {name: style.fit(y, y[np.isin(stretch, stretches)], floor) for name, stretches in chosen.items()}


def matched(layer: Inference, found: Segments) -> Segments:
    """Return a library of another body with kinematic parameters in the range of the training records.

    The paper does not say how the kinematics of an octopus compare with those of a person (9.2). Taken as they are,
    one segment may be nearest to all hidden states. Here each parameter gets the mean and the standard deviation
    that it has in the training records, so that the body's own slow and fast movements stand for those of a person.
    """
    lengths = found.library.end - found.library.start
    mean = np.average(found.kinematics, axis=0, weights=lengths)
    sd = np.sqrt(np.average((found.kinematics - mean) ** 2, axis=0, weights=lengths))
    y = (found.kinematics - mean) / np.where(sd > 0.0, sd, 1.0)
    return found._replace(kinematics=layer.kinematics.mean + layer.kinematics.sd * y)


def with_library(model: Model, found: Segments | None, keywords: Mapping[str, Sequence[int]]) -> Model:
    """Return the controller with another motion library and keywords (Levine et al. 2010, 9.2).

    The inference layer and the styles stay; the control layer is new. The kinematic parameters of another body than
    ``STANDARD`` are ``matched``.

    Parameters
    ----------
    found : the motion library; None: the one that the model has.
    keywords : segments of the library that each keyword asks for.

    Raises
    ------
    UserError : if a keyword asks for a segment that the library does not have.
    """
    own = model.control
    segments = found or Segments(own.library, own.per_step, own.kinematics)
    if found is not None and found.library.body is not STANDARD:
        segments = matched(model.layer, found)
    transforms = {name: tone.transform for name, tone in own.tones.items() if tone.transform is not None}
    return model._replace(
        control=control.build(model.layer, *segments, transforms, keywords, own.balance, own.situations)
    )
