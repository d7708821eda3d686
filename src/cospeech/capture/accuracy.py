"""How far what capture found lies from what the virtual studio planted: the rows of the table ``capture_scores``.

A found world stands where the facts of its calibration put it. So the rigid movement to the planted world is taken
once for a rig, from the laser's spots; it is told by itself, and set aside wherever something in space is compared.
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
"""Share of a marker's disc from which a view counts as showing it."""
SWAP_M = 0.03
"""A seen marker farther than this from its place is taken for something else."""
COLUMNS = ["quantity", "record", "method", "value", "n"]


class Movement(NamedTuple):
    """The rigid movement from the found world to the planted one: turn (3, 3), then shift (3,) in metres."""

    turn: Floats
    shift_m: Floats

    def points(self, points_m: Floats) -> Floats:
        """Return points (..., 3) of the found world in the planted one."""
        return points_m @ self.turn.T + self.shift_m

    def turns(self, turns: Floats) -> Floats:
        """Return rotations (..., 3, 3) from the pose at zero in the planted world, in whose axes that pose stands."""
        return self.turn @ turns @ self.turn.T


def table(rows: Rows) -> pd.DataFrame:
    """Return the rows as one table; what a row does not say is missing."""
    return pd.DataFrame(rows).reindex(columns=COLUMNS)


def rms(values: Floats) -> float:
    """Return the root mean square of what is not NaN; NaN of nothing."""
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def between_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles (T,) between directions (T, 3), degrees."""
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))))


def apart_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles (T,) of the rotations that lead from orientations (T, 3, 3) to others, degrees."""
    return angles_deg(np.swapaxes(a, 1, 2) @ b)


def about_bone_deg(a: Floats, b: Floats) -> Floats:
    """Return the turns (T,) about a bone, its y axis, that lead from orientations (T, 3, 3) nearest to others."""
    rest = np.swapaxes(a, 1, 2) @ b
    return np.asarray(np.degrees(np.arctan2(rest[:, 0, 2] - rest[:, 2, 0], rest[:, 0, 0] + rest[:, 2, 2])))


def calibration(
    found: pd.DataFrame, rig: Sequence[Camera], true: Sequence[Camera], spots: pd.DataFrame
) -> tuple[Movement, Rows]:
    """Return the movement to the planted world, and the rows of a rig.

    Parameters
    ----------
    found : the table ``cameras``; ``rig`` are its cameras, ``true`` the planted ones in the same order.
    spots : the planted table ``laser``.
    """
    pixels = np.swapaxes(laser.observations(spots, [camera.name for camera in rig])[0], 0, 1)
    pixels = pixels[(~np.isnan(pixels[..., 0])).sum(axis=1) >= 2]
    there, here = (triangulate(cameras, pixels, np.inf)[0] for cameras in (true, rig))
    middle, middle_true = here.mean(axis=0), there.mean(axis=0)
    turn = world_frame.fit(here, there).rotation
    movement = Movement(turn, middle_true - turn @ middle)
    focal = np.array([camera.focal_px for camera in rig]) / np.array([camera.focal_px for camera in true])
    weights = found["n_points"].to_numpy(dtype=float)
    values = {
        "focal_error_pct": (100.0 * np.abs(focal - 1.0).mean(), len(rig)),
        "reprojection_px": (
            np.sqrt(np.average(found["rms_px"].to_numpy() ** 2, weights=weights)),
            int(weights.sum()),
        ),
        "spots_mm": (1000.0 * rms(np.linalg.norm(movement.points(here) - there, axis=1)), len(here)),
        "world_shift_mm": (1000.0 * np.linalg.norm(middle_true - middle), len(here)),
        "world_turn_deg": (angles_deg(turn), len(here)),
    }
    return movement, _rows(values)


def tracking(
    views: pd.DataFrame,
    world: pd.DataFrame,
    true_views: pd.DataFrame,
    true_world: pd.DataFrame,
    cameras: Sequence[Camera],
    movement: Movement,
) -> Rows:
    """Return the rows of the markers of one record.

    Parameters
    ----------
    views, world : the tables ``markers_2d`` and ``markers_3d``.
    true_views, true_world : the planted ones, with the pixels of a disc that show.
    cameras : the planted cameras.
    """
    both = views.merge(true_views, on=["frame", "camera", "marker"], suffixes=("", "_true"))
    seen_views = both["status"].isin(trajectories.SEEN).to_numpy()
    off_px = np.linalg.norm(both[["x_px", "y_px"]].to_numpy() - both[["x_px_true", "y_px_true"]].to_numpy(), axis=1)

    there = trajectories.to_array(true_world, markers.NAMES)
    here = movement.points(trajectories.to_array(world, markers.NAMES))
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
    """Return which markers (T, M) show a third of their disc or more in two views or more."""
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
    movement: Movement,
) -> Rows:
    """Return the rows of the joint angles of one record, in frames in which their markers are seen.

    Both arms are taken together.

    Parameters
    ----------
    motion, world : the motion table and the table ``markers_3d`` that it was fitted to.
    true_motion, true_world : the planted ones, of as many frames.
    model : the body that the motion was fitted with; it says where the hand's marker sits on the forearm.
    """
    turned = movement.turns(_chain(motion)[0])
    true, true_places = _chain(true_motion)
    there = trajectories.to_array(true_world, markers.NAMES)
    known = np.isin(_status(world), trajectories.SEEN)
    off: dict[str, list[Floats]] = {"upper_arm_deg": [], "elbow_hand_deg": [], "axial_deg": []}
    for side in ("left", "right"):
        upper, fore = (skeleton.JOINTS.index(f"{side}_{part}") for part in ("arm", "forearm"))
        elbow, hand = (markers.NAMES.index(f"{side}_{part}") for part in ("elbow", "hand"))
        direction = between_deg(turned[:, upper, :, 1], true[:, upper, :, 1])
        to_hand = turned[:, fore] @ movement.turn @ model.marker_places_m[hand]
        line = between_deg(to_hand, there[:, hand] - true_places[:, fore])
        bent = true_motion[f"{side}_forearm_x_deg"].to_numpy() < -BENT_DEG
        told = known[:, elbow] & known[:, hand]
        off["upper_arm_deg"].append(direction[told])
        off["elbow_hand_deg"].append(line[told])
        off["axial_deg"].append(about_bone_deg(true[told & bent, upper], turned[told & bent, upper]))
    found = {
        f"{name}_deg": apart_deg(true[:, joint], turned[:, joint])
        for name, joint in (("thorax", skeleton.JOINTS.index("chest")), ("head", skeleton.JOINTS.index("head")))
    } | {quantity: np.concatenate(sides) for quantity, sides in off.items()}
    return _rows({quantity: (rms(values), len(values)) for quantity, values in found.items()})


def _status(world: pd.DataFrame) -> npt.NDArray[np.object_]:
    """Return how each marker's place (T, M) came to be."""
    table = world.set_index(["frame", "marker"])["status"].unstack()  # noqa: PD010
    return table[list(markers.NAMES)].to_numpy(dtype=object)


def _chain(motion: pd.DataFrame) -> tuple[Floats, Floats]:
    return skeleton.chain(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(motion))


def _rows(values: dict[str, tuple[float, int]]) -> Rows:
    return [{"quantity": quantity, "value": value, "n": n} for quantity, (value, n) in values.items()]
