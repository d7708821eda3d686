"""From films to joint angles by the workflow, held against what was planted before the cameras."""

import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from project import ROOT, Project
from scipy.spatial.transform import Rotation

from cospeech import skeleton
from cospeech.evaluation import scores

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("film")]

FILM = ROOT / "config" / "film.yaml"
RECORDS = ("ada_1", "ada_2")
TRUE_ANGLES = "results/film/evaluation/true_angles/ada.parquet"


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    project = Project(tmp_path_factory.mktemp("film"))
    phrases = [
        f"results/film/synthesis/hsmm_weighted/clusters~4/states~3/{record}/phrases.parquet" for record in RECORDS
    ]
    project.make("markers", *phrases, TRUE_ANGLES, config=FILM)
    return project.folder / "results" / "film"


def test_the_rig_is_found_from_the_laser_alone(filmed):
    """The goal is 0.2 % of focal length on the mean, with noise of 0.3 px; the studio's spots are found to 0.1 px."""
    found = pd.read_parquet(filmed / "capture" / "cameras.parquet").set_index("camera")
    truth = pd.read_parquet(filmed / "corpus" / "truth" / "cameras.parquet").set_index("camera")
    assert list(found.index) == list(truth.index)
    assert (found["fx_px"] / truth["fx_px"] - 1).abs().mean() < 0.002
    assert found["rms_px"].max() < 0.15
    assert found["n_points"].min() > 400


@pytest.mark.parametrize("record", RECORDS)
def test_markers_are_found_where_they_were_planted(filmed, record):
    """The goal at half size: 1.0 mm RMS in space, no marker taken for another."""
    found = pd.read_parquet(filmed / "capture" / record / "markers_3d.parquet")
    truth = pd.read_parquet(filmed / "corpus" / "truth" / f"markers_3d~{record}.parquet")
    both = found.merge(truth, on=["frame", "marker"], suffixes=("", "_true"))
    places = ["x_m", "y_m", "z_m"]
    seen = (both["status"] == "seen").to_numpy()
    here, there = both[places].to_numpy(), both[[f"{name}_true" for name in places]].to_numpy()
    # The frame of the world comes from the points on which the laser's spot rested.
    assert np.sqrt(np.mean(np.sum((here - there)[seen] ** 2, axis=1))) < 0.0007
    middle, middle_true = here[seen].mean(axis=0), there[seen].mean(axis=0)
    turn, _ = Rotation.align_vectors(there[seen] - middle_true, here[seen] - middle)
    error = np.linalg.norm(turn.apply(here - middle) + middle_true - there, axis=1)
    assert len(both) == len(truth)
    assert seen.mean() > 0.95
    assert np.sqrt(np.mean(error[seen] ** 2)) < 0.001
    assert error[seen].max() < 0.02  # half the distance of two markers that could be exchanged, and less


@pytest.mark.parametrize("record", RECORDS)
def test_trunk_and_head_turn_as_planted(filmed, record):
    """The goal: 0.2 degrees."""
    turned = {}
    for name, path in (
        ("found", f"capture/{record}/motion.parquet"),
        ("true", f"corpus/truth/motion~{record}.parquet"),
    ):
        motion = pd.read_parquet(filmed / path)
        root_m = motion[list(skeleton.ROOT_COLUMNS)].to_numpy()
        turned[name], _ = skeleton.chain(root_m, skeleton.angles(motion))
    for joint in ("chest", "head"):
        index = skeleton.JOINTS.index(joint)
        between = np.swapaxes(turned["found"][:, index], 1, 2) @ turned["true"][:, index]
        cosine = (np.trace(between, axis1=1, axis2=2) - 1.0) / 2.0
        degrees = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        assert np.sqrt(np.mean(degrees**2)) < 0.2, joint


@pytest.mark.parametrize("record", RECORDS)
def test_other_programs_get_their_files(filmed, record):
    for ending, first in (("trc", b"PathFileType"), ("c3d", b"\x02P"), ("bvh", b"HIERARCHY")):
        assert (filmed / "export" / f"{record}.{ending}").read_bytes().startswith(first)


def test_true_angles_go_the_way_of_found_ones(filmed, tmp_path):
    """With the found angles in the place of the true ones, the scores are those of the run itself."""
    shutil.copytree(filmed, tmp_path / "results" / "film")
    again = tmp_path / "results" / "film"
    for record in RECORDS:
        shutil.copy(again / "motion" / f"{record}.parquet", again / "corpus" / "truth" / f"motion~{record}.parquet")
    Project(tmp_path).make(TRUE_ANGLES, "--allowed-rules", "true_angles", "--force", config=FILM)
    found = pd.read_parquet(tmp_path / TRUE_ANGLES)
    settings = yaml.safe_load((ROOT / "config" / "demo.yaml").read_text(encoding="utf-8"))
    evaluation = settings["evaluation"]
    rules = scores.Rules(
        gestures=tuple(settings["phrases"]["gesture"]["labels"]),
        bins_s=tuple(evaluation["bins_s"]),
        max_duration_s=settings["synthesis"]["max_duration_s"],
        tolerance_s=evaluation["boundary_tolerance_s"],
        frame_s=settings["speech"]["frame_s"],
        **evaluation["interior"],
    )
    for record in RECORDS:
        actual, made = (
            scores.phrases(pd.read_parquet(again / path), rules)
            for path in (
                f"phrases/gesture/{record}.parquet",
                f"synthesis/hsmm_weighted/clusters~4/states~3/{record}/phrases.parquet",
            )
        )
        own = pd.DataFrame(scores.record_scores(actual, made, rules))
        there = found[found["record"] == record].reset_index(drop=True)[own.columns]
        pd.testing.assert_frame_equal(there, own, check_dtype=False)
