"""One command calibrates a rig, without any record: from a file, from real films of a board; bad films are named."""

import numpy as np
import pandas as pd
import pytest
import yaml
from project import ROOT, Project
from scipy.spatial.transform import Rotation

from cospeech.capture.calibration import board, world_frame
from cospeech.formats import camera_toml
from cospeech.geometry import camera
from cospeech.studio import rig

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("calibration")]

SHARED = ROOT.parent / "shared"


def configure(folder, **calibration):
    path = folder / "config.yaml"
    corpus = {"source": "recorded", "name": "rig_alone"}
    path.write_text(yaml.safe_dump({"run": "rig", "corpus": corpus, "capture": {"calibration": calibration}}))
    return path


def test_a_given_calibration_becomes_cameras_and_goes_out_again(tmp_path):
    truth = rig.cameras(696, 1)
    (tmp_path / "rig.toml").write_text(camera_toml.toml(truth, up="z"))
    project = Project(tmp_path)
    project.make(config=configure(tmp_path, method="given", file="rig.toml", up="z"))
    results = tmp_path / "results/rig"
    cameras = camera.from_table(pd.read_parquet(results / "capture/cameras.parquet"))
    for found in (cameras, camera_toml.read(results / "export/calibration.toml", up="z")):
        for one, planted in zip(found, truth, strict=True):
            assert (one.name, one.size_px, one.focal_px) == (planted.name, planted.size_px, planted.focal_px)
            np.testing.assert_allclose(one.pose, planted.pose, atol=1e-9)
    assert (results / "capture/rig.png").stat().st_size > 1000
    assert pd.read_parquet(results / "capture/calibration_quality.parquet")["rms_px"].isna().all()


def test_a_damaged_film_of_the_take_is_named_in_one_line(tmp_path):
    (tmp_path / "take").mkdir()
    for name in ("c1", "c2", "c3"):
        (tmp_path / f"take/{name}.mkv").write_bytes(b"no film" * 100)
    ended = Project(tmp_path).run(config=configure(tmp_path, method="laser", films="take"))
    assert ended.returncode != 0
    complaint = "cospeech: laser: take/c1.mkv: not a video, or incomplete; convert it with ffmpeg, or copy it again"
    assert complaint in ended.stdout
    assert "Traceback" not in ended.stdout
    assert not list((tmp_path / "results").rglob("*.parquet"))


@pytest.fixture(scope="module")
def caliscope(tmp_path_factory):
    """config/caliscope.yaml, run next to the real recordings as a user would."""
    folder = tmp_path_factory.mktemp("caliscope")
    (folder / "shared").symlink_to(SHARED)
    project = Project(folder / "project")
    project.folder.mkdir()
    project.make(config=ROOT / "config/caliscope.yaml")
    return project.folder / "results/caliscope"


def pose_errors(cameras, truth):
    """Return degrees and relative shifts by which the poses of all pairs differ, in the cameras' own metre."""
    turned, shifted = [], []
    for i, one in enumerate(truth):
        for j in range(i):
            (a, s), (b, t) = (_relative(found[j], found[i]) for found in (cameras, truth))
            turned.append(np.degrees(Rotation.from_matrix(a @ b.T).magnitude()))
            shifted.append(np.linalg.norm(s - t) / np.linalg.norm(t))
        assert cameras[i].name == one.name
    return np.array(turned), np.array(shifted)


def _relative(first, second):
    rotation = second.rotation @ first.rotation.T
    return rotation, np.array(second.shift_m) - rotation @ np.array(first.shift_m)


@pytest.mark.recorded
@pytest.mark.skipif(
    not (SHARED / "data/caliscope_charuco").is_dir(),
    reason="needs the recordings in ../shared/data/caliscope_charuco",
)
def test_caliscopes_films_give_its_rig(caliscope):
    """caliscope knew the intrinsics of its cameras from other films.

    From these films alone the board covers a fifth of a picture at most, which leaves the principal points, and with
    them the directions, uncertain by degrees; with caliscope's intrinsics its poses are found again.
    """
    quality = pd.read_parquet(caliscope / "capture/calibration_quality.parquet")
    assert np.sqrt((quality["rms_px"] ** 2 * quality["n_points"]).sum() / quality["n_points"].sum()) < 1.0
    truth = camera_toml.read(SHARED / "data/caliscope_charuco/camera_array.toml")
    found = camera.from_table(pd.read_parquet(caliscope / "capture/cameras.parquet"))
    places, theirs = (np.array([one.place_m for one in rig]) for rig in (found, truth))
    change = world_frame.fit(places, theirs)
    apart = np.mean([np.linalg.norm(theirs[i] - theirs[j]) for i in range(4) for j in range(i)])
    missed = np.linalg.norm(change.points(places) - theirs, axis=1) / apart
    assert missed.max() < 0.015
    assert change.scale == pytest.approx(1.0, abs=0.01)
    declared = board.read(SHARED / "data/caliscope_charuco/charuco.toml")
    names, sizes = [one.name for one in truth], [one.size_px for one in truth]
    corners = board.observations(declared, pd.read_parquet(caliscope / "capture/corners.parquet"), names)
    known, _, _ = board.calibrate(declared, names, corners, sizes, intrinsics=truth)
    for label, cameras in (("alone", found), ("with caliscope's intrinsics", known)):
        turned, shifted = pose_errors(cameras, truth)
        print(f"{label}: {turned.min():.2f}-{turned.max():.2f} deg, {shifted.min():.2%}-{shifted.max():.2%}")
    print(f"alone: places within {missed.max():.2%} of the cameras' distance, metre {change.scale - 1:+.2%}")
    assert turned.max() < 1.0
    assert shifted.max() < 0.016
