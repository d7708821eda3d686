"""Bad input ends with one clear message, a non-zero exit, no traceback, nothing half-written, others unharmed.

One run takes in a record for each way in which a file can be bad, among good ones.
"""

import os
import re
import shutil
import subprocess

import numpy as np
import pytest
import soundfile
import yaml
from project import ROOT, Project

from cospeech.data import tables

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

GOOD = ("good_1", "good_2", "stereo_8_khz")


def write_sound(path, change):
    data, rate = soundfile.read(path)
    soundfile.write(path, *change(data, rate))


def spoil_sound(path, how):
    if how == "empty":
        path.write_bytes(b"")
    elif how == "truncated":
        path.write_bytes(path.read_bytes()[:30])
    elif how == "mislabelled":
        path.write_bytes(b"%PDF-1.7 this is no sound")
    elif how == "silent":
        write_sound(path, lambda data, rate: (np.zeros_like(data), rate))
    elif how == "short":
        write_sound(path, lambda data, rate: (data[: 5 * rate], rate))
    elif how == "stereo_8_khz":
        write_sound(path, lambda data, rate: (np.column_stack([data, data])[::2], rate // 2))


def spoil_motion(path, how):
    lines = path.read_text().splitlines()
    first = lines.index("MOTION") + 3
    if how == "empty":
        path.write_text("")
    elif how == "truncated":
        path.write_text("\n".join(lines[: first + 9]))
    elif how == "mislabelled":
        path.write_bytes(bytes(range(256)))
    elif how == "nan":
        lines[first + 7] = "nan " + lines[first + 7].split(maxsplit=1)[1]
        path.write_text("\n".join(lines) + "\n")
    elif how == "joint":
        path.write_text(path.read_text().replace("left_forearm", "LeftElbow"))


ANNOTATIONS = {
    "unknown_label": ("0.0,1.0,dancing\n", "dancing"),
    "past_the_end": ("0.0,999.0,rest\n", "999"),
    "overlapping": ("0.0,2.0,rest\n1.0,3.0,left\n", "overlap"),
    "backwards": ("2.0,1.0,rest\n", "1.0"),
    "no_number": ("zero,1.0,rest\n", "zero"),
}

BAD = {
    **{f"wav_{how}": f"wav_{how}" for how in ("empty", "truncated", "mislabelled", "silent", "short")},
    **{f"bvh_{how}": f"bvh_{how}.bvh" for how in ("empty", "truncated", "mislabelled", "nan")},
    "bvh_joint": "left_forearm",
    **{f"csv_{how}": word for how, (_, word) in ANNOTATIONS.items()},
}
"""Every bad record, named by what is wrong with it, and a word that its message must hold."""


def configure(path, records, **sections):
    config = yaml.safe_load((ROOT / "config/test.yaml").read_text())
    config["run"] = "tried"
    config["corpus"] = {
        "source": "recorded", "name": "tried", "records": records,
        "motion": {"up": "y", "unit": "m", "joints": "cospeech", "zero": "hanging"},
    }  # fmt: skip
    config["phrases"]["gesture"]["first_examples"] = "rules"
    path.write_text(yaml.safe_dump(config | sections))
    return path


def made(records):
    """Return what the rooms corpus and speech make of some records."""
    kinds = ("corpus/annotations/{}.parquet", "speech/{}/prosody.parquet", "motion/{}.parquet")
    return [f"results/tried/{kind.format(record)}" for record in records for kind in kinds]


@pytest.fixture(scope="module")
def attempt(finished, tmp_path_factory):
    """A run on good and bad records of one actor: the project, what it said, and the configuration."""
    top = tmp_path_factory.mktemp("bad_input")
    raw = finished.folder / "results/test/corpus/raw"
    records = []
    for name in (*GOOD, *BAD):
        record = {"record": name, "actor": "somebody"}
        for field, suffix in (("motion", "bvh"), ("audio", "wav")):
            record[field] = str(top / f"{name}.{suffix}")
            shutil.copy(raw / f"ada_1.{suffix}", record[field])
        kind, _, how = name.partition("_")
        if kind in ("wav", "stereo"):
            spoil_sound(top / f"{name}.wav", how if kind == "wav" else name)
        elif kind == "bvh":
            spoil_motion(top / f"{name}.bvh", how)
        elif kind == "csv":
            record["annotations"] = str(top / f"{name}.csv")
            (top / f"{name}.csv").write_text("start_s,end_s,gesture\n" + ANNOTATIONS[how][0])
        records.append(record)
    project = Project(top / "project")
    project.folder.mkdir()
    config = configure(top / "config.yaml", records)
    return project, project.run(*made([*GOOD, *BAD]), config=config), config


def messages(said, about=""):
    """Return the distinct one-line messages that the user was shown, of those that name ``about``."""
    return {line for line in said.splitlines() if line.startswith("cospeech: ") and about in line}


def test_the_run_fails_without_a_traceback(attempt):
    _, ended, _ = attempt
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert len(messages(ended.stdout)) == len(BAD), ended.stdout[-3000:]


@pytest.mark.parametrize("record", BAD)
def test_each_bad_file_has_one_message_that_names_it(attempt, record):
    _, ended, _ = attempt
    told = messages(ended.stdout, record)
    assert len(told) == 1, told
    assert BAD[record] in next(iter(told))


def test_good_records_are_unharmed_and_bad_ones_leave_nothing_half_written(attempt):
    project, _, _ = attempt
    results = project.folder / "results/tried"
    assert [path for path in made(GOOD) if not (project.folder / path).is_file()] == []
    assert project.problems("tried") == []
    assert [path for path in results.rglob(".*") if path.is_file() and path.name != ".lock"] == []
    for record in BAD:
        assert not all((project.folder / path).is_file() for path in made([record])), record


def test_stereo_and_8_khz_are_handled_and_said(attempt):
    project, _, _ = attempt
    row = tables.read(project.folder / "results/tried/corpus/records/stereo_8_khz.parquet", "records").iloc[0]
    assert row["audio_rate_hz"] == 8000
    assert "channels" in row["note"]
    assert "8000" in row["note"]


def test_a_damaged_table_is_named_when_it_is_read(attempt):
    project, _, config = attempt
    path = project.folder / "results/tried/corpus/records/good_1.parquet"
    before, whole = path.stat(), path.read_bytes()
    path.write_bytes(whole[:40] + bytes([whole[40] ^ 1]) + whole[41:])
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    target = project.folder / "results/tried/corpus/annotations/good_1.parquet"
    target.unlink()
    ended = project.run(str(target.relative_to(project.folder)), config=config)
    path.write_bytes(whole)
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    (told,) = messages(ended.stdout)
    # Snakemake may have set the time of the table after its job ended; then the manifest tells that it was changed.
    assert re.search(r"records/good_1\.parquet: (damaged|changed since)", told)
    assert "run again" in told
    assert not target.exists()


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
    (project.folder / "results").mkdir(parents=True)
    small = project.folder / "results"
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(small)], check=False)
    if mounted.returncode:
        pytest.skip("this machine does not let root mount a tmpfs")
    try:
        ended = project.run("results/test/speech/ada_1/prosody.parquet")
        assert ended.returncode != 0
        assert any("the disk is full" in line for line in messages(ended.stdout)), ended.stdout[-3000:]
        assert "Traceback" not in ended.stdout
        assert project.problems() == []
    finally:
        subprocess.run(["umount", "-l", str(small)], check=True)
