"""People's own capture data: marker files become joint angles; what is wrong with one is said, others unharmed."""

import ezc3d
import numpy as np
import pandas as pd
import pytest
import soundfile
import yaml
from project import Project
from test_bad_input import messages

from cospeech import c3d, markers, skeleton, tables, trc, verify
from cospeech.studio import cast, dress, motion, range_of_motion, script
from cospeech.trajectories import Trajectories

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("own_capture")]

FPS, SECONDS = 50.0, 6.0
THEIRS = {name: name.upper() for name in markers.NAMES if not name.endswith(("leg", "foot"))}

GOOD = ("c3d_gaps",)
BAD = {
    "c3d_unitless": "does not say its unit",
    "trc_unmapped": "has no marker 'LEFT_HAND' (mapped to left_hand); did you mean 'LEFT_",
    "mover_1": "static pose: marker",
}
"""Every bad record, named by what is wrong with it, and words that its message must hold."""


def performance(actor):
    """What the actor does in a record: a motion table at ``FPS``."""
    gestures, prosody = script.write(cast.member(actor, 1, 0.025, 10.0), "x", SECONDS, 0.8, 0.025, 1)
    return motion.perform(actor, "x", gestures, prosody, FPS, 1)


def recording(moved, actor="ada"):
    """The markers of a motion as another laboratory has them: under its names, z up, facing -y."""
    places = dress.wear(moved, dress.places(actor, 1))[:, [markers.NAMES.index(name) for name in THEIRS]]
    z_up = np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)
    return Trajectories(tuple(THEIRS.values()), z_up, FPS)


def write(path, given):
    """Write a recording with what the name of its file says is wrong with it."""
    kind, _, how = path.stem.partition("_")
    names, places, fps = given
    places = places.copy()
    if how == "gaps":
        places[50:60, names.index("LEFT_HAND")] = np.nan
    elif how == "unmapped":
        names = tuple("FINGER" if name == "LEFT_HAND" else name for name in names)
    (trc if kind == "trc" else c3d).write(Trajectories(names, places, fps), path)
    if how == "unitless":
        file = ezc3d.c3d(str(path))
        file["parameters"]["POINT"]["UNITS"]["value"] = [""]
        file.write(str(path))


@pytest.fixture(scope="module")
def tried(tmp_path_factory):
    """A run on marker files of two actors, one of whom never stands still: folder, what was said, what was done."""
    top = tmp_path_factory.mktemp("own_capture")
    moved = performance("ada")
    soundfile.write(top / "voice.wav", 0.3 * np.sin(np.arange(int(SECONDS * 16000)) / 20), 16000)
    records = []
    for name in (*GOOD, *BAD, "mover_2"):
        kind = "trc" if name.startswith("trc") else "c3d"
        write(top / f"{name}.{kind}", recording(moved))
        records.append({"record": name, "actor": "mover" if "mover" in name else "ada",
                        "motion": str(top / f"{name}.{kind}"), "audio": str(top / "voice.wav")})  # fmt: skip
    exercises = recording(range_of_motion.perform(FPS))
    c3d.write(exercises, top / "range.c3d")
    c3d.write(exercises._replace(places_m=exercises.places_m[150:]), top / "restless.c3d")
    config = {
        "run": "own",
        "corpus": {"source": "recorded", "name": "own", "records": records,
                   "markers": {"up": "z", "facing": "-y", "names": THEIRS}},
        "capture": {"ranges": {"ada": str(top / "range.c3d"), "mover": str(top / "restless.c3d")}},
        "phrases": {"gesture": {"first_examples": "rules"}},
    }  # fmt: skip
    (top / "config.yaml").write_text(yaml.safe_dump(config))
    project = Project(top / "project")
    project.folder.mkdir()
    targets = [f"results/own/corpus/records/{name}.parquet" for name in (*GOOD, *BAD)]
    ended = project.run(*targets, config=top / "config.yaml")
    return project.folder / "results" / "own", ended, moved


def test_each_bad_marker_file_has_one_message_that_names_it(tried):
    _, ended, _ = tried
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert len(messages(ended.stdout)) == len(BAD), ended.stdout[-3000:]
    for name, words in BAD.items():
        # Of the actor who moves it is the range-of-motion take that is named.
        assert messages(ended.stdout, "range-of-motion take" if name == "mover_1" else name).pop().count(words) == 1


@pytest.mark.parametrize("record", GOOD)
def test_marker_files_become_the_joint_angles_that_were_planted(tried, record):
    results, _, moved = tried
    row = tables.read(results / "corpus" / "records" / f"{record}.parquet", "records").iloc[0]
    assert (row["motion_source"], row["motion_fps"], row["duration_s"]) == ("markers", FPS, SECONDS)
    assert row["motion_path"].endswith(f"{record}.c3d")
    world = tables.read(results / "capture" / record / "markers_3d.parquet", "markers_3d")
    hand = world[world["marker"] == "left_hand"].set_index("frame")["status"]
    assert (hand == "predicted").to_numpy().nonzero()[0].tolist() == list(range(50, 60))
    found = pd.read_parquet(results / "motion" / f"{record}.parquet")
    turned = {
        name: skeleton.chain(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(motion))[0]
        for name, motion in (("found", found), ("true", moved))
    }
    for joint in ("chest", "head"):
        index = skeleton.JOINTS.index(joint)
        between = np.swapaxes(turned["found"][:, index], 1, 2) @ turned["true"][:, index]
        cosine = (np.trace(between, axis1=1, axis2=2) - 1.0) / 2.0
        assert np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max() < 0.5


def test_bad_marker_files_leave_nothing_half_written(tried):
    results, _, _ = tried
    assert verify.problems(results) == []
    assert {path.stem for path in (results / "corpus" / "records").glob("*.parquet")} == set(GOOD)


def test_an_actor_without_a_range_of_motion_take_is_named_before_any_job(tried, tmp_path):
    results, _, _ = tried
    top = results.parents[2]
    config = yaml.safe_load((top / "config.yaml").read_text())
    del config["capture"]["ranges"]["mover"]
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(config))
    ended = Project(top / "project").run("--dry-run", config=tmp_path / "config.yaml")
    assert "marker file or folder, in capture.ranges.mover" in ended.stdout
    assert "Traceback" not in ended.stdout
