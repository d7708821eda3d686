"""What is compiled is never older than the code, wherever that changed."""

import os
import shutil
import subprocess
import sys

import pytest

from cospeech import compiled

CALLER = """
import numba
from cospeech.other import {names}

@numba.njit(cache=True)
def twice():
    return 2 * {value}
"""
OTHER = """
import numba
FACTOR = {number}

@numba.njit(cache=True)
def one():
    return {number}
"""


def write(package, number, value="one()"):
    package.mkdir(exist_ok=True)
    for name in ("__init__.py", "compiled.py"):
        shutil.copy(compiled.PACKAGE / name, package / name)
    (package / "caller.py").write_text(CALLER.format(names=value.rstrip("()"), value=value))
    (package / "other.py").write_text(OTHER.format(number=number))
    (package / "apart.py").write_text("VALUE = 1\n")


def call(package, **environment):
    """What the compiled ``twice`` returns in a process of its own."""
    known = {name: value for name, value in os.environ.items() if name != compiled.FOLDER}
    ended = subprocess.run(
        [sys.executable, "-c", "from cospeech import caller; print(caller.twice())"],
        env=known | {"PYTHONPATH": str(package.parent)} | environment, cwd=package.parent,
        text=True, check=True, stdout=subprocess.PIPE,
    )  # fmt: skip
    return int(ended.stdout)


@pytest.mark.parametrize("value", ["one()", "FACTOR"])
def test_a_kernel_or_constant_that_changed_elsewhere_is_compiled_anew(tmp_path, value):
    package, kept = tmp_path / "cospeech", str(tmp_path / "kept")
    write(package, 1, value)
    assert (call(package), call(package, NUMBA_CACHE_DIR=kept)) == (2, 2)
    write(package, 5, value)
    assert call(package) == 10
    assert call(package, NUMBA_CACHE_DIR=kept) == 2  # so numba alone would not see it


def test_folders_of_older_code_go_and_other_code_does_not_count(tmp_path, monkeypatch):
    package = tmp_path / "cospeech"
    write(package, 1)
    before = compiled.state(package)
    (package / "apart.py").write_text("VALUE = 2\n")
    assert compiled.state(package) == before
    old = package / "__pycache__" / "compiled-0"
    old.mkdir(parents=True)
    monkeypatch.setenv(compiled.FOLDER, "mine")
    compiled.keep_apart(package)
    assert os.environ[compiled.FOLDER] == "mine"
    assert old.is_dir()
    monkeypatch.delenv(compiled.FOLDER)
    compiled.keep_apart(package)
    assert os.environ[compiled.FOLDER] == str(package / "__pycache__" / f"compiled-{before}")
    assert not old.exists()
