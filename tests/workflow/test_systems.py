"""Systems of other packages: named in the configuration they are in every result, and harm no other when they fail.

All tests look at one run: the finished one, and on top of it the two toy systems and five broken ones.
"""

import html
import shutil
import subprocess
import sys
from dataclasses import replace

import av
import numpy as np
import pandas as pd
import pytest
import yaml
from project import ROOT, Project
from third_party import TOY, Packages

from cospeech import api
from cospeech.data import tables
from cospeech.formats import bvh
from cospeech.motion import skeleton
from cospeech.rendering import video

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

RECORDS = ("ada_1", "ada_2", "ada_3")
HABITS = ("toy_habits", "toy_habits_shuffled", "toy_habits_shifted")
LIFT = ("toy_lift", "toy_lift_shuffled", "toy_lift_shifted")
CANNOT_LOAD = "system '{0}' of package '{0}' cannot be loaded: "
NOT_LOADED = {
    "broken_import": CANNOT_LOAD.format("broken_import") + "ModuleNotFoundError: No module named 'a_missing_library'",
    "broken_role": CANNOT_LOAD.format("broken_role") + "declares role 'genius'; known are system, control, ceiling",
    "hsmm": "system 'hsmm' of package 'usurper' is left out: package 'cospeech' has a system 'hsmm'; "
    "rename one of them",
}
FAILED = {
    "broken_training": "system 'broken_training', which declares that it needs gestures, prosody_labels and makes "
    "phrases: ValueError: there is too little to learn from",
    "broken_length": "system 'broken_length' declares that it makes motion, but its motion for record '{record}' "
    "has 7 frames; expected 480",
}
DECLARED = """
from cospeech.synthesis.declaration import System

SYSTEM = System(name={name!r}, title="Broken", method={module!r}, {how})
"""
TRAINING = """
def train(training, settings):
    raise ValueError("there is too little\\nto learn from")
"""
LENGTH = """
from cospeech.motion import skeleton
from cospeech.synthesis.interface import Synthesis, decoding

def train(training, settings):
    return None

def synthesise(model, speech, seed):
    return Synthesis(decoding(speech), motion=skeleton.standing(7, speech.motion_fps))

def to_tables(model):
    return {}
"""


def install(folder):
    """Install the toy package with pip, and packages that are broken in different ways."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--no-index", "--no-deps"]
    subprocess.run([*pip, "--no-build-isolation", "--target", str(folder), str(TOY)], check=True, capture_output=True)
    packages = Packages(folder)

    def declare(name, how, module=None, rest="", system=None):
        packages.install(name, DECLARED.format(name=system or name, module=module or name, how=how) + rest)

    packages.install("broken_import", "import a_missing_library")
    declare("broken_role", "role='genius'")
    declare("usurper", "", system="hsmm")
    declare("broken_training", "tables={'habits': 'habits'}, schemas='toy_gestures'", rest=TRAINING)
    declare("broken_length", "needs=('prosody',), makes='motion'", rest=LENGTH)


def configuration():
    """The test configuration with the toys and what is broken: in all that a user can name."""
    config = yaml.safe_load((ROOT / "config" / "test.yaml").read_text())
    default = yaml.safe_load((ROOT / "config" / "demo.yaml").read_text())
    broken = ("broken_import", "broken_role", "broken_training", "broken_length")
    config["synthesis"] = {
        "systems": {"toy_habits": {"shortest_s": 0.75}, "toy_lift": {"highest_deg": 50}}
        | {name: {} for name in broken}
    }
    config["animation"]["systems"] = [
        *default["animation"]["systems"],
        *("toy_habits", "broken_training", "broken_import", "broken_role_shuffled"),
    ]
    config["animation"]["video"]["shown"] = ["broken_import", "broken_length", "toy_lift", "hsmm_weighted"]
    return config


class Run(Project):
    """The run with systems of other packages, and what it printed."""

    said = ""

    def of(self, system, record="ada_1"):
        """The folder of a system's results."""
        (folder,) = (self.folder / "results/test/synthesis" / system).glob(f"*/{record}")
        return folder

    def result(self, path, schema):
        return tables.read(self.folder / "results/test" / path, schema)


@pytest.fixture(scope="module")
def run(finished, tmp_path_factory):
    folder = tmp_path_factory.mktemp("systems")
    install(folder / "packages")
    (folder / "config.yaml").write_text(yaml.safe_dump(configuration()))
    shutil.copytree(finished.folder, folder / "run", symlinks=True, copy_function=shutil.copy2)
    run = Run(folder / "run", packages=(folder / "packages",))
    said = run.make("all", "results/test/models/toy_lift/main/ada", config=folder / "config.yaml")
    object.__setattr__(run, "said", said)
    return run


@pytest.fixture
def installed(run, monkeypatch):
    """Makes the packages of the run those of this process as well."""
    monkeypatch.syspath_prepend(run.packages[0])


# ---------------------------------------------------------------- systems that work


def exhibit(run, name):
    return pd.read_csv(run.folder / "reports/test/tables" / f"{name}.csv")


@pytest.mark.parametrize("name", ["record_scores", "session_scores"])
def test_their_scores_stand_next_to_those_of_their_controls(run, name):
    table = run.result(f"evaluation/{name}.parquet", name)
    found = {key: set(own["phrases"]) for key, own in table.groupby("system")}
    assert found["toy_habits"] == {"planned", "seen"}
    assert {key: found[key] for key in HABITS[1:]} == {key: {"planned"} for key in HABITS[1:]}  # not animated
    assert {key: found[key] for key in LIFT} == {key: {"seen"} for key in LIFT}  # plans no phrases
    variants = table.drop_duplicates("system").set_index("system")["variant"]
    assert variants["toy_lift_shifted"] == "main"
    assert variants["toy_habits"] == variants["hsmm"] != "main"


def test_differences_compare_them_with_their_controls(run):
    table = run.result("evaluation/differences.parquet", "differences")
    pairs = set(zip(table["system"], table["other"], table["phrases"], strict=True))
    assert {("toy_habits", control, "planned") for control in (*HABITS[1:], "random", "hsmm")} <= pairs
    assert {("toy_lift", control, "seen") for control in (*LIFT[1:], "random", "toy_habits", "original")} <= pairs


@pytest.mark.parametrize("record", RECORDS)
def test_phrases_that_are_planned_become_motion_in_which_phrases_are_seen(run, record):
    folder = run.of("toy_habits", record)
    phrases = tables.read(folder / "phrases.parquet", "segments")
    units = tables.read(folder / "units.parquet", "units")
    motion = tables.read(folder / "motion.parquet", "motion")
    seen = tables.read(folder / "phrases_seen.parquet", "segments")
    assert len(units) == len(phrases)
    assert len(motion) == len(run.result(f"motion/{record}.parquet", "motion"))
    assert set(seen["record"]) == {record}
    assert (phrases["end_s"] - phrases["start_s"]).iloc[:-1].min() >= 0.75  # as configured


@pytest.mark.parametrize("system", LIFT)
def test_motion_is_written_as_bvh_and_phrases_are_seen_in_it(run, system):
    folder = run.of(system)
    motion = tables.read(folder / "motion.parquet", "motion")
    assert len(motion) == 480
    assert motion["left_forearm_x_deg"].between(-50, 0).all()  # as configured
    clip = bvh.read(folder / "motion.bvh")
    assert len(clip.rotations) == 480
    assert clip.fps == pytest.approx(skeleton.frame_rate(motion))
    seen = tables.read(folder / "phrases_seen.parquet", "segments")
    assert seen["end_frame"].iloc[-1] == 480


def test_controls_are_driven_by_the_wrong_prosody(run):
    made = {system: tables.read(run.of(system) / "motion.parquet", "motion") for system in LIFT}
    rows = {system: tables.read(run.of(system) / "decoding.parquet", "decoding").iloc[0] for system in LIFT}
    assert [rows[system]["driving_record"] == "ada_1" for system in LIFT] == [True, False, True]
    # Intensity is normalised over the record, and so the same at a shifted moment, except between prosody frames.
    # The first 3 s and the last 1.5 s of the record stay in place.
    own, shifted = (made[system]["left_forearm_x_deg"].to_numpy() for system in ("toy_lift", "toy_lift_shifted"))
    np.testing.assert_allclose(own[:58], shifted[:58])
    own, shifted = own[60:449], shifted[60:449]
    lag = round(rows["toy_lift_shifted"]["shift_s"] * 20)
    assert np.corrcoef(np.roll(own, -lag), shifted)[0, 1] > 0.95
    assert np.corrcoef(own, shifted)[0, 1] < 0.5


def test_motion_statistics_know_them(run):
    table = run.result("evaluation/motion_statistics.parquet", "motion_statistics")
    assert {"original", "hsmm", "toy_habits", *LIFT} <= set(table["system"])


def test_figures_and_tables_of_the_report_show_them(run):
    assert {*HABITS, *LIFT} <= set(exhibit(run, "leaderboard")["system"])
    assert {"toy_habits", "toy_lift"} <= set(exhibit(run, "fig-differences")["system"])
    assert {"toy_habits", *LIFT} <= set(exhibit(run, "fig-motion")["system"])
    assert {"hsmm", "toy_lift"} <= set(exhibit(run, "fig-7.5")["sequence"])
    strips = exhibit(run, "fig-timeline")["strip"].unique()
    assert {"Toy: lifted hands", "HSMM, emissions weighted"} <= set(strips)
    page = (run.folder / "reports/test/index.html").read_text()
    assert all(title in page for title in ("Toy: habits", "Toy: lifted hands"))


def test_the_comparison_video_shows_those_that_made_motion(run):
    with av.open(str(run.folder / "results/test/animation/ada_1/comparison.mp4")) as film:
        stream = film.streams.video[0]
        height, width = video.panel_size(180)
        assert (stream.height, stream.width) == (height, 4 * width)  # original, toy_lift, hsmm_weighted, random
        assert len(film.streams.audio) == 1


def test_the_tables_of_their_models_are_valid_in_the_schemas_of_their_package(run, installed):
    path = run.of("toy_lift") / "lift.parquet"
    assert tables.read(path, "toy_gestures:lift")["highest_deg"].tolist() == [50.0]
    assert tables.read_metadata(path)["schema"] == "toy_gestures:lift"
    assert {"habits.parquet", "timing.parquet"} <= {path.name for path in run.of("toy_habits").iterdir()}


def test_every_file_of_the_run_is_as_its_job_wrote_it(run):
    """The folders of models included, whose files Snakemake does not know one by one."""
    run.make("verify", config=run.folder.parent / "config.yaml")


def test_their_models_move_to_new_speech(run, installed):
    model = api.load_model(run.folder / "results/test/models/toy_lift/main/ada")
    assert (model.system.name, model.card["variant"]) == ("toy_lift", "main")
    made = api.synthesize(run.folder / "results/test/corpus/audio/ada_1.wav", model)
    assert len(made.motion) == 480
    assert made.phrases["end_frame"].iloc[-1] == 480  # seen in the motion
    assert made.motion["left_forearm_x_deg"].min() == -50


# ---------------------------------------------------------------- systems that fail


@pytest.mark.parametrize("name", NOT_LOADED)
def test_one_that_cannot_be_loaded_is_named_once_and_left_out(run, name):
    lines = [line for line in run.said.splitlines() if NOT_LOADED[name] in line]
    assert lines == [f"cospeech: {NOT_LOADED[name]}"]
    if name != "hsmm":
        assert not (run.folder / "results/test/synthesis" / name).exists()


@pytest.mark.parametrize("name", FAILED)
def test_one_that_fails_is_named_with_what_it_declares_once_for_each_record(run, name):
    for record in RECORDS:
        message = FAILED[name].format(record=record)
        assert run.said.splitlines().count(f"cospeech: {record}: {message}") == 1
        decoding = tables.read(run.of(name, record) / "decoding.parquet", "decoding")
        assert decoding["failure"].tolist() == [message]
    assert "Traceback" not in run.said


@pytest.mark.parametrize("name", FAILED)
def test_one_that_fails_leaves_empty_tables_and_is_in_no_result(run, name):
    folder = run.of(name)
    assert len(tables.read(folder / "motion.parquet", "motion")) == 0
    assert len(tables.read(folder / "phrases_seen.parquet", "segments")) == 0
    assert "Frames: 0" in (folder / "motion.bvh").read_text().splitlines()
    for result in ("record_scores", "session_scores", "differences", "motion_statistics", "motion_histograms"):
        systems = run.result(f"evaluation/{result}.parquet", result)["system"]
        assert not systems.str.startswith("broken").any()
    for path in (run.folder / "reports/test/tables").glob("*.csv"):
        assert path.stem == "table-seconds" or "roken" not in path.read_text()


def test_the_page_says_what_failed_and_why(run):
    page = html.unescape((run.folder / "reports/test/index.html").read_text())
    for message in [*NOT_LOADED.values(), *(message.format(record="ada_1") for message in FAILED.values())]:
        assert message in page


def test_the_traceback_of_a_failure_is_in_the_log(run):
    (log,) = (run.folder / "results/test/logs/systems_broken_training").glob("ada_1.log")
    assert "Traceback" in log.read_text()
    assert 'raise ValueError("there is too little\\nto learn from")' in log.read_text()


def of_cospeech(table, known):
    """The rows of a table of results that concern the systems ``known`` only."""
    columns = [name for name in ("system", "other") if name in table.columns]
    return table[table[columns].isin(known).all(axis=1)].reset_index(drop=True)


@pytest.mark.parametrize("name", ["record_scores", "session_scores", "differences", "motion_statistics"])
def test_results_of_the_other_systems_are_those_of_a_run_without_them(run, finished, name):
    path = f"evaluation/{name}.parquet"
    before = tables.read(finished.folder / "results/test" / path, name)
    after = of_cospeech(run.result(path, name), set(before["system"]))
    order = [column for column in before.columns if before[column].dtype != float]
    pd.testing.assert_frame_equal(
        after.sort_values(order, kind="stable", ignore_index=True),
        before.sort_values(order, kind="stable", ignore_index=True),
    )


def test_nothing_of_the_other_systems_was_made_again(run, finished):
    before = replace(finished).artifacts()
    after = replace(run).artifacts()
    kept = [path for path in before if "/synthesis/" in path or "/planned/" in path]
    assert len(kept) > 100
    assert [path for path in kept if before[path] != after[path]] == []
