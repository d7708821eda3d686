"""What an edit reruns: just what rests on it. What a fold may learn from: nothing of its own record."""

import shutil
import subprocess

import pyarrow.parquet as pq
import pytest
import yaml
from project import ROOT, Project, differing

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


@pytest.fixture
def edited(copy, tmp_path):
    """The finished run with a copy of the program that a test may edit."""
    program = tmp_path / "program"
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    for name in filter(None, listed.split("\0")):
        (program / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, program / name, follow_symlinks=False)
    return Project(copy.folder, program)


def append(path, line):
    path.write_text(path.read_text() + line)


def test_a_copy_of_the_program_elsewhere_repeats_at_most_the_report(edited):
    """The report's template is part of the program; nothing else depends on a path."""
    assert edited.planned() <= {"page", "exhibits", "score_exhibits"}


@pytest.mark.parametrize(
    ("module", "reruns", "spares"),
    [
        (
            "speech/prosody.py",
            {"prosody", "prosody_clusters", "sweep_settings", "systems", "motion", "record_scores", "page"},
            {
                "studio_script",
                "studio_take",
                "record",
                "records",
                "gesture_model",
                "gesture_fold",
                "gesture_phrases",
                "examples",
            },
        ),
        (
            "segmentation/gesture.py",
            {
                "gesture_model",
                "gesture_fold",
                "gesture_phrases",
                "systems",
                "sweep_settings",
                "record_scores",
                "page",
            },
            {"studio_take", "record", "prosody", "prosody_clusters"},
        ),
        (
            "metrics/similarity.py",
            # The job that moves heads scores them as well, so the videos, which show these heads, are made again.
            {"record_scores", "session_scores", "score_exhibits", "heads", "page"},
            {"prosody_clusters", "systems", "motion", "motion_statistics"},
        ),
        (
            "motion/smoothing.py",
            {"motion", "smoothing", "comparison", "motion_statistics", "page"},
            {"systems", "prosody", "prosody_clusters"},
        ),
    ],
)
def test_an_edited_module_reruns_what_rests_on_it_and_nothing_else(edited, module, reruns, spares):
    append(edited.program / "src/cospeech" / module, "# edited\n")
    planned = edited.planned()
    assert reruns <= planned
    assert planned & spares == set()


@pytest.mark.slow
def test_an_edit_that_changes_nothing_gives_the_same_bytes(edited, finished):
    append(edited.program / "src/cospeech/metrics/similarity.py", "# edited\n")
    edited.make()
    assert differing(finished.artifacts(), edited.artifacts()) == []
    assert "Nothing to be done" in edited.make()


def config_with(tmp_path, **sections):
    """Write the test configuration with some sections laid over it, and return its path."""
    config = yaml.safe_load((ROOT / "config/test.yaml").read_text())
    for section, values in sections.items():
        config[section] = {**config.get(section, {}), **values}
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(config))
    return path


def test_a_changed_setting_reruns_only_its_readers(copy, tmp_path):
    planned = copy.planned(config=config_with(tmp_path, evaluation={"boundary_tolerance_s": 0.3}))
    assert {"record_scores", "score_exhibits", "page"} <= planned
    assert planned & {"record", "prosody", "prosody_clusters", "systems", "motion", "comparison"} == set()


def test_a_longer_sweep_leaves_the_main_setting_alone(copy, tmp_path):
    planned = copy.planned(config=config_with(tmp_path, sweep={"clusters": [4, 6, 8], "states": [3]}))
    assert {"sweep_settings", "record_scores"} <= planned
    assert planned & {"prosody", "prosody_clusters", "systems", "motion", "comparison"} == set()


def recorded(finished, tmp_path, records):
    """Write a configuration that reads the studio's raw files as if they were somebody's own corpus."""
    raw = finished.folder / "results/test/corpus/raw"
    listed = [
        {"record": name, "actor": "ada", "motion": str(raw / f"{name}.bvh"), "audio": str(raw / f"{name}.wav")} | more
        for name, more in records.items()
    ]
    corpus = {
        "source": "recorded", "name": "tried", "records": listed,
        "motion": {"up": "y", "unit": "m", "joints": "cospeech", "zero": "hanging"},
    }  # fmt: skip
    path = tmp_path / "recorded.yaml"
    config = yaml.safe_load((ROOT / "config/test.yaml").read_text()) | {"run": "tried", "corpus": corpus}
    config["phrases"]["gesture"]["first_examples"] = "annotations"
    path.write_text(yaml.safe_dump(config))
    return path


def models(project, run, fold):
    """Return the content of every model table that the fold's synthesis rests on, by path."""
    results = project.folder / "results" / run
    paths = [
        *results.glob(f"phrases/gesture/fold~{fold}/*.parquet"),
        *results.glob(f"segmentation/**/fold~{fold}.parquet"),
        *results.glob(f"phrases/prosody/*/*/fold~{fold}/model.parquet"),
        *results.glob(f"synthesis/hsmm/*/{fold}/initial.parquet"),
        *results.glob(f"synthesis/hsmm/*/{fold}/transitions.parquet"),
        *results.glob(f"synthesis/hsmm/*/{fold}/emissions.parquet"),
        *results.glob(f"synthesis/hsmm/*/{fold}/durations.parquet"),
        *results.glob(f"synthesis/hsmm_weighted/*/{fold}/decoding.parquet"),
    ]
    return {str(path.relative_to(results)): pq.read_table(path) for path in sorted(paths)}


@pytest.mark.slow
def test_nothing_of_the_held_out_record_reaches_its_model(finished, tmp_path):
    """Exchange motion, sound and annotations of one record for another's: its fold's models stay the same."""
    annotations = tmp_path / "examples.csv"
    table = pq.read_table(finished.folder / "results/test/corpus/annotations.parquet").to_pandas()
    paths = {}
    for name in ("ada_1", "ada_2", "ada_3"):
        paths[name] = annotations.with_name(f"{name}.csv")
        table[table["record"] == name][["start_s", "end_s", "gesture"]].to_csv(paths[name], index=False)
    plain = {name: {"annotations": str(paths[name])} for name in paths}
    raw = finished.folder / "results/test/corpus/raw"
    # The held-out record becomes the first 20 s of another record, with that one's annotations.
    head = annotations.with_name("head.csv")
    inside = table[(table["record"] == "ada_2") & (table["end_s"] < 20)]
    inside[["start_s", "end_s", "gesture"]].to_csv(head, index=False)
    other = {"motion": str(raw / "ada_2.bvh"), "audio": str(raw / "ada_2.wav"), "end_s": 20.0}
    exchanged = plain | {"ada_1": other | {"annotations": str(head)}}
    target = "results/tried/synthesis/hsmm_weighted/clusters~4,states~3/ada_1/phrases.parquet"
    one, two = Project(tmp_path / "one"), Project(tmp_path / "two")
    for project, records in ((one, plain), (two, exchanged)):
        project.folder.mkdir()
        project.make(target, config=recorded(finished, tmp_path, records))
    before, after = models(one, "tried", "ada_1"), models(two, "tried", "ada_1")
    assert len(before) >= 12
    assert before.keys() == after.keys()
    for path in before:
        left, right = before[path], after[path]
        if path.endswith("decoding.parquet"):  # the path's score is the record's own; the weight is the model's
            left, right = left.select(["emission_weight"]), right.select(["emission_weight"])
        assert left.equals(right), path


def test_corrected_annotations_come_back_and_only_their_dependents_run(finished, copy, tmp_path):
    """Export to ELAN and Praat, correct a label there, import both, and run again."""
    copy.make("annotate")
    exported = copy.folder / "results/test/annotations"
    corrected = tmp_path / "ada_1.eaf"
    shutil.copy(exported / "ada_1.eaf", corrected)
    records = {
        "ada_1": {"annotations": str(corrected)},
        "ada_2": {"annotations": str(exported / "ada_2.TextGrid")},
        "ada_3": {"annotations": str(exported / "ada_3.TextGrid")},
    }
    project = Project(tmp_path / "project")
    project.folder.mkdir()
    config = recorded(finished, tmp_path, records)
    target = "results/tried/synthesis/hsmm/clusters~4,states~3/ada_2/phrases.parquet"
    project.make(target, "results/tried/corpus/annotations.parquet", config=config)
    imported = pq.read_table(project.folder / "results/tried/corpus/annotations.parquet").to_pandas()
    found = pq.read_table(finished.folder / "results/test/phrases/gesture/ada_1.parquet").to_pandas()
    mine = imported[imported["record"] == "ada_1"]
    assert mine["gesture"].tolist() == found["label"].tolist()
    assert mine["start_s"].tolist() == pytest.approx(found["start_s"].tolist(), abs=0.0011)
    assert set(mine["origin"]) == {"person"}
    text = corrected.read_text(encoding="utf-8")
    old = found["label"].iloc[1]
    new = "open" if old != "open" else "left"
    corrected.write_text(text.replace(f">{old}<", f">{new}<", 1), encoding="utf-8")
    planned = project.planned(target, config=config)
    assert "gesture_fold" in planned
    assert planned & {"record", "prosody", "prosody_clusters"} == set()
