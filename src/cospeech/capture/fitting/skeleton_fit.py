"""From solved poses to the motion table; joint angles that the markers do not determine are zero.

The trunk is one rigid part: thorax markers cannot say how hips, spine and chest share its rotation, so all of it is
assigned to the chest, with hips and spine at zero. Likewise, the rotation of the head relative to the chest is
assigned to the head, with the neck at zero. The root displacement is that of the chest from its position in the
static pose. It is not scaled, so the body of ``skeleton.BODY`` moves as far as the subject did, whatever the
subject's size.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.capture.fitting import stance
from cospeech.capture.fitting.body_model import NAMES, THORAX, BodyModel, body_model
from cospeech.capture.fitting.elbows import refine_elbows
from cospeech.capture.fitting.gaps import bridge_gaps
from cospeech.capture.fitting.inverse_kinematics import Poses, solve
from cospeech.capture.fitting.observability import observability
from cospeech.data import trajectories
from cospeech.geometry.rigid import align
from cospeech.motion import markers, skeleton


class Fit(NamedTuple):
    """The motion table, the table ``observability``, and a log line on how well the body model fits the markers."""

    motion: pd.DataFrame
    observability: pd.DataFrame
    line: str


def fit(take: pd.DataFrame, record: pd.DataFrame, static_s: float, pose: str = stance.HANGING) -> Fit:
    """Return the joint angles of a record.

    Parameters
    ----------
    take : ``markers_3d`` table of the actor's range-of-motion take.
    record : ``markers_3d`` table of the record.
    static_s : duration of the static pose at the start of the take, seconds.
    pose : the static pose, see ``stance``.

    Raises
    ------
    UserError : if the take does not determine the body model.
    """
    model = fit_body_model(take, static_s, pose)
    seen = trajectories.to_array(record, markers.NAMES)
    worn = [index for index in THORAX if not np.isnan(model.marker_places_m[index, 0])]
    poses = solve(model, bridge_gaps(seen, align(model.marker_places_m[worn], seen[:, worn])))
    moved = motion(model, poses, trajectories.frame_rate(record))
    error, misfit = 1000.0 * max(model.shoulder_errors_m), 1000.0 * np.nanmedian(poses.misfit_m)
    line = (
        f"standard error of the shoulders {error:.2f} mm, median misfit {misfit:.2f} mm, "
        f"{poses.steps.mean():.1f} steps per frame"
    )
    return Fit(moved, observability(model.marker_places_m, seen, moved), line)


def fit_body_model(take: pd.DataFrame, static_s: float, pose: str = stance.HANGING) -> BodyModel:
    """Return the body model from a range-of-motion take (a ``markers_3d`` table) that begins with the static pose.

    Predicted positions are ignored: they reflect the motion model of the tracker, not the body.

    Raises
    ------
    UserError : if the take does not determine the body model.
    """
    seen = take[trajectories.AXES].where(take["status"].isin(trajectories.SEEN))
    places = trajectories.to_array(take.assign(**seen), markers.NAMES)
    return refine_elbows(body_model(places, trajectories.frame_rate(take), static_s, pose), places)


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
