"""Calibration with a board: known rigs are recovered from its corners, and drawn boards are detected."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from cospeech.capture.calibration import board, quality
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera, look, project

BOARD = board.Board(6, 8, 0.05, 0.0375, "DICT_4X4_100")
NAMES = ["c1", "c2", "c3"]
SIZE = (1280, 720)


def plant(n_boards=80, noise_px=0.1):
    """Return three cameras and their observed corners (3, T, K, 2) of a slowly moving board."""
    rng = np.random.default_rng(3)
    cameras = []
    for name, x, focal in zip(NAMES, (-0.7, 0.0, 0.8), (900.0, 940.0, 1000.0), strict=True):
        turn, shift = look(name, [x, 1.2, 1.6], [0.0, 1.0, 0.0])
        cameras.append(Camera(name, SIZE, (focal, focal), (650.0, 350.0), (-0.12, 0.05, 0.0, 0.0, 0.0), turn, shift))
    time = np.linspace(0, 2 * np.pi, n_boards)[:, None]
    turns = 0.6 * np.sin(time * [1.0, 2.0, 3.0] + [0.0, 1.0, 2.0])
    places = [0.0, 1.0, 0.0] + [0.35, 0.2, 0.3] * np.sin(time * [2.0, 3.0, 1.0] + [1.0, 0.0, 2.0])
    flat = (BOARD.corners_m - BOARD.corners_m.mean(axis=0)) * [1, -1, -1]  # with the printed side to the cameras
    points = np.array([flat @ Rotation.from_rotvec(t).as_matrix().T + p for t, p in zip(turns, places, strict=True)])
    corners = np.array([project(camera, points) for camera in cameras])
    corners += rng.normal(0, noise_px, corners.shape)
    corners[((corners < 0) | (corners > np.array(SIZE) - 1)).any(axis=-1)] = np.nan
    return cameras, corners


def relative(cameras, i, j):
    rotation = cameras[j].rotation @ cameras[i].rotation.T
    return rotation, np.array(cameras[j].shift_m) - rotation @ np.array(cameras[i].shift_m)


def pose_errors(cameras, truth):
    """Return the errors of the relative poses of all pairs: rotations in degrees, and relative translation errors."""
    turned, shifted = [], []
    for i in range(len(truth)):
        for j in range(i + 1, len(truth)):
            (a, s), (b, t) = relative(cameras, i, j), relative(truth, i, j)
            turned.append(np.degrees(Rotation.from_matrix(a @ b.T).magnitude()))
            shifted.append(np.linalg.norm(s - t) / np.linalg.norm(t))
    return np.array(turned), np.array(shifted)


def test_a_known_rig_is_recovered_in_metres():
    truth, corners = plant()
    cameras, points, used = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3)
    turned, shifted = pose_errors(cameras, truth)
    assert turned.max() < 0.2
    assert shifted.max() < 0.005
    for found, planted in zip(cameras, truth, strict=True):
        assert found.focal_px[0] == pytest.approx(planted.focal_px[0], rel=0.003)
    table = quality.table(cameras, points, used, corners.reshape(3, -1, 2))
    assert (table["rms_px"] < 0.2).all()
    boards = points.reshape(-1, *BOARD.corners_m.shape)
    boards = boards[~np.isnan(boards[:, 0, 0])]
    sides = np.linalg.norm(boards[:, 0] - boards[:, -1], axis=1)
    np.testing.assert_allclose(sides, np.linalg.norm(BOARD.corners_m[0] - BOARD.corners_m[-1]))


def test_known_intrinsics_are_kept_and_views_out_of_sync_rejected():
    truth, corners = plant()
    corners[1, 30:40] += 25.0
    cameras, _, used = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3, intrinsics=truth)
    assert [camera.focal_px for camera in cameras] == [camera.focal_px for camera in truth]
    turned, shifted = pose_errors(cameras, truth)
    assert turned.max() < 0.02
    assert shifted.max() < 0.001
    assert not used.reshape(3, 80, -1)[1, 30:40].any()


def test_the_board_at_the_origin_defines_the_world_frame():
    """x runs along its columns, z along its rows, and y towards the side from which it is seen."""
    truth, corners = plant()
    cameras, points, _ = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3, intrinsics=truth)
    change = board.to_world(BOARD, cameras, points, [{"origin_frame": 7}])
    placed = change.points(points).reshape(80, -1, 3)[7]
    np.testing.assert_allclose(placed, BOARD.corners_m[:, [0, 2, 1]], atol=1e-6)
    assert all(camera.place_m[1] > 0.5 for camera in change.cameras(cameras))
    with pytest.raises(UserError, match="not detected in frame 99"):
        board.to_world(BOARD, cameras, points, [{"origin_frame": 99}])


def test_without_an_origin_frame_the_world_frame_faces_the_first_camera():
    truth, corners = plant()
    cameras, points, _ = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3, intrinsics=truth)
    first = board.to_world(BOARD, cameras, points, []).cameras(cameras)[0]
    np.testing.assert_allclose(first.place_m, 0, atol=1e-9)
    np.testing.assert_allclose(project(first, np.array([0, 0, -2.0])), first.centre_px)
    x, y = project(first, np.array([0.1, 0.1, -2.0])) - first.centre_px
    assert x > 0 > y


def test_corners_become_a_table_and_back():
    drawn = BOARD.charuco.generateImage((560, 720), marginSize=40)
    blank = np.full_like(drawn, 128)
    table = pd.concat([board.detections(BOARD, "c1", [blank, drawn]), board.detections(BOARD, "c3", [blank, blank])])
    pixels = board.observations(BOARD, table, NAMES)
    assert pixels.shape == (3, 2, 35, 2)
    np.testing.assert_array_equal(pixels[0, 1], board.detect(BOARD, [drawn])[0])
    assert np.isnan(pixels[1:]).all()
    assert np.isnan(pixels[0, 0]).all()


@pytest.mark.parametrize("inverted", [False, True])
def test_a_drawn_board_is_detected(inverted):
    drawn = BOARD.charuco.generateImage((560, 720), marginSize=40)
    picture = 255 - drawn if inverted else drawn
    declared = board.Board(6, 8, 0.05, 0.0375, "DICT_4X4_100", inverted)
    found = board.detect(declared, [picture, np.full_like(picture, 128)])
    np.testing.assert_allclose(found[0], BOARD.corners_m[:, :2] / 0.05 * 80 + 39.5, atol=0.1)
    assert np.isnan(found[1]).all()


def test_too_few_boards_and_too_few_shared_ones_are_rejected():
    truth, corners = plant()
    few = corners.copy()
    few[1, 5:] = np.nan
    with pytest.raises(UserError, match="camera c2 saw the board in 5 frames"):
        board.calibrate(BOARD, NAMES, few, [SIZE] * 3)
    none = corners.copy()
    none[2] = np.nan
    with pytest.raises(UserError, match="camera c3 saw the board in 0 frames"):
        board.calibrate(BOARD, NAMES, none, [SIZE] * 3)
    alone = corners.copy()
    alone[2, :40], alone[:2, 40:] = np.nan, np.nan
    with pytest.raises(UserError, match="camera c3 shares 0 boards"):
        board.calibrate(BOARD, NAMES, alone, [SIZE] * 3, intrinsics=truth)
    late = corners.copy()
    late[2] = np.roll(corners[2], 16, axis=0)
    with pytest.raises(UserError, match=r"of camera c\d agree with the other cameras"):
        board.calibrate(BOARD, NAMES, late, [SIZE] * 3, intrinsics=truth)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("columns = 4", "not a valid board definition"),
        ("columns =", "not a valid board definition"),
        ("units = []", "not a valid board definition"),
        ("columns = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
        (None, "no such file"),
    ],
)
def test_an_invalid_board_definition_is_rejected(tmp_path, text, reason):
    path = tmp_path / "charuco.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(UserError, match=reason):
        board.read(path)
