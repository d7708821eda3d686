"""From solved poses to the motion table: what the markers tell goes into joint angles, the rest stays at zero.

The trunk is seen as one: thorax markers cannot say how hips, spine and chest share its rotation, so all of it stands
at the chest, with hips and spine at zero. Likewise the head's rotation relative to the chest stands at the head, with
the neck at zero. The displacement of the root is that of the chest from its place in the static pose, in metres of
the subject, so that the body of ``skeleton.BODY`` moves as far as the subject did, whatever the subject's size.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.capture.fitting.body_model import NAMES, THORAX, BodyModel, body_model
from cospeech.capture.fitting.elbows import refined
from cospeech.capture.fitting.gaps import bridged
from cospeech.capture.fitting.inverse_kinematics import Poses, solve
from cospeech.capture.fitting.observability import observability
from cospeech.data import trajectories
from cospeech.geometry.rigid import align
from cospeech.motion import markers, skeleton


class Fit(NamedTuple):
    """A motion table, the table ``observability``, and one line on how well the body model explains the markers."""

    motion: pd.DataFrame
    observability: pd.DataFrame
    line: str


def fit(take: pd.DataFrame, record: pd.DataFrame, static_s: float) -> Fit:
    """Return the joint angles of a record.

    Parameters
    ----------
    take : ``markers_3d`` table of the actor's range-of-motion take, which begins with ``static_s`` of static pose.
    record : ``markers_3d`` table of the record.

    Raises
    ------
    UserError : where the take determines no body model.
    """
    model = subject(take, static_s)
    seen = trajectories.to_array(record, markers.NAMES)
    worn = [index for index in THORAX if not np.isnan(model.marker_places_m[index, 0])]
    poses = solve(model, bridged(seen, align(model.marker_places_m[worn], seen[:, worn])))
    moved = motion(model, poses, trajectories.frame_rate(record))
    error, misfit = 1000.0 * max(model.shoulder_errors_m), 1000.0 * np.nanmedian(poses.misfit_m)
    line = f"shoulders known to {error:.2f} mm, median misfit {misfit:.2f} mm, {poses.steps.mean():.1f} steps a frame"
    return Fit(moved, observability(model.marker_places_m, seen, moved), line)


def subject(take: pd.DataFrame, static_s: float) -> BodyModel:
    """Return the body model of a range-of-motion take (a ``markers_3d`` table) that begins with the static pose.

    What was predicted, not seen, does not count: it says what the tracker believes, not where joints are.

    Raises
    ------
    UserError : where the take determines no body model.
    """
    seen = take[trajectories.AXES].where(take["status"].isin(trajectories.SEEN))
    places = trajectories.to_array(take.assign(**seen), markers.NAMES)
    return refined(body_model(places, trajectories.frame_rate(take), static_s), places)


def motion(model: BodyModel, poses: Poses, fps: float) -> pd.DataFrame:
    """Return the motion table of solved ``poses`` of ``model``."""
    world = {name: poses.turns[:, index] for index, name in enumerate(NAMES)}
    turned = np.tile(np.eye(3), (len(poses.turns), len(skeleton.JOINTS), 1, 1))

    def relate(joint: str, part: str, to: str | None) -> None:
        turned[:, skeleton.JOINTS.index(joint)] = (
            world[part] if to is None else np.swapaxes(world[to], 1, 2) @ world[part]
        )

    relate("chest", "thorax", None)
    relate("head", "head", "thorax")
    for side in ("left", "right"):
        relate(f"{side}_arm", f"{side}_arm", "thorax")
        relate(f"{side}_forearm", f"{side}_forearm", f"{side}_arm")
        relate(f"{side}_thigh", f"{side}_thigh", "hips")
        relate(f"{side}_shin", f"{side}_shin", f"{side}_thigh")
    thorax = NAMES.index("thorax")
    root = poses.places_m[:, thorax] - model.offsets_m[thorax]
    return skeleton.motion_table(root, skeleton.unwrap(skeleton.euler(turned)), fps)
