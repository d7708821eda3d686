"""Compiled code is never older than its source, wherever that has changed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cospeech.kernels import code_hash, numba_cache

CALLER = """
from cospeech.kernels.jit import njit
from cospeech.other import {names}

@njit
def twice():
    return 2 * {value}
"""
OTHER = """
from cospeech.kernels.jit import njit
FACTOR = {number}

@njit
def one():
    return {number}
"""


def write(package, number, value="one()"):
    (package / "kernels").mkdir(parents=True, exist_ok=True)
    (package / "data").mkdir(exist_ok=True)
    kernels = ("__init__", "code_hash", "jit", "numba_cache")
    modules = ("__init__", "data/__init__", "data/project", *(f"kernels/{module}" for module in kernels))
    for name in (f"{module}.py" for module in modules):
        shutil.copy(code_hash.PACKAGE / name, package / name)
    (package / "caller.py").write_text(CALLER.format(names=value.rstrip("()"), value=value))
    (package / "other.py").write_text(OTHER.format(number=number))
    (package / "apart.py").write_text("VALUE = 1\n")


def output(package, program, **environment):
    """The output of a program that uses the package, in a process of its own."""
    known = {name: value for name, value in os.environ.items() if name != numba_cache.FOLDER}
    return subprocess.run(
        [sys.executable, "-c", program],
        env=known | {"PYTHONPATH": str(package.parent)} | environment, cwd=package.parent,
        text=True, check=True, stdout=subprocess.PIPE,
    ).stdout.strip()  # fmt: skip


@pytest.mark.parametrize("value", ["one()", "FACTOR"])
def test_a_kernel_or_constant_that_changed_elsewhere_is_compiled_again(tmp_path, value):
    package, kept = tmp_path / "cospeech", str(tmp_path / "kept")
    twice = "from cospeech import caller; print(caller.twice())"
    write(package, 1, value)
    assert (output(package, twice), output(package, twice, NUMBA_CACHE_DIR=kept)) == ("2", "2")
    write(package, 5, value)
    assert output(package, twice) == "10"
    assert output(package, twice, NUMBA_CACHE_DIR=kept) == "2"  # numba alone would not notice


def test_folders_of_older_code_go_and_other_code_does_not_count(tmp_path):
    package = tmp_path / "cospeech"
    folder = "import os, cospeech; print(os.environ['NUMBA_CACHE_DIR'])"
    write(package, 1)
    old = package / "__pycache__" / "compiled-0"
    old.mkdir(parents=True)
    assert output(package, folder, NUMBA_CACHE_DIR="mine") == "mine"
    assert old.is_dir()
    before = output(package, folder)
    assert before.startswith(str(package / "__pycache__" / "compiled-"))
    assert not old.exists()
    (package / "apart.py").write_text("VALUE = 2\n")
    assert output(package, folder) == before
    write(package, 2)
    assert output(package, folder) != before


def test_a_read_only_package_keeps_its_kernels_in_the_users_cache(tmp_path):
    package, cache = tmp_path / "cospeech", tmp_path / "cache"
    write(package, 1)
    (package / "__pycache__").touch()  # a file in place of the folder: unlike permissions, it stops even root
    twice = "import os; from cospeech import caller; print(caller.twice(), os.environ['NUMBA_CACHE_DIR'])"
    value, folder = output(package, twice, XDG_CACHE_HOME=str(cache)).split()
    assert value == "2"
    assert list(cache.glob("cospeech/*/compiled-*")) == [Path(folder)]
    assert {path.suffix for path in Path(folder).rglob("*") if path.is_file()} == {".nbi", ".nbc"}
    write(package, 5)
    assert output(package, twice, XDG_CACHE_HOME=str(cache)).split()[0] == "10"
    assert not Path(folder).exists()


def test_a_kernel_does_not_load_linear_algebra_and_does_not_hide_it(tmp_path):
    package = tmp_path / "cospeech"
    write(package, 1)
    loaded = "print(sorted({'scipy.linalg', 'scipy.linalg.cython_blas', 'cffi'} & set(sys.modules)))"
    call = f"import sys; from cospeech import caller; caller.twice(); {loaded}"
    assert output(package, call) == output(package, call) == "[]"
    after = (
        "from cospeech import caller; caller.twice(); from scipy.linalg import solve; print(solve([[2.0]], [4.0])[0])"
    )
    assert output(package, after) == "2.0"
    product = "import numpy as np; print(njit(lambda a, b: a @ b, cache=False)(np.eye(2), 3.0 * np.eye(2))[1, 1])"
    assert output(package, f"from cospeech.kernels.jit import njit; {product}") == "3.0"
