"""Capture errors relative to the ground truth of the virtual studio: the rows of the table ``capture_scores``.

The estimated world frame is only as accurate as the facts stated for the calibration. The rigid transform to the
true frame is therefore estimated once per rig, from the laser spots. It is reported on its own and removed before
anything else is compared in 3D.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.capture.calibration import laser, world_frame
from cospeech.capture.fitting.body_model import BodyModel
from cospeech.capture.fitting.observability import BENT_DEG
from cospeech.data import trajectories
from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import angles_deg
from cospeech.geometry.triangulate import triangulate
from cospeech.motion import markers, skeleton

Rows = list[dict[str, Any]]

VISIBLE = 1 / 3
"""Minimum visible fraction of a marker's disc for a view to count as showing it."""
SWAP_M = 0.03
"""A detected marker farther than this from its true position is counted as a swap."""
COLUMNS = ["quantity", "record", "method", "value", "n"]


class RigidTransform(NamedTuple):
    """The rigid transform from the estimated to the true world frame: rotation (3, 3), then translation (3,), m."""

    rotation: Floats
    translation_m: Floats

    def points(self, points_m: Floats) -> Floats:
        """Return points (..., 3) of the estimated frame in the true one."""
        return points_m @ self.rotation.T + self.translation_m

    def rotations(self, rotations: Floats) -> Floats:
        """Return rotations (..., 3, 3) relative to the zero pose, expressed in the axes of the true frame."""
        return self.rotation @ rotations @ self.rotation.T


def table(rows: Rows) -> pd.DataFrame:
    """Return the rows as a table; columns that a row does not set are missing values."""
    return pd.DataFrame(rows).reindex(columns=COLUMNS)


def rms(values: Floats) -> float:
    """Return the root mean square of the values that are not NaN; NaN if there are none."""
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def angle_between_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles (T,) between directions (T, 3), degrees."""
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))))


def rotation_error_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles (T,) of the rotations between orientations ``a`` and ``b`` (T, 3, 3), degrees."""
    return angles_deg(np.swapaxes(a, 1, 2) @ b)


def axial_error_deg(a: Floats, b: Floats) -> Floats:
    """Return the rotations (T,) about the bone (its y axis) that bring ``a`` (T, 3, 3) closest to ``b``, degrees."""
    between = np.swapaxes(a, 1, 2) @ b
    return np.asarray(
        np.degrees(np.arctan2(between[:, 0, 2] - between[:, 2, 0], between[:, 0, 0] + between[:, 2, 2]))
    )


def calibration(
    found: pd.DataFrame, rig: Sequence[Camera], true: Sequence[Camera], spots: pd.DataFrame
) -> tuple[RigidTransform, Rows]:
    """Return the transform to the true world frame, and the rows of the rig.

    Parameters
    ----------
    found : the table ``cameras``; ``rig`` holds its cameras and ``true`` the true cameras in the same order.
    spots : the ground-truth table ``laser``.
    """
    pixels = np.swapaxes(laser.observations(spots, [camera.name for camera in rig])[0], 0, 1)
    pixels = pixels[(~np.isnan(pixels[..., 0])).sum(axis=1) >= 2]
    there, here = (triangulate(cameras, pixels, np.inf)[0] for cameras in (true, rig))
    middle, middle_true = here.mean(axis=0), there.mean(axis=0)
    rotation = world_frame.fit(here, there).rotation
    to_planted = RigidTransform(rotation, middle_true - rotation @ middle)
    focal = np.array([camera.focal_px for camera in rig]) / np.array([camera.focal_px for camera in true])
    weights = found["n_points"].to_numpy(dtype=float)
    values = {
        "focal_error_pct": (100.0 * np.abs(focal - 1.0).mean(), len(rig)),
        "reprojection_px": (
            np.sqrt(np.average(found["rms_px"].to_numpy() ** 2, weights=weights)),
            int(weights.sum()),
        ),
        "spots_mm": (1000.0 * rms(np.linalg.norm(to_planted.points(here) - there, axis=1)), len(here)),
        "world_shift_mm": (1000.0 * np.linalg.norm(middle_true - middle), len(here)),
        "world_turn_deg": (angles_deg(rotation), len(here)),
    }
    return to_planted, _rows(values)


def tracking(
    views: pd.DataFrame,
    world: pd.DataFrame,
    true_views: pd.DataFrame,
    true_world: pd.DataFrame,
    cameras: Sequence[Camera],
    to_planted: RigidTransform,
) -> Rows:
    """Return the rows for the markers of one record.

    Parameters
    ----------
    views, world : the tables ``markers_2d`` and ``markers_3d``.
    true_views, true_world : their ground truth, including how many pixels of each disc are visible.
    cameras : the true cameras.
    """
    both = views.merge(true_views, on=["frame", "camera", "marker"], suffixes=("", "_true"))
    seen_views = both["status"].isin(trajectories.SEEN).to_numpy()
    off_px = np.linalg.norm(both[["x_px", "y_px"]].to_numpy() - both[["x_px_true", "y_px_true"]].to_numpy(), axis=1)

    there = trajectories.to_array(true_world, markers.NAMES)
    here = to_planted.points(trajectories.to_array(world, markers.NAMES))
    status = _status(world)
    seen, lost = np.isin(status, trajectories.SEEN), status == "lost"
    off = np.linalg.norm(here - there, axis=2)
    nearest = np.linalg.norm(here[:, :, None] - there[:, None], axis=3).argmin(axis=2)
    swaps = seen & ((off > SWAP_M) | (nearest != np.arange(len(markers.NAMES))))
    visible = _visible(true_views, there, cameras)
    values = {
        "pixels_px": (rms(off_px[seen_views]), int(seen_views.sum())),
        "seen_mm": (1000.0 * rms(off[seen]), int(seen.sum())),
        "predicted_mm": (1000.0 * rms(off[status == "predicted"]), int((status == "predicted").sum())),
        "visible_unseen_pct": (100.0 * float((~seen)[visible].mean()), int(visible.sum())),
        "visible_lost_pct": (100.0 * float(lost[visible].mean()), int(visible.sum())),
        "swaps": (float(swaps.sum()), int(seen.sum())),
    }
    return _rows(values)


def _visible(true_views: pd.DataFrame, places_m: Floats, cameras: Sequence[Camera]) -> npt.NDArray[np.bool_]:
    """Return which markers (T, M) show at least a third of their disc in at least two views."""
    shown = np.zeros(places_m.shape[:2], dtype=int)
    index = {name: number for number, name in enumerate(markers.NAMES)}
    for camera in cameras:
        own = true_views[true_views["camera"] == camera.name]
        pixels = np.zeros(places_m.shape[:2])
        pixels[own["frame"].to_numpy(), own["marker"].map(index).to_numpy()] = own["n_pixels"].to_numpy()
        depth = places_m @ camera.rotation[2] + camera.shift_m[2]
        disc = np.pi * camera.focal_px[0] * camera.focal_px[1] * (markers.RADIUS_M / depth) ** 2
        shown += pixels >= VISIBLE * disc
    return shown >= 2


def angles(
    motion: pd.DataFrame,
    world: pd.DataFrame,
    true_motion: pd.DataFrame,
    true_world: pd.DataFrame,
    model: BodyModel,
    to_planted: RigidTransform,
) -> Rows:
    """Return the rows for the joint angles of one record, over frames in which the necessary markers are detected.

    Both arms are pooled.

    Parameters
    ----------
    motion, world : the motion table and the table ``markers_3d`` that it was fitted to.
    true_motion, true_world : their ground truth, with the same number of frames.
    model : the body model that the motion was fitted with; it gives the hand marker's position on the forearm.
    """
    turned = to_planted.rotations(_chain(motion)[0])
    true, true_places = _chain(true_motion)
    there = trajectories.to_array(true_world, markers.NAMES)
    known = np.isin(_status(world), trajectories.SEEN)
    off: dict[str, list[Floats]] = {"upper_arm_deg": [], "elbow_hand_deg": [], "axial_deg": []}
    for side in ("left", "right"):
        upper, fore = (skeleton.JOINTS.index(f"{side}_{part}") for part in ("arm", "forearm"))
        elbow, hand = (markers.NAMES.index(f"{side}_{part}") for part in ("elbow", "hand"))
        direction = angle_between_deg(turned[:, upper, :, 1], true[:, upper, :, 1])
        to_hand = turned[:, fore] @ to_planted.rotation @ model.marker_places_m[hand]
        line = angle_between_deg(to_hand, there[:, hand] - true_places[:, fore])
        bent = true_motion[f"{side}_forearm_x_deg"].to_numpy() < -BENT_DEG
        measured = known[:, elbow] & known[:, hand]
        off["upper_arm_deg"].append(direction[measured])
        off["elbow_hand_deg"].append(line[measured])
        off["axial_deg"].append(axial_error_deg(true[measured & bent, upper], turned[measured & bent, upper]))
    found = {
        f"{name}_deg": rotation_error_deg(true[:, joint], turned[:, joint])
        for name, joint in (("thorax", skeleton.JOINTS.index("chest")), ("head", skeleton.JOINTS.index("head")))
    } | {quantity: np.concatenate(sides) for quantity, sides in off.items()}
    return _rows({quantity: (rms(values), len(values)) for quantity, values in found.items()})


def _status(world: pd.DataFrame) -> npt.NDArray[np.object_]:
    """Return the status (T, M) of each marker position."""
    table = world.set_index(["frame", "marker"])["status"].unstack()  # noqa: PD010
    return table[list(markers.NAMES)].to_numpy(dtype=object)


def _chain(motion: pd.DataFrame) -> tuple[Floats, Floats]:
    return skeleton.chain(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(motion))


def _rows(values: dict[str, tuple[float, int]]) -> Rows:
    return [{"quantity": quantity, "value": value, "n": n} for quantity, (value, n) in values.items()]
