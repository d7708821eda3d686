"""The control layer of a motion library: distances, costs and policies from its motion (Levine et al. 2010, 7 and 8).

The paper names what the cost of a transition takes into account but not the weights. Here,

- poses are the positions of all joints relative to the root, in world axes, in units of the mean distance between
  poses at the starts of segments of the library;
- D_seg is the norm of the differences of length, of start pose, and of velocity and displacement, which are on a log
  scale and standardised like the kinematic parameters; ``LENGTH``, ``POSE`` and ``DYNAMICS`` weigh them;
- successor costs are then brought to the unit of the expected distances. The setting ``transition_s`` says how: an
  average transition at the end of a segment costs as much as to show, for that time, an average segment instead of
  the one with the smallest expected distance. An interruption costs ``interruption_s`` more. Stated in seconds, the
  balance does not depend on the time step.

The discount per time step is exp(-step_s / ``horizon_s``).

One thing is not in the paper: where speech tells little about the state, the policy of a small library goes back and
forth between two or three segments. A segment that was entered recently therefore costs ``repetition_s`` more, in the
same unit, and this cost fades within ``memory_s``. It is not part of the policy, whose states do not include what was
shown before; with ``repetition_s`` = 0, the controller is that of the paper.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.motion.library import Library
from cospeech.synthesis.controller import library as segments
from cospeech.synthesis.controller import lookahead, policy, semantics, style
from cospeech.synthesis.controller.distances import expected_distances
from cospeech.synthesis.controller.inference import KINEMATICS, Inference
from cospeech.synthesis.controller.library import Pieces, Rows, Successors
from cospeech.synthesis.controller.policy import Discounts, Policy
from cospeech.synthesis.controller.semantics import Label, Repetition
from cospeech.synthesis.controller.situations import Situations
from cospeech.synthesis.controller.style import Transform

LENGTH, POSE, DYNAMICS = 0.5, 1.0, 0.5
"""Weights of the parts of D_seg: as in the distance of gesture subunits, a pose weighs most."""

NEUTRAL = "neutral"
"""The style of the motion that the inference layer was trained on."""

MOST_PIECES = 200
"""Pieces that the mean cost of a transition is estimated from."""


class Balance(NamedTuple):
    """The settings of the control layer; see the module for the times in seconds."""

    transition_s: float
    interruption_s: float
    horizon_s: float
    repetition_s: float
    memory_s: float
    discounts: Discounts


class Tone(NamedTuple):
    """A style: its transform of kinematic parameters (None: neutral), delta (A, I), and policy (see ``solve``)."""

    transform: Transform | None
    distances: Floats
    policy: Policy


class Control(NamedTuple):
    """A control layer.

    Attributes
    ----------
    library : the motion segments, whose boundaries lie on time steps; A of them.
    per_step : motion frames per time step.
    kinematics : (A, 6) parameters of the segments on a log scale, in the order of ``inference.KINEMATICS``.
    cut, known, rows : pieces, what successor costs are computed from, and the costs themselves.
    unit : cost of a second in which an average segment is shown instead of the nearest one.
    pose_scale : factor between joint positions in metres and the poses of the successor costs.
    situations : what the policies plan with; K of them.
    tones : styles by name; the first is ``NEUTRAL``.
    keywords : segments that each keyword asks for.
    """

    library: Library
    per_step: int
    kinematics: Floats
    cut: Pieces
    known: Successors
    rows: Rows
    unit: float
    pose_scale: float
    situations: Situations
    balance: Balance
    tones: Mapping[str, Tone]
    keywords: Mapping[str, Sequence[int]]

    @property
    def step_s(self) -> float:
        """The time step in seconds."""
        return self.per_step / self.library.fps

    @property
    def discount(self) -> float:
        """Eta per time step."""
        return math.exp(-self.step_s / self.balance.horizon_s)

    @property
    def repetition(self) -> Repetition:
        """What recently shown segments cost in addition."""
        return Repetition(self.balance.repetition_s * self.unit, math.exp(-self.step_s / self.balance.memory_s))


def poses(library: Library, frames: Integers) -> Floats:
    """Return the positions of the joints relative to the root in metres at some frames of a library, (n, 3 J)."""
    _, placed = library.body.world(np.zeros((len(frames), 3)), library.poses.rotations[frames])
    return np.asarray((placed - placed[:, :1]).reshape(len(frames), -1), dtype=np.float64)


def end_frames(library: Library, cut: Pieces, per_step: int) -> Integers:
    """Return the last frame of each piece, (B,), in the poses of the library."""
    return np.asarray(library.start[cut.segment] + (cut.end + 1) * per_step - 1, dtype=np.int64)


def build(
    layer: Inference,
    library: Library,
    per_step: int,
    kinematics: Floats,
    transforms: Mapping[str, Transform],
    keywords: Mapping[str, Sequence[int]],
    balance: Balance,
    situations: Situations,
) -> Control:
    """Return the control layer of a library: costs, and the policy of each style.

    Parameters
    ----------
    per_step : motion frames per time step; all segments are whole steps long.
    transforms : styles besides the neutral one.

    Raises
    ------
    UserError : if a keyword asks for a segment that the library does not have.
    """
    y = layer.kinematics.apply(kinematics)
    gaussians = (layer.hmm.mean, layer.hmm.covariance)
    delta = expected_distances(y, *gaussians)
    distances = {NEUTRAL: delta} | {name: style.tone_distances(y, *gaussians, t) for name, t in transforms.items()}
    bare = without_policies(layer, library, per_step, kinematics, delta, keywords, balance, situations)
    tones = {name: Tone(transforms.get(name), one, solve(bare, one)) for name, one in distances.items()}
    return bare._replace(tones=tones)


def without_policies(
    layer: Inference,
    library: Library,
    per_step: int,
    kinematics: Floats,
    delta: Floats,
    keywords: Mapping[str, Sequence[int]],
    balance: Balance,
    situations: Situations,
) -> Control:
    """Return the control layer of a library with expected distances ``delta`` (A, I), but without a style."""
    n_segments = len(delta)
    for word, chosen in keywords.items():
        unknown = [a for a in chosen if not 0 <= a < n_segments]
        if unknown or not chosen:
            what = f"segment {unknown[0]}, which the library does not have" if unknown else "no segment"
            raise UserError(f"keyword '{word}' has {what}; the segments are numbered 0 to {n_segments - 1}")
    cut = segments.pieces((library.end - library.start) // per_step)
    y = layer.kinematics.apply(kinematics)
    known, unit, scale = _successors(library, cut, per_step, y, delta, balance)
    rows = segments.cost_rows(cut, known)
    return Control(library, per_step, kinematics, cut, known, rows, unit, scale, situations, balance, {}, keywords)


def solve(layer: Control, distances: Floats) -> Policy:
    """Return the optimal policy over the situations for expected distances from the hidden states, (A, I)."""
    known = layer.situations
    return policy.solve(
        layer.cut, layer.rows, known.distances(distances), known.transitions, layer.discount, layer.balance.discounts
    )


def _successors(
    library: Library, cut: Pieces, per_step: int, y: Floats, delta: Floats, balance: Balance
) -> tuple[Successors, float, float]:
    """Return what successor costs are computed from, in the unit of ``delta``, that unit, and the scale of poses."""
    starts, ends = poses(library, library.start), poses(library, end_frames(library, cut, per_step))
    half = max(1, len(starts) // 2)
    typical = float(np.linalg.norm(starts - np.roll(starts, half, axis=0), axis=1).mean()) or 1.0
    starts, ends = starts / typical, ends / typical
    extent, displacement, velocity = (
        y[:, KINEMATICS.index(name)] for name in ("temporal_extent", "spatial_extent", "velocity")
    )
    signature = np.column_stack([LENGTH * extent, POSE * starts, DYNAMICS * velocity, DYNAMICS * displacement])
    records = library.table["record"].to_numpy()
    bare = Successors(ends, starts, signature, *segments.with_neighbours(signature, records), penalty=0.0)
    closing = np.flatnonzero(cut.closing)
    some = closing[np.linspace(0, len(closing) - 1, min(len(closing), MOST_PIECES)).astype(np.int64)]
    mean_cost = float(segments.successor_costs(cut, bare, some).mean())
    spread = float((delta.mean(axis=0) - delta.min(axis=0)).mean()) / (per_step / library.fps)
    spread = spread or 1.0
    unit = balance.transition_s * spread / mean_cost if mean_cost > 0.0 else 1.0
    pose, start, own, after, before = (unit * vectors for vectors in bare[:5])
    return Successors(pose, start, own, after, before, balance.interruption_s * spread), spread, unit / typical


class Labels(NamedTuple):
    """What keywords need of a policy: its values at all frames, and the label of each word."""

    rest: Floats | None
    words: dict[str, Label]


def labels(layer: Control, distances: Floats, found: Policy) -> Labels:
    """Return the labels of the keywords under a policy that was found for expected distances (A, I)."""
    if not layer.keywords:
        return Labels(None, {})
    known = layer.situations
    cut, given = layer.cut, (known.distances(distances), known.transitions, layer.discount)
    rest = lookahead.rest_values(found, cut, layer.rows, *given)
    first, after = layer.library.start, layer.library.end
    words = {}
    for word, chosen in layer.keywords.items():
        frames = {a: np.arange(first[a], after[a], layer.per_step) for a in chosen}
        shown = {a: layer.pose_scale * poses(layer.library, own) for a, own in frames.items()}
        entered = semantics.entrances(cut, layer.known.pose, layer.known.penalty, shown)
        words[word] = semantics.solve(cut, layer.rows, rest, entered, *given)
    return Labels(rest, words)
