"""The manifest lists what a run wrote; verification names what is no longer so, and the next run mends it."""

import os
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from cospeech.errors import UserError
from cospeech.workflow import manifest, receipts

RESULTS = Path("results/tiny")
FOLDERS = [RESULTS, Path("reports/tiny")]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def written(path, content="content"):
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_text(content)
    return str(path)


def job(rule, *paths, **wildcards):
    """A job that wrote these files."""
    place = receipts.place(RESULTS, rule, wildcards)
    receipts.begin(place)
    receipts.save(place, rule, wildcards, "abc", [written(path) for path in paths])
    return place


def problems():
    known = receipts.load(RESULTS)
    return manifest.problems(FOLDERS, known, [receipt for receipt in known if receipt.rule != "removed"])


def test_a_receipt_lists_the_files_of_a_job_and_of_its_folders():
    model = [written(RESULTS / f"models/ada/{name}.bin") for name in "ab"]
    place = receipts.place(RESULTS, "model", {"system": "hsmm", "actor": "ada"})
    receipts.save(place, "model", {"actor": "ada", "system": "hsmm"}, "abc", [str(RESULTS / "models/ada")])
    assert place == RESULTS / "run/receipts/model/ada/hsmm.json"
    (receipt,) = receipts.load(RESULTS)
    assert (receipt.rule, receipt.wildcards, receipt.config_hash) == (
        "model",
        {"actor": "ada", "system": "hsmm"},
        "abc",
    )
    assert receipt.output == str(RESULTS / "models/ada")
    assert [artifact.path for artifact in receipt.artifacts] == model
    assert receipt.artifacts[0].bytes == 7
    # printf content | sha256sum
    assert receipt.artifacts[0].sha256 == "ed7002b439e9ac845f22357d822bac1444730fbdb6016d3ec9432297b9ec9f73"


def test_nothing_is_wrong_with_a_run_that_nobody_touched():
    job("record", RESULTS / "motion/ada_1.bvh", record="ada_1")
    written(RESULTS / "logs/record/ada_1.log")
    written(RESULTS / ".lock", "")
    assert problems() == []


def test_every_kind_of_problem_is_named():
    job("changed", RESULTS / "changed.parquet")
    job("missing", RESULTS / "missing.mp4")
    job("removed", RESULTS / "removed.wav")
    job("page", "reports/tiny/index.html")
    job("narrower", RESULTS / "once.csv", RESULTS / "kept.csv")
    job("narrower", RESULTS / "kept.csv")
    receipts.begin(job("killed", RESULTS / "killed.csv"))
    written(RESULTS / "changed.parquet", "contenT")
    (RESULTS / "missing.mp4").unlink()
    written("reports/tiny/notes.txt")
    Path("reports/tiny/link").symlink_to("/nowhere")
    assert dict(line.split(": ") for line in problems()) == {
        "reports/tiny/link": manifest.FOREIGN,
        "reports/tiny/notes.txt": manifest.FOREIGN,
        "results/tiny/changed.parquet": manifest.CHANGED,
        "results/tiny/killed.csv": manifest.UNFINISHED,
        "results/tiny/missing.mp4": manifest.MISSING,
        "results/tiny/once.csv": manifest.LEFT_OVER,
        "results/tiny/removed.wav": manifest.LEFT_OVER,
    }


def test_one_flipped_bit_is_found_whatever_the_time_of_the_file():
    job("record", RESULTS / "motion/ada_1.bvh", record="ada_1")
    path = RESULTS / "motion/ada_1.bvh"
    before = path.stat()
    path.write_bytes(b"bontent")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert problems() == [f"{path}: {manifest.CHANGED}"]


def test_the_quick_look_reads_only_files_of_another_size_or_a_later_time():
    place = job("record", RESULTS / "a", RESULTS / "b", RESULTS / "c", RESULTS / "d")
    for name, content in {"a": "longer content", "b": "contenT", "c": "content", "d": "contenT"}.items():
        written(RESULTS / name, content)
        moment = place.stat().st_mtime_ns + (-1 if name == "d" else 1)
        os.utime(RESULTS / name, ns=(moment, moment))
    (receipt,) = receipts.load(RESULTS)
    assert receipts.changed(receipt, thoroughly=False) == [str(RESULTS / "a"), str(RESULTS / "b")]
    assert receipts.changed(receipt, thoroughly=True) == [str(RESULTS / "a"), str(RESULTS / "b"), str(RESULTS / "d")]


def test_a_file_that_returns_is_not_left_over():
    job("narrower", RESULTS / "once.csv", RESULTS / "kept.csv")
    job("narrower", RESULTS / "kept.csv")
    job("narrower", RESULTS / "once.csv", RESULTS / "kept.csv")
    assert problems() == []


def test_a_damaged_receipt_is_named():
    place = job("record", RESULTS / "a")
    place.write_text(place.read_text()[:40])
    with pytest.raises(UserError, match=r"receipts/record\.json: damaged .* run again"):
        receipts.load(RESULTS)


def test_the_manifest_has_one_row_per_file():
    job("record", RESULTS / "b", RESULTS / "a", record="ada_1")
    receipts.begin(job("killed", RESULTS / "c"))
    manifest.write_table(RESULTS, receipts.load(RESULTS), corpus="virtual", config_hash="def")
    table = pq.read_table(RESULTS / "run/manifest.parquet").to_pandas()
    assert table["path"].tolist() == ["results/tiny/a", "results/tiny/b"]
    assert table.loc[0, ["bytes", "rule", "config_hash"]].tolist() == [7, "record", "abc"]


@pytest.mark.workflow
@pytest.mark.xdist_group("workflow")
def test_what_is_deleted_returns_and_what_is_changed_stops_the_run(copy):
    """On a finished run of the test configuration."""
    table = pq.read_table(copy.folder / "results/test/run/manifest.parquet").to_pandas().set_index("path")
    figure, model = "reports/test/figures/fig-7.3.svg", "initial.parquet"
    read_by_no_rule = next(path for path in table.index if path.endswith(model) and "/synthesis/" in path)
    assert {"reports/test/index.html", figure, "results/test/corpus/raw/ada_1.wav"} <= set(table.index)
    assert table.loc[figure, "rule"] in {"exhibits", "score_exhibits"}

    (copy.folder / figure).unlink()
    assert table.loc[figure, "rule"] in copy.planned()
    (copy.folder / read_by_no_rule).unlink()
    assert "systems" in copy.planned()
    assert copy.planned("verify") == {"verify"}

    video = copy.folder / "results/test/animation/ada_1/comparison.mp4"
    content = bytearray(video.read_bytes())
    content[-1] ^= 1
    video.write_bytes(content)
    ended = copy.run()
    assert ended.returncode != 0
    assert "comparison.mp4: changed since the run wrote it; delete it and run again" in ended.stdout
    for _ in range(2):  # Snakemake must not take a verification for done
        ended = copy.run("verify")
        assert ended.returncode != 0
        said = {line.removeprefix("cospeech: ") for line in ended.stdout.splitlines() if "again" in line}
        assert said >= {
            f"{figure}: {manifest.MISSING}",
            f"{read_by_no_rule}: {manifest.MISSING}",
            f"results/test/animation/ada_1/comparison.mp4: {manifest.CHANGED}",
        }
