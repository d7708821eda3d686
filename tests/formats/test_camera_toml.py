"""Camera files of Pose2Sim and caliscope, and the ways in which they can be wrong."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_rig import plant

from cospeech.capture.calibration import fingerprint
from cospeech.errors import UserError
from cospeech.formats import camera_toml
from cospeech.geometry.camera import project

SHARED = Path(__file__).parents[3] / "shared/data"
POSE2SIM = SHARED / "pose2sim_balancing"
CALISCOPE = SHARED / "caliscope_charuco/camera_array.toml"

FLAT = """
[cam_01]
name = "left"
size = [ 1088.0, 1920.0]
matrix = [ [ 1681.2, 0.0, 532.9], [ 0.0, 1681.0, 948.1], [ 0.0, 0.0, 1.0]]
distortions = [ -0.1, 0.02, 0.001, 0.002]
rotation = [ 0.0, 0.0, 1.5707963267948966]
translation = [ 0.3, 0.9, 2.8]
fisheye = false

[metadata]
"""

TURN = "[ 0.0, 0.0, 1.5707963267948966]"


def save(tmp_path, text):
    path = tmp_path / "calibration.toml"
    path.write_text(text)
    return path


def test_pose2sim_has_its_cameras_at_the_top(tmp_path):
    (camera,) = camera_toml.read(save(tmp_path, FLAT))
    assert (camera.name, camera.size_px, camera.focal_px) == ("left", (1088, 1920), (1681.2, 1681.0))
    assert camera.lens == (-0.1, 0.02, 0.001, 0.002, 0.0)
    np.testing.assert_allclose(camera.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)


def test_caliscope_has_them_below_and_its_rotations_may_be_matrices(tmp_path):
    text = FLAT.replace("[cam_01]\nname = \"left\"", "[cameras.3]").replace(
        "[ 0.0, 0.0, 1.5707963267948966]", "[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]"
    ).replace("0.002]", "0.002, 0.07]")  # fmt: skip
    (camera,) = camera_toml.read(save(tmp_path, text))
    (other,) = camera_toml.read(save(tmp_path, FLAT))
    assert (camera.name, camera.lens[4]) == ("cam_3", 0.07)
    np.testing.assert_allclose(camera.rotation, other.rotation, atol=1e-12)


def test_a_world_with_z_up_is_turned(tmp_path):
    path = save(tmp_path, FLAT)
    (there,), (here,) = camera_toml.read(path), camera_toml.read(path, up="z")
    point = np.array([0.3, -0.2, 0.7])
    np.testing.assert_allclose(project(here, point[[1, 2, 0]]), project(there, point), atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("[cam_01]", "[cam_01", "not a TOML file"),
        ("matrix", "matrices", "has no camera"),
        ("size", "sizes", "camera cam_01: 'size' is missing"),
        ("fisheye = false", "fisheye = true", "fisheye"),
        ("0.02, 0.001, 0.002]", "0.02]", "'distortions' has the shape 2, but must be k1, k2, p1, p2 and perhaps k3"),
        ("0.002]", "0.002, 0.1, 0.2, 0.0, 0.0]", "nonzero coefficients beyond k3"),
        ("[ 0.3, 0.9, 2.8]", "[ 0.3, 0.9]", "'translation' has the shape 2, but must be 3 numbers"),
        ("-0.1,", '"x",', "'distortions' holds something other than numbers"),
        ("-0.1,", "nan,", "'distortions' holds missing, infinite or much too large numbers"),
        ("1088.0, 1920.0", "0.0, 1920.0", "'size' is 0 x 1920"),
        ("1681.2", "-1681.2", "must be positive"),
        ("1681.2", "0.0", "must be positive"),
        ("1681.2", "4.2", "focal lengths of 4.2 and 1681 px are impossible for an image of 1088x1920 px"),
        ("532.9", "2532.9", r"the principal point \(2532.9, 948.1\) lies outside the image"),
        ("1681.2, 0.0", "1681.2, 30.0", "skew"),
        (
            "[ 1681.2, 0.0, 532.9], [ 0.0, 1681.0, 948.1], [ 0.0, 0.0, 1.0]",
            "[ 1681.2, 0.0, 0.0], [ 0.0, 1681.0, 0.0], [ 532.9, 948.1, 1.0]",
            "last row of 'matrix' is not 0 0 1; transpose it",
        ),
        ("[ 0.0, 0.0, 1.0]]", "[ 0.0, 0.1, 1.0]]", "last row of 'matrix' is not 0 0 1; export"),
        ("1.5707963267948966", "90.0", "length of 90, more than pi; give it in radians, not in degrees"),
        (TURN, "[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]", "not a rotation matrix"),
        (TURN, "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]", "reflection"),
        ("[ 0.3, 0.9, 2.8]", "[ 300, 900, 2800]", "camera left is 2956 m from the origin; .* in metres"),
        ("[metadata]", FLAT.replace("cam_01", "cam_02"), "two cameras are called 'left'"),
        (
            "[metadata]",
            FLAT.replace("cam_01", "cam_02").replace("left", "right"),
            "cameras left and right are in the same place",
        ),
    ],
)
def test_what_is_not_a_camera_file_is_rejected(tmp_path, old, new, reason):
    assert old in FLAT
    with pytest.raises(UserError, match=reason):
        camera_toml.read(save(tmp_path, FLAT.replace(old, new, 1)))


def test_vectors_in_the_shapes_of_opencv_are_read(tmp_path):
    column = "[[ 0.0], [ 0.0], [1.5707963267948966]]"
    text = FLAT.replace(TURN, column).replace(
        "[ -0.1, 0.02, 0.001, 0.002]", "[[-0.1, 0.02, 0.001, 0.002, 0, 0, 0, 0]]"
    )
    assert text.count("[[") == 2
    assert camera_toml.read(save(tmp_path, text)) == camera_toml.read(save(tmp_path, FLAT))


def test_a_deeply_nested_file_is_rejected(tmp_path):
    with pytest.raises(UserError, match=r"calibration\.toml: nested too deeply"):
        camera_toml.read(save(tmp_path, "a = " + "[" * 5000 + "]" * 5000))


def test_a_missing_file_is_named():
    with pytest.raises(UserError, match=r"nowhere\.toml: no such file"):
        camera_toml.read("nowhere.toml")


def test_a_calibration_belongs_to_its_videos(tmp_path):
    films = {name: tmp_path / f"{name}.mkv" for name in ("c1", "c2")}
    for name, path in films.items():
        path.write_bytes(name.encode() * 1000)
    take = list(films.values())
    recorded = fingerprint.of_take(list(films), take)
    fingerprint.check(recorded, take)
    for other in ({"c1": recorded["c1"]}, recorded | {"c3": recorded["c1"]}, recorded | {"c2": recorded["c1"]}):
        with pytest.raises(UserError, match=r"another take \(camera c[23] differs\)"):
            fingerprint.check(other, take)
    films["c2"].write_bytes(b"other")
    with pytest.raises(UserError, match=r"another take \(camera c2 differs\)"):
        fingerprint.check(recorded, take)
    with pytest.raises(UserError, match="no such file"):
        fingerprint.of(tmp_path / "none.mkv")


def test_one_file_that_gives_all_cameras_is_all_their_footage(tmp_path):
    path = save(tmp_path, FLAT)
    recorded = fingerprint.of_take(["left", "right"], [path])
    assert recorded["left"] == recorded["right"] == fingerprint.of(path)
    fingerprint.check(recorded, [path])
    save(tmp_path, FLAT + "# edited\n")
    with pytest.raises(UserError, match=r"calibration\.toml: the cameras were calibrated from another take"):
        fingerprint.check(recorded, [path])


@pytest.mark.parametrize("up", ["y", "z"])
def test_what_is_written_is_read_again(tmp_path, up):
    truth, _, _ = plant(2, n_points=1)
    odd = replace(truth[1], name="left hand", lens=(-0.1, 0.02, 0.001, -0.002, 0.07))
    for camera, back in zip(
        [truth[0], odd], camera_toml.read(save(tmp_path, camera_toml.toml([truth[0], odd], up)), up), strict=True
    ):
        assert (back.name, back.size_px, back.focal_px, back.centre_px) == (
            camera.name, camera.size_px, camera.focal_px, camera.centre_px
        )  # fmt: skip
        assert back.lens == camera.lens
        np.testing.assert_allclose(back.pose, camera.pose, atol=1e-12)


def test_pose2sim_gets_a_world_with_z_up(tmp_path):
    """There, a point one metre up is (0, 0, 1)."""
    truth, _, _ = plant(2, n_points=1)
    text = camera_toml.toml(truth, up="z")
    there = camera_toml.read(save(tmp_path, text), up="y")
    np.testing.assert_allclose(
        project(there[0], np.array([0.2, 0.1, 1.0])), project(truth[0], np.array([0.1, 1.0, 0.2])), atol=1e-9
    )
    assert "k3" not in text
    assert len(tomllib.loads(text)["c1"]["distortions"]) == 4


@pytest.mark.recorded
@pytest.mark.skipif(not POSE2SIM.is_dir(), reason="needs the real recordings in ../shared/data/pose2sim_balancing")
def test_pose2sims_nose_falls_on_the_keypoints_it_was_made_of():
    """Only two views determine the nose: the others are tens of pixels off and rejected by Pose2Sim."""
    cameras = camera_toml.read(POSE2SIM / "calibration/Calib_qualisys.toml", up="z")
    path = POSE2SIM / "points_3d/S00_P00_T01_BalancingTrial_0-100.trc"
    column = 2 + 3 * path.read_text().splitlines()[3].split("\t")[2::3].index("Nose")
    nose = np.genfromtxt(path, skip_header=5, delimiter="\t")[:, column : column + 3]
    for camera in cameras[:2]:
        folder = POSE2SIM / f"pose/{camera.name.replace('_', '')}_json"
        apart = []
        for seen, keypoints in zip(project(camera, nose), sorted(folder.iterdir())[: len(nose)], strict=True):
            people = json.loads(keypoints.read_text())["people"]
            apart.append(min(np.hypot(*(person["pose_keypoints_2d"][:2] - seen)) for person in people))
        assert np.median(apart) < 3.0


@pytest.mark.recorded
@pytest.mark.skipif(not CALISCOPE.is_file(), reason="needs the real recordings in ../shared/data/caliscope_charuco")
def test_caliscopes_cameras_are_read():
    cameras = camera_toml.read(CALISCOPE)
    assert [camera.name for camera in cameras] == ["cam_0", "cam_1", "cam_2", "cam_3"]
    assert cameras[0].focal_px == pytest.approx((903.550124, 907.878867))
