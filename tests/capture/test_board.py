"""The board: planted rigs are found from its corners, drawn boards detected, and real films agree with caliscope."""

from pathlib import Path

import av
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cospeech.capture import axes, board, bundle, given, quality
from cospeech.capture.camera import Camera, look, project
from cospeech.errors import UserError

CALISCOPE = Path(__file__).parents[3] / "shared/data/caliscope_charuco"
BOARD = board.Board(6, 8, 0.05, 0.0375, "DICT_4X4_100")
NAMES = ["c1", "c2", "c3"]
SIZE = (1280, 720)


def plant(n_boards=200, noise_px=0.1):
    """Return three cameras and the corners (3, T, K, 2) of a slowly moving board."""
    rng = np.random.default_rng(3)
    cameras = []
    for name, x, focal in zip(NAMES, (-0.7, 0.0, 0.8), (900.0, 940.0, 1000.0), strict=True):
        turn, shift = look(name, [x, 1.2, 1.6], [0.0, 1.0, 0.0])
        cameras.append(Camera(name, SIZE, (focal, focal), (650.0, 350.0), (-0.12, 0.05, 0.0, 0.0, 0.0), turn, shift))
    time = np.linspace(0, 2 * np.pi, n_boards)[:, None]
    turns = 0.6 * np.sin(time * [1.0, 2.0, 3.0] + [0.0, 1.0, 2.0])
    places = [0.0, 1.0, 0.0] + [0.35, 0.2, 0.3] * np.sin(time * [2.0, 3.0, 1.0] + [1.0, 0.0, 2.0])
    flat = BOARD.corners_m - BOARD.corners_m.mean(axis=0)
    points = np.array([flat @ Rotation.from_rotvec(t).as_matrix().T + p for t, p in zip(turns, places, strict=True)])
    corners = np.array([project(camera, points) for camera in cameras])
    corners += rng.normal(0, noise_px, corners.shape)
    corners[((corners < 0) | (corners > np.array(SIZE) - 1)).any(axis=-1)] = np.nan
    return cameras, corners


def relative(cameras, i, j):
    rotation = cameras[j].rotation @ cameras[i].rotation.T
    return rotation, np.array(cameras[j].shift_m) - rotation @ np.array(cameras[i].shift_m)


def pose_errors(cameras, truth):
    """Return degrees and relative shifts by which the poses of all pairs differ, in the cameras' own metre."""
    turned, shifted = [], []
    for i in range(len(truth)):
        for j in range(i + 1, len(truth)):
            (a, s), (b, t) = relative(cameras, i, j), relative(truth, i, j)
            turned.append(np.degrees(Rotation.from_matrix(a @ b.T).magnitude()))
            shifted.append(np.linalg.norm(s - t) / np.linalg.norm(t))
    return np.array(turned), np.array(shifted)


def test_a_planted_rig_is_found_in_metres():
    truth, corners = plant()
    cameras, points, used = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3)
    turned, shifted = pose_errors(cameras, truth)
    assert turned.max() < 0.1
    assert shifted.max() < 0.005
    for found, planted in zip(cameras, truth, strict=True):
        assert found.focal_px[0] == pytest.approx(planted.focal_px[0], rel=0.003)
    table = quality.table(cameras, points, used, corners.reshape(3, -1, 2))
    assert (table["rms_px"] < 0.2).all()


def test_known_insides_are_kept():
    truth, corners = plant()
    cameras, _, _ = board.calibrate(BOARD, NAMES, corners, [SIZE] * 3, insides=truth)
    assert [camera.focal_px for camera in cameras] == [camera.focal_px for camera in truth]
    turned, shifted = pose_errors(cameras, truth)
    assert turned.max() < 0.03
    assert shifted.max() < 0.002


@pytest.mark.parametrize("inverted", [False, True])
def test_a_drawn_board_is_detected(inverted):
    drawn = BOARD.made.generateImage((560, 720), marginSize=40)
    picture = 255 - drawn if inverted else drawn
    declared = board.Board(6, 8, 0.05, 0.0375, "DICT_4X4_100", inverted)
    found = board.detect(declared, [picture, np.full_like(picture, 128)])
    np.testing.assert_allclose(found[0], BOARD.corners_m[:, :2] / 0.05 * 80 + 39.5, atol=0.1)
    assert np.isnan(found[1]).all()


def test_too_few_boards_and_none_shared_are_refused():
    _, corners = plant()
    few = corners.copy()
    few[1, 5:] = np.nan
    with pytest.raises(UserError, match="camera c2 saw 5 boards"):
        board.calibrate(BOARD, NAMES, few, [SIZE] * 3)
    alone = corners.copy()
    alone[2, :100], alone[:2, 100:] = np.nan, np.nan
    with pytest.raises(UserError, match="camera c3 shares 0 boards"):
        board.calibrate(BOARD, NAMES, alone, [SIZE] * 3)


@pytest.mark.parametrize(
    ("text", "reason"),
    [("columns = 4", "no definition of a board"), ("columns =", "no definition of a board"), (None, "no such board")],
)
def test_what_defines_no_board_is_refused(tmp_path, text, reason):
    path = tmp_path / "charuco.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(UserError, match=reason):
        board.read(path)


def filmed():
    declared = board.read(CALISCOPE / "charuco.toml")
    corners = []
    for number in range(4):
        with av.open(CALISCOPE / f"calibration/extrinsic/cam_{number}.mp4") as film:
            corners.append(board.detect(declared, (f.to_ndarray(format="gray") for f in film.decode(video=0))))
    return declared, np.array(corners)


@pytest.mark.recorded
@pytest.mark.skipif(not CALISCOPE.is_dir(), reason="needs the real recordings in ../shared/data/caliscope_charuco")
def test_caliscopes_films_give_its_rig():
    """Places after a similarity, relative to the cameras' mean distance. caliscope knew the insides from other films.

    From these films alone the board covers a fifth of a picture at most, which leaves the principal points, and with
    them the directions, uncertain by degrees; with caliscope's insides its poses are found again.
    """
    declared, corners = filmed()
    wanted = given.read(CALISCOPE / "camera_array.toml")
    names, sizes = [camera.name for camera in wanted], [camera.size_px for camera in wanted]
    cameras, points, used = board.calibrate(declared, names, corners, sizes)
    distances = bundle.residuals(bundle.from_cameras(cameras), points, corners.reshape(4, -1, 2))
    assert np.sqrt(np.mean(distances[used] ** 2)) < 1.0
    places, theirs = (np.array([camera.place_m for camera in rig]) for rig in (cameras, wanted))
    change = axes.fit(places, theirs)
    apart = np.mean([np.linalg.norm(theirs[i] - theirs[j]) for i in range(4) for j in range(i)])
    assert np.linalg.norm(change.points(places) - theirs, axis=1).max() < 0.01 * apart
    assert change.scale == pytest.approx(1.0, abs=0.01)
    known, _, _ = board.calibrate(declared, names, corners, sizes, insides=wanted)
    turned, shifted = pose_errors(known, wanted)
    assert turned.max() < 1.0
    assert shifted.max() < 0.02
