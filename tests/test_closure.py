"""An edit changes the hash of just the scripts that rest on the edited module."""

import ast
import shutil
import subprocess
import sys

import pytest

from cospeech import closure

SCRIPTS = closure.PACKAGE.parents[1] / "scripts"


def names(script):
    return {path.relative_to(closure.PACKAGE).as_posix() for path in closure.closure(script) if path != script}


def test_closure_follows_imports_through_modules(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from cospeech import tables\nimport numpy\n")
    assert names(script) == {"__init__.py", "closure.py", "compiled.py", "tables.py", "errors.py"}


def test_closure_sees_every_way_to_import(tmp_path):
    script = tmp_path / "script.py"
    for line in (
        "import cospeech.segments",
        "from cospeech import segments as s",
        "from cospeech.segments import from_labels",
        "def f():\n    from cospeech import segments",
    ):
        script.write_text(line + "\n")
        assert "segments.py" in names(script), line


def test_closure_holds_what_python_really_loads():
    """The static closure of every script covers the modules that importing its imports loads."""
    for script in sorted(SCRIPTS.rglob("*.py")):
        imports = "\n".join(
            ast.unparse(line)
            for line in ast.parse(script.read_text()).body
            if isinstance(line, ast.ImportFrom) and str(line.module).startswith("cospeech")
        )
        listing = "import sys; print(*[m.__file__ for n, m in sys.modules.items() if n.split('.')[0] == 'cospeech'])"
        program = f"{imports}\n{listing}"
        loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
        assert set(loaded.stdout.split()) <= {str(path) for path in closure.closure(script)}, script


@pytest.fixture
def package(tmp_path, monkeypatch):
    copy = tmp_path / "cospeech"
    shutil.copytree(closure.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(closure, "PACKAGE", copy)
    return copy


def test_hash_changes_with_what_it_rests_on_and_with_nothing_else(package, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from cospeech import tables\n")
    before = closure.code_hash(script)
    (package / "segments.py").write_text("# not imported by the script\n")
    closure._imports.cache_clear()
    assert closure.code_hash(script) == before
    (package / "errors.py").write_text((package / "errors.py").read_text() + "# edited\n")
    closure._imports.cache_clear()
    assert closure.code_hash(script) != before
