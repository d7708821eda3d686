"""What the controller's experiments measure: figure 4, the regret, and the control layer (Levine et al. 2010).

Figure 4 is cross-validated: each training record in turn, up to ``MOST_HELD_OUT`` of them, is explained by inference
layers with windows of 1 to 5 time steps that were trained on the others, and by their remapped HMMs.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.markov import crf
from cospeech.motion.library import Poses
from cospeech.synthesis import live
from cospeech.synthesis.controller import (
    control,
    inference,
    library,
    lookahead,
    offline,
    online,
    policy,
    situations,
    style,
)
from cospeech.synthesis.controller.clusters import Range
from cospeech.synthesis.controller.control import NEUTRAL
from cospeech.synthesis.controller.model import FASTEST, Model, Segments, Steps, segments_of, steps_of, with_library
from cospeech.synthesis.controller.semantics import Player
from cospeech.synthesis.controller.style import combination_error
from cospeech.synthesis.interface import Speech, Training

WINDOWS = (1, 2, 3, 4, 5)
"""Input windows of figure 4, in time steps."""

MOST_HELD_OUT = 4

LONGEST_DELAY_S = 0.6
"""Longest delay of the output in the curve of the regret."""

HALF = 0.5
"""Degree of the style for which the paper's combination is compared with a policy of its own."""


def windows(training: Training, model: Model, seed: int) -> pd.DataFrame:
    """Return the scores of the CRF and the remapped HMM for each window and held-out record (figure 4).

    There is no row if there are fewer than two training records.
    """
    found = segments_of(training)
    known = steps_of(found, training.syllables, model.pause_db)
    records = list(dict.fromkeys(found.library.table["record"]))
    n_states, n_clusters = len(model.layer.hmm.mean), len(model.layer.clusters.weight)
    scale = model.layer.prosody
    f0 = Range(*(np.array(model.layer.f0) * scale.sd[-1] + scale.mean[-1]))
    rows = []
    for held_out in range(min(len(records), MOST_HELD_OUT) if len(records) > 1 else 0):
        others = [n for n in range(len(records)) if n != held_out]
        learnt = Steps([known.kinematics[n] for n in others], [known.prosody[n] for n in others])
        pair = known.kinematics[held_out], known.prosody[held_out]
        for window in WINDOWS:
            settings = inference.Settings((n_states,), n_clusters, window)
            layer = inference.train(learnt.kinematics, learnt.prosody, f0, settings, seed).layer
            targets = inference.posteriors(layer.hmm, [layer.kinematics.apply(y) for y in learnt.kinematics])
            remapped = inference.remap(layer, targets, learnt.prosody, settings)
            scores = {
                "crf": inference.score(layer, *pair),
                "hmm": inference.score_remapped(remapped, layer, *pair),
            }
            rows += [
                {"record": records[held_out], "window": window, "step_ms": 1000 * model.control.step_s, "model": name}
                | own._asdict()
                for name, own in scores.items()
            ]
    columns = ["record", "window", "step_ms", "model", "chain", "filtered", "kinematics"]
    return pd.DataFrame(rows, columns=columns)


def regret(model: Model, prosody: Floats) -> pd.DataFrame:
    """Return by how much the online controller's path on prosody (T, 3) costs more than the optimum.

    For the policy of the paper, over hidden states, there is a row for each delay of the output; for that over
    situations, one without delay. Neither has a cost of repetition.
    """
    layer = model.control
    delta, hmm = layer.tones[NEUTRAL].distances, model.layer.hmm
    given = (layer.cut, layer.rows)
    found = policy.solve(*given, delta, hmm.transitions, layer.discount)
    rest = lookahead.rest_values(found, *given, delta, hmm.transitions, layer.discount)
    features = inference.features(model.layer, prosody)
    smoothed = inference.smoothed(model.layer, prosody)
    curve = lookahead.regret_curve(
        *given, rest, delta, lambda delay: crf.lagged(model.layer.crf, features, delay), smoothed, layer.discount,
        layer.step_s, range(int(LONGEST_DELAY_S / layer.step_s + 1e-9) + 1),
    )  # fmt: skip
    table = pd.DataFrame(curve, columns=lookahead.Regret._fields)
    table.insert(0, "plan", "states")
    known = control.solve(layer, delta)
    weights = situations.Weights(layer.situations).of_each(inference.filtered(model.layer, prosody))
    path = policy.play(known, layer.cut, layer.rows, weights)
    cost = library.path_cost(path, *given, delta, smoothed) / len(prosody)
    own = {"plan": "situations", "delay_ms": 0.0, "cost": cost, "optimum": table["optimum"].iloc[0]}
    row = pd.DataFrame([own | {"regret": cost / own["optimum"] - 1.0}])
    return pd.concat([table, row], ignore_index=True)


def control_layer(model: Model) -> pd.DataFrame:
    """Return what is known about the control layer of a model, one quantity per row."""
    layer = model.control
    neutral = layer.tones[NEUTRAL]
    values = {
        "segments": len(layer.kinematics),
        "pieces": len(layer.cut.segment),
        "hidden_states": len(model.layer.hmm.mean),
        "library_s": len(layer.library.poses.root_m) / layer.library.fps,
        "iterations": neutral.policy.iterations,
        "undominated_share": policy.undominated_share(neutral.policy, layer.cut, layer.rows),
        "printed_discount_error": _printed_discount_error(layer),
        "style_combination_error": np.nan,
    }
    if FASTEST in layer.tones:
        degrees = {name: HALF * (name == FASTEST) for name in layer.tones if name != NEUTRAL}
        both = [layer.tones[NEUTRAL].policy, layer.tones[FASTEST].policy]
        combined = style.combined(both, np.array([1.0 - HALF, HALF]))
        values["style_combination_error"] = combination_error(combined, online.in_style(layer, degrees).policy)
    return pd.DataFrame({"quantity": [*values], "value": [float(value) for value in values.values()]})


def _printed_discount_error(layer: control.Control) -> float:
    """Return the mean relative error of the values by the printed discounts, over the segments that allow them.

    Segments that may be interrupted after their first step do not; NaN if fewer than two segments do.
    """
    cut, known = layer.cut, layer.situations
    delta = known.distances(layer.tones[NEUTRAL].distances)
    chosen = np.flatnonzero(cut.length[cut.first[:-1]] > 1)
    if len(chosen) < 2:
        return float("nan")
    place = np.flatnonzero(np.isin(cut.segment, chosen))
    part = library.pieces(np.array([cut.end[cut.first[a + 1] - 1] + 1 for a in chosen]))
    costs = layer.rows(slice(None))[np.ix_(place, chosen)]
    given = (part, costs.__getitem__, delta[chosen], known.transitions, layer.discount)
    corrected, printed = (policy.solve(*given, discounts).values for discounts in ("corrected", "printed"))
    return float(np.abs(printed / corrected - 1.0).mean())


def beliefs(model: Model, prosody: Floats) -> pd.DataFrame:
    """Return the beliefs over the hidden states at each time step of prosody (T, 3), online and offline."""
    forward, smoothed = inference.filtered(model.layer, prosody), inference.smoothed(model.layer, prosody)
    step, state = (axis.ravel() for axis in np.indices(forward.shape))
    table = pd.DataFrame({"step": step, "time_s": step * model.control.step_s, "state": state})
    return table.assign(forward=forward.ravel(), smoothed=smoothed.ravel())


def decisions(model: Model, prosody: Floats) -> pd.DataFrame:
    """Return the decisions that the online and the offline controller make on prosody (T, 3)."""
    layer = model.control
    tone = layer.tones[NEUTRAL]
    player = Player(tone.policy, {}, layer.cut, layer.rows, None, layer.repetition)
    weights = situations.Weights(layer.situations).of_each(inference.filtered(model.layer, prosody))
    shown = [player.step(weight) for weight in weights]
    rows = [(step, one.segment, one.frame, one.cost, "online") for step, one in enumerate(shown) if one.decided]
    path = offline.animate(layer.cut, layer.rows, tone.distances, inference.smoothed(model.layer, prosody)).path
    starts = np.flatnonzero(path.frame == 0)
    rows += [(int(step), int(path.segment[step]), 0, np.nan, "offline") for step in starts]
    table = pd.DataFrame(rows, columns=["step", "segment", "frame", "cost", "policy"])
    return table.assign(time_s=table["step"] * layer.step_s, section="body")


class Timed(NamedTuple):
    """A control layer, and the processor time in seconds in which it was trained."""

    layer: control.Control
    training_s: float


def trained_on(model: Model, found: Segments) -> Timed:
    """Train the control layer of another motion library, without styles, as table 1 does."""
    neutral = {NEUTRAL: model.control.tones[NEUTRAL]}
    bare = model._replace(control=model.control._replace(tones=neutral))
    begun = time.process_time()
    layer = with_library(bare, found, {}).control
    return Timed(layer, time.process_time() - begun)


def strip(model: Model, speech: Speech, times_s: Sequence[float]) -> pd.DataFrame:
    """Return the positions of the joints at some times of what the controller makes of speech (figure 6)."""
    body = model.control.library.body
    rows = np.concatenate([np.asarray(part) for part in live.all_steps(online, model, speech, 0)])
    frames = np.minimum((np.array(times_s) * speech.motion_fps).astype(np.int64), len(rows) - 1)
    poses = Poses.from_frames(rows[frames])
    _, placed = body.world(poses.root_m, poses.rotations)
    picture, joint = (axis.ravel() for axis in np.indices(placed.shape[:2]))
    names = np.array([*body.joints, None], dtype=object)
    table = pd.DataFrame({"picture": picture, "time_s": np.array(times_s)[picture], "joint": names[joint]})
    table["parent"] = names[body.parents[joint]]
    table[["x_m", "y_m", "z_m"]] = (placed - placed[:, :1]).reshape(-1, 3)
    return table
