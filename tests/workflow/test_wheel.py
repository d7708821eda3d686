"""The wheel holds the whole workflow, which runs from an installation away from the repository."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile

import pytest
import yaml
from project import ROOT

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("wheel")]

FOLDERS = ("profiles", "workflow/rules", "scripts", "config", "data_schema", "reports/template")
"""Folders of the repository that are installed as ``cospeech/project/...``."""


def files(folder):
    """Return the size and time of every file below ``folder``, by relative path, without compiled modules."""
    found = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(folder).as_posix(): (path.stat().st_size, path.stat().st_mtime_ns) for path in found}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel of this checkout, built without a network."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A virtual environment with the wheel, in which only its dependencies are those of this environment.

    A path file adds their folder behind the environment's own. Path files in that folder are not read, so this
    checkout stays out of sight.
    """
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check", "install"]
    subprocess.run([*pip, "--no-index", "--no-deps", str(wheel)], check=True, capture_output=True)
    packages = next(folder.glob("lib/python*/site-packages"))
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder


@pytest.fixture
def cospeech(installed, tmp_path):
    """The installed command, run in an empty folder; it returns what the command printed."""

    def run(*arguments):
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "NUMBA_CACHE_DIR")}
        ended = subprocess.run(
            [str(installed / "bin" / "cospeech"), *arguments], cwd=tmp_path, env=environment,
            text=True, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert ended.returncode == 0, ended.stdout[-4000:]
        return ended.stdout

    return run


def test_the_wheel_holds_the_workflow_and_nothing_beyond_it(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert len(set(names)) == len(names)
    inside = "cospeech/project/"
    workflow = {name.removeprefix(inside) for name in names if name.startswith(inside)}
    assert workflow == {"Snakefile"} | {f"{folder}/{name}" for folder in FOLDERS for name in files(ROOT / folder)}
    modules = {name for name in names if not name.startswith((inside, "cospeech-"))}
    assert modules == set(files(ROOT / "src"))
    assert "cospeech/py.typed" in modules


def test_the_workflow_runs_from_an_empty_folder_and_leaves_the_installation_alone(installed, cospeech, tmp_path):
    package = next(installed.glob("lib/python*/site-packages/cospeech"))
    before = files(package)
    help_text = cospeech("report", "--help")
    assert str(package / "project" / "config") in help_text
    settings = yaml.safe_load((ROOT / "config" / "test.yaml").read_text()) | {"run": "mine"}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(settings))
    planned = cospeech("report", "--config", "mine.yaml", "--dry-run")
    assert f"profile {package / 'project' / 'profiles' / 'default'}" in planned
    assert "reports/mine/index.html" in planned
    table = "results/mine/corpus/truth/annotations.parquet"
    said = cospeech("run", table, "--config", "mine.yaml", "--cores", "1")
    assert "[1/1, " in said  # by the logger of this package
    assert (tmp_path / table).is_file()
    cospeech("verify", "--config", "mine.yaml", "--cores", "1")
    assert {path.name for path in tmp_path.iterdir()} == {"mine.yaml", "results", "reports", ".snakemake"}
    assert files(package) == before


def test_the_bundled_model_in_the_wheel_is_small_and_moves_to_new_speech(wheel, cospeech, recordings, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        packed = [entry for entry in archive.infolist() if entry.filename.startswith("cospeech/bundled_model/")]
    assert sum(entry.compress_size for entry in packed) < 2_000_000
    shutil.copy(recordings / "speech.wav", tmp_path)
    said = cospeech("synthesize", "speech.wav", "--format", "bvh", "--out", "motion")
    assert "motion/speech.bvh\n" in said
    assert (tmp_path / "motion" / "speech.bvh").read_text().count("\n") > 250
