"""From films to joint angles by the workflow, held against what was planted before the cameras."""

import numpy as np
import pandas as pd
import pytest
from project import ROOT, Project

from cospeech import skeleton

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("film")]

RECORDS = ("ada_1", "ada_2")


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    project = Project(tmp_path_factory.mktemp("film"))
    project.make("markers", config=ROOT / "config" / "film.yaml")
    return project.folder / "results" / "film"


@pytest.mark.parametrize("record", RECORDS)
def test_markers_are_found_where_they_were_planted(filmed, record):
    """The goal at half size: 1.0 mm RMS in space, no marker taken for another."""
    found = pd.read_parquet(filmed / "capture" / record / "markers_3d.parquet")
    truth = pd.read_parquet(filmed / "corpus" / "truth" / f"markers_3d~{record}.parquet")
    both = found.merge(truth, on=["frame", "marker"], suffixes=("", "_true"))
    places = ["x_m", "y_m", "z_m"]
    error = np.linalg.norm(both[places].to_numpy() - both[[f"{name}_true" for name in places]].to_numpy(), axis=1)
    seen = both["status"] == "seen"
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
