"""Bad input ends with one clear message, a non-zero exit, no traceback, nothing half-written, others unharmed."""

import os
import shutil
import struct
import subprocess

import numpy as np
import pytest
import soundfile
import yaml
from conftest import ROOT, Project

from cospeech import verify

pytestmark = pytest.mark.workflow


@pytest.fixture
def corpus(finished, tmp_path):
    """Two actors of two records each, as somebody's own files; a test spoils those of record ``bad``."""
    raw = finished.folder / "results/test/corpus/raw"
    folder = tmp_path / "files"
    folder.mkdir()
    records = []
    for name, actor, source in (
        ("bad", "x", "ada_1"),
        ("good", "x", "ada_2"),
        ("c", "y", "ada_2"),
        ("d", "y", "ada_3"),
    ):
        record = {"record": name, "actor": actor}
        for field, suffix in (("motion", "bvh"), ("audio", "wav")):
            shutil.copy(raw / f"{source}.{suffix}", folder / f"{name}.{suffix}")
            record[field] = str(folder / f"{name}.{suffix}")
        records.append(record)
    return folder, records


def attempt(tmp_path, records, *targets, **sections):
    """Run the workflow on ``records`` and return the project and what ended."""
    config = yaml.safe_load((ROOT / "config/test.yaml").read_text())
    config["run"] = "tried"
    config["corpus"] = {
        "source": "recorded", "name": "tried", "records": records,
        "motion": {"up": "y", "unit": "m", "joints": "cospeech", "zero": "hanging"},
    }  # fmt: skip
    config["phrases"]["gesture"]["first_examples"] = "rules"
    for section, values in sections.items():
        config[section] = {**config.get(section, {}), **values}
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(config))
    project = Project(tmp_path / "project")
    project.folder.mkdir(exist_ok=True)
    wanted = targets or ("results/tried/speech/bad/prosody.parquet", "results/tried/speech/good/prosody.parquet")
    return project, project.run(*wanted, config=path)


def messages(said):
    """Return the distinct one-line messages that the user was shown."""
    return {line for line in said.splitlines() if line.startswith("cospeech: ")}


def check_refusal(project, ended, *words):
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    told = messages(ended.stdout)
    assert len(told) == 1, ended.stdout[-3000:]
    assert all(word in next(iter(told)) for word in words), told
    results = project.folder / "results/tried"
    assert verify.problems(results) == []
    assert not [path for path in results.rglob(".*") if path.is_file() and path.name != ".lock"]
    return results


def spoil_wav(path, how):
    data, rate = soundfile.read(path)
    if how == "empty":
        path.write_bytes(b"")
    elif how == "truncated":
        path.write_bytes(path.read_bytes()[:30])
    elif how == "mislabelled":
        path.write_bytes(b"%PDF-1.7 this is no sound")
    elif how == "silent":
        soundfile.write(path, np.zeros_like(data), rate)
    elif how == "short":
        soundfile.write(path, data[: 5 * rate], rate)


@pytest.mark.parametrize(
    ("how", "word"),
    [
        ("empty", "bad.wav"),
        ("truncated", "bad.wav"),
        ("mislabelled", "bad.wav"),
        ("silent", "silent"),
        ("short", "length"),
    ],
)
def test_a_bad_wav_stops_its_record_alone(corpus, tmp_path, how, word):
    folder, records = corpus
    spoil_wav(folder / "bad.wav", how)
    project, ended = attempt(tmp_path, records)
    results = check_refusal(project, ended, "bad", word)
    assert (results / "speech/good/prosody.parquet").is_file()
    assert not (results / "speech/bad/prosody.parquet").exists()


def spoil_bvh(path, how):
    lines = path.read_text().splitlines()
    first = lines.index("MOTION") + 3
    if how == "empty":
        path.write_text("")
    elif how == "truncated":
        path.write_text("\n".join(lines[: first - 20]))
    elif how == "mislabelled":
        path.write_bytes(struct.pack("<4I", 1, 2, 3, 4))
    elif how == "nan":
        lines[first + 7] = "nan " + lines[first + 7].split(maxsplit=1)[1]
        path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("how", ["empty", "truncated", "mislabelled", "nan"])
def test_a_bad_bvh_stops_its_record_alone(corpus, tmp_path, how):
    folder, records = corpus
    spoil_bvh(folder / "bad.bvh", how)
    project, ended = attempt(tmp_path, records)
    results = check_refusal(project, ended, "bad.bvh")
    assert (results / "speech/good/prosody.parquet").is_file()
    assert not (results / "motion/bad.parquet").exists()


def test_an_unknown_joint_is_named(corpus, tmp_path):
    _, records = corpus
    joints = {"hips": "hips", "left_arm": "LeftArm"}
    motion = {"up": "y", "unit": "m", "joints": joints, "zero": "hanging"}
    corpus_section = {"source": "recorded", "name": "tried", "records": records, "motion": motion}
    target = "results/tried/motion/bad.parquet"
    project, ended = attempt(tmp_path, records, target, corpus=corpus_section)
    check_refusal(project, ended, "LeftArm", "bad.bvh")


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0.0,1.0,dancing\n", ("dancing", "raise_both")),
        ("0.0,999.0,rest\n", ("999", "past the end")),
        ("0.0,2.0,rest\n1.0,3.0,left\n", ("overlap",)),
        ("2.0,1.0,rest\n", ("bad.csv",)),
        ("zero,1.0,rest\n", ("bad.csv", "zero")),
    ],
)
def test_bad_annotations_are_named(corpus, tmp_path, rows, words):
    folder, records = corpus
    (folder / "bad.csv").write_text("start_s,end_s,gesture\n" + rows)
    records[0]["annotations"] = str(folder / "bad.csv")
    targets = ("results/tried/corpus/annotations/bad.parquet", "results/tried/corpus/annotations/good.parquet")
    project, ended = attempt(tmp_path, records, *targets)
    results = check_refusal(project, ended, "bad.csv", *words)
    assert (results / "corpus/annotations/good.parquet").is_file()


def test_stereo_and_8_khz_are_handled_and_said(corpus, tmp_path):
    folder, records = corpus
    data, rate = soundfile.read(folder / "bad.wav")
    soundfile.write(folder / "bad.wav", np.column_stack([data, data])[::2], rate // 2)
    target = "results/tried/corpus/records/bad.parquet"
    project, ended = attempt(tmp_path, records, target, "results/tried/speech/bad/prosody.parquet")
    assert ended.returncode == 0, ended.stdout[-2000:]
    from cospeech import tables

    row = tables.read(project.folder / target, "records").iloc[0]
    assert row["audio_rate_hz"] == 8000
    assert "channels" in row["note"]
    assert "8000" in row["note"]


def test_a_damaged_table_is_named_when_it_is_read(corpus, tmp_path):
    _, records = corpus
    target = "results/tried/speech/bad/prosody.parquet"
    project, ended = attempt(tmp_path, records, target)
    assert ended.returncode == 0
    path = project.folder / target
    before = path.stat()
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    fold = "results/tried/phrases/prosody/clusters~4/states~3/fold~bad/model.parquet"
    project, ended = attempt(tmp_path, records, fold)
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert len(messages(ended.stdout)) == 1
    assert "prosody.parquet: damaged" in ended.stdout
    assert "run again" in ended.stdout


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"studoi": {"coupling": 1}}, ("unknown key 'studoi'", "did you mean 'studio'")),
        ({"studio": {"coupling": "much"}}, ("studio.coupling", "not of type 'number'")),
        ({"speech": {"pitch_min_hz": 900}}, ("pitch_min_hz must be below",)),
    ],
)
def test_a_bad_configuration_is_found_before_any_job(tmp_path, sections, words):
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump({"run": "tried"} | sections))
    project = Project(tmp_path / "project")
    project.folder.mkdir()
    ended = project.run(config=path)
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert all(word in ended.stdout for word in words)
    assert not (project.folder / "results").exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_full_disk_is_said_and_leaves_nothing_half_written(tmp_path):
    project = Project(tmp_path / "small")
    project.folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(project.folder)], check=False)
    if mounted.returncode:
        pytest.skip("this machine does not let root mount a tmpfs")
    try:
        ended = project.run()
        assert ended.returncode != 0
        assert "Traceback" not in "".join(messages(ended.stdout))
        assert any("the disk is full" in line for line in messages(ended.stdout)), ended.stdout[-3000:]
        assert verify.problems(project.folder / "results/test") == []
    finally:
        subprocess.run(["umount", "-l", str(project.folder)], check=True)
