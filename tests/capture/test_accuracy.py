"""The scores of the motion capture reproduce errors that were introduced on purpose."""

import numpy as np
import pytest
import subject
from scipy.spatial.transform import Rotation

from cospeech.capture import accuracy
from cospeech.capture.fitting import body_model
from cospeech.data import tables, trajectories
from cospeech.geometry.camera import Camera, to_table
from cospeech.motion import markers, skeleton
from cospeech.studio import laser, planted, rig

N_FRAMES = 40
WORLD = Rotation.from_rotvec([0.002, -0.003, 0.001])
SHIFT_M = np.array([0.002, -0.001, 0.003])
"""Translation of the estimated world frame in the true one."""


def in_estimated_world(points_m):
    return WORLD.inv().apply((points_m - SHIFT_M).reshape(-1, 3)).reshape(points_m.shape)


def found_rig(focal=1.0):
    """Return the true cameras in the estimated world frame, with focal lengths scaled by a factor."""
    moved = []
    for camera in rig.cameras(696, 1):
        rotation = camera.rotation @ WORLD.as_matrix()
        shift = camera.rotation @ SHIFT_M + camera.shift_m
        longer = tuple(focal * length for length in camera.focal_px)
        turn = tuple(Rotation.from_matrix(rotation).as_rotvec())
        moved.append(Camera(camera.name, camera.size_px, longer, camera.centre_px, camera.lens, turn, tuple(shift)))
    return moved


def values(rows):
    return {row["quantity"]: row["value"] for row in rows}


@pytest.fixture(scope="module")
def spots():
    return laser.visible_spots(rig.cameras(696, 1), laser.walk(300, 1), 1)


@pytest.fixture(scope="module")
def to_planted(spots):
    cameras = found_rig()
    table = to_table(cameras).assign(rms_px=0.1, n_points=50)
    return accuracy.calibration(table, cameras, rig.cameras(696, 1), spots)


def test_the_transform_of_the_world_frame_is_reported_and_removed(spots, to_planted):
    change, rows = to_planted
    found = values(rows)
    assert found["world_turn_deg"] == pytest.approx(np.degrees(WORLD.magnitude()), rel=1e-3)
    assert found["world_shift_mm"] == pytest.approx(
        1000 * np.linalg.norm(SHIFT_M), abs=3
    )  # the centroid of the spots rotates too
    assert found["spots_mm"] < 1e-3
    assert found["focal_error_pct"] == pytest.approx(0, abs=1e-9)
    assert found["reprojection_px"] == pytest.approx(0.1)
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(change.points(in_estimated_world(points)), points, atol=1e-6)
    longer = found_rig(1.01)
    table = to_table(longer).assign(rms_px=0.1, n_points=50)
    worse = values(accuracy.calibration(table, longer, rig.cameras(696, 1), spots)[1])
    assert worse["focal_error_pct"] == pytest.approx(1)
    assert worse["spots_mm"] > 1


def test_introduced_marker_errors_are_counted(to_planted):
    cameras = rig.cameras(696, 1)
    places = subject.marked(subject.range_of_motion(5.0), 0.0)[:N_FRAMES]
    shown = np.full((len(cameras), N_FRAMES, len(markers.NAMES)), 60.0)
    shown[1:, :, markers.NAMES.index("back")] = 0  # only one view shows it, so it is not visible
    true_views, true_world = planted.in_views(cameras, places, shown), planted.in_world(places, shown, subject.FPS)
    found = places + np.array([0.001, 0.0, 0.0])
    found[3, markers.NAMES.index("chest"), 1] += 0.05
    swapped = [markers.NAMES.index(f"{side}_hand") for side in ("left", "right")]
    found[7, swapped] = found[7, swapped[::-1]]
    world = trajectories.to_table(in_estimated_world(found), markers.NAMES, subject.FPS)
    lost = (world["frame"] < 2) & world["marker"].isin(["head_left", "back"])
    world.loc[lost, trajectories.AXES] = np.nan
    world.loc[lost, "status"] = "lost"
    held = (world["frame"] == 9) & (world["marker"] == "left_foot")
    world.loc[held, "status"] = "predicted"
    views = true_views.assign(status="seen")
    views["x_px"] += 0.3
    views["y_px"] += 0.4
    views.loc[0, ["x_px", "status"]] = [9999.0, "predicted"]
    rows = accuracy.tracking(views, world, true_views, true_world, cameras, to_planted[0])
    found = values(rows)
    n_seen = N_FRAMES * len(markers.NAMES) - 5
    n_visible = N_FRAMES * (len(markers.NAMES) - 1)
    assert found["pixels_px"] == pytest.approx(0.5)
    assert found["swaps"] == 3
    assert found["predicted_mm"] == pytest.approx(1.0, abs=1e-3)
    apart = np.linalg.norm(places[7, swapped[0]] - places[7, swapped[1]])
    squares = (n_seen - 3) * 0.001**2 + 0.05**2 + 0.001**2 + 2 * apart**2
    assert found["seen_mm"] == pytest.approx(1000 * np.sqrt(squares / n_seen), rel=0.01)
    assert found["visible_unseen_pct"] == pytest.approx(100 * 3 / n_visible)
    assert found["visible_lost_pct"] == pytest.approx(100 * 2 / n_visible)
    table = accuracy.table([row | {"record": "x", "method": "robust"} for row in rows])
    tables.validate(table, "capture_scores", "x")


def test_introduced_angle_errors_are_measured(to_planted):
    """The estimated motion is the true one in another world frame, with additional head and axial arm rotation."""
    truth = subject.performance(4.0)
    for side in ("left", "right"):
        truth[[f"{side}_{part}_{axis}_deg" for part in ("forearm", "hand") for axis in "xyz"]] = 0.0
        truth[f"{side}_forearm_x_deg"] = -60.0
    spoilt = truth.copy()
    spoilt[["left_arm_y_deg", "right_arm_y_deg"]] += 2.0
    spoilt["head_y_deg"] += 3.0
    turned, _ = subject.chain(spoilt)
    turned = (WORLD.inv() * Rotation.from_matrix(turned.reshape(-1, 3, 3)) * WORLD).as_matrix().reshape(turned.shape)
    local = turned.copy()
    for index, joint in enumerate(skeleton.BODY):
        if joint.parent is not None:
            parent = skeleton.JOINTS.index(joint.parent)
            local[:, index] = np.swapaxes(turned[:, parent], 1, 2) @ turned[:, index]
    motion = skeleton.motion_table(np.zeros((len(truth), 3)), skeleton.euler(local), subject.FPS)

    places = subject.marked(truth, 0.0)
    held = trajectories.to_table(in_estimated_world(places), markers.NAMES, subject.FPS)
    held.loc[(held["frame"] < 30) & (held["marker"] == "left_hand"), "status"] = "predicted"
    on_part = np.array([subject.PLACES_M[name] for name in markers.NAMES])
    for side in ("left", "right"):
        on_part[markers.NAMES.index(f"{side}_hand")] += skeleton.OFFSET_M[f"{side}_hand"]
    model = body_model.BodyModel(np.zeros((len(body_model.NAMES), 3)), WORLD.inv().apply(on_part), (0.0, 0.0))
    world = trajectories.to_table(places, markers.NAMES, subject.FPS)
    rows = accuracy.angles(motion, held, truth, world, model, to_planted[0])
    found, counts = values(rows), {row["quantity"]: row["n"] for row in rows}
    assert found["thorax_deg"] == pytest.approx(0, abs=1e-3)
    assert found["head_deg"] == pytest.approx(3, abs=1e-3)
    assert found["upper_arm_deg"] == pytest.approx(0, abs=1e-3)
    assert found["axial_deg"] == pytest.approx(2, abs=1e-3)
    # The hand marker does not lie exactly on the axis of the forearm.
    assert found["elbow_hand_deg"] == pytest.approx(2 * np.sin(np.radians(60)), rel=0.1)
    assert counts["axial_deg"] == counts["elbow_hand_deg"] == counts["upper_arm_deg"] == 2 * len(truth) - 30
