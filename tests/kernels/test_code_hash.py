"""An edit changes the hash of exactly those scripts that depend on the edited module."""

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cospeech.kernels import code_hash

SCRIPTS = code_hash.PACKAGE.parents[1] / "scripts"


def names(script):
    return {path.relative_to(code_hash.PACKAGE).as_posix() for path in code_hash.closure(script) if path != script}


def test_closure_follows_imports_through_modules(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from cospeech.data import tables\nimport numpy\n")
    assert names(script) == {
        "__init__.py",
        "data/__init__.py",
        "data/project.py",
        "data/tables.py",
        "errors.py",
        "kernels/__init__.py",
        "kernels/code_hash.py",
        "kernels/numba_cache.py",
    }


def test_closure_sees_every_way_to_import(tmp_path):
    script = tmp_path / "script.py"
    for line in (
        "import cospeech.data.segments",
        "from cospeech.data import segments as s",
        "from cospeech.data.segments import from_labels",
        "def f():\n    from cospeech.data import segments",
    ):
        script.write_text(line + "\n")
        assert "data/segments.py" in names(script), line


LOADED = """
import json, os, sys
import numba, numpy, pandas, pyarrow.parquet, scipy  # once for all scripts

for script, imports in json.load(sys.stdin).items():
    if os.fork() == 0:
        exec(imports, {})
        print(script, *[m.__file__ for n, m in sys.modules.items() if n.split(".")[0] == "cospeech"], flush=True)
        os._exit(0)
    assert os.wait()[1] == 0, script
"""


def test_closure_contains_what_python_really_loads():
    """The static closure of every script covers the modules that its imports load."""
    imports = {
        str(script): "\n".join(
            ast.unparse(line)
            for line in ast.parse(script.read_text()).body
            if isinstance(line, ast.ImportFrom) and str(line.module).startswith("cospeech")
        )
        for script in sorted(SCRIPTS.rglob("*.py"))
    }
    listed = subprocess.run(
        [sys.executable, "-c", LOADED], input=json.dumps(imports), capture_output=True, text=True, check=True
    )
    loaded = {script: set(files) for script, *files in map(str.split, listed.stdout.splitlines())}
    assert loaded.keys() == imports.keys()
    for script, files in loaded.items():
        assert files <= {str(path) for path in code_hash.closure(Path(script))}, script


@pytest.fixture
def package(tmp_path, monkeypatch):
    copy = tmp_path / "cospeech"
    shutil.copytree(code_hash.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(code_hash, "PACKAGE", copy)
    return copy


def test_hash_changes_with_what_a_script_depends_on_and_with_nothing_else(package, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from cospeech.data import tables\n")
    before = code_hash.code_hash(script)
    (package / "data/segments.py").write_text("# not imported by the script\n")
    code_hash._mentions.cache_clear()
    assert code_hash.code_hash(script) == before
    (package / "errors.py").write_text((package / "errors.py").read_text() + "# edited\n")
    code_hash._mentions.cache_clear()
    assert code_hash.code_hash(script) != before


def test_hash_changes_with_the_schemas_that_a_script_names_and_with_no_other(tmp_path, monkeypatch):
    folder = tmp_path / "data_schema"
    shutil.copytree(code_hash.SCHEMAS, folder)
    monkeypatch.setattr(code_hash, "SCHEMAS", folder)
    code_hash._known_schemas.cache_clear()
    code_hash._mentions.cache_clear()
    script = tmp_path / "script.py"
    script.write_text("from cospeech.data import tables\ntables.read('a.parquet', 'units')\n")
    before = code_hash.code_hash(script)
    for name, same in (("motion", True), ("config", True), ("units", False)):
        with (folder / f"{name}.yaml").open("a") as file:
            file.write("# edited\n")
        assert (code_hash.code_hash(script) == before) is same, name
    code_hash._known_schemas.cache_clear()
    code_hash._mentions.cache_clear()


def test_schemas_of_scripts_are_those_that_they_read_and_write():
    def named(script):
        return {path.stem for path in code_hash.schemas(code_hash.closure(SCRIPTS / script))}

    read_and_written = {"motion", "segments", "prosody", "syllables", "offsets", "records"}
    of_heads = {"head", "head_pose", "melody", "pitch"}
    of_libraries = {"body", "poses"}  # named by a module that the BVH reader needs for poses of any body
    assert named("corpus/record.py") == read_and_written | of_heads | of_libraries
    of_bodies = {"head", "lips"}  # a joint and a material are called like schemas
    assert named("rendering/video.py") == {"motion", "segments"} | of_bodies
    model = code_hash.closure(code_hash.PACKAGE / "synthesis" / "hsmm" / "weighted.py")
    assert {"initial", "transitions", "emissions", "durations"} <= {path.stem for path in code_hash.schemas(model)}
