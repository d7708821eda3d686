"""Which modules and table schemas a script depends on, and the hash of their text.

Snakemake notices a changed script, but not a change in a module that the script imports, or in the schema of a table
that it reads or writes. Each rule therefore has the hash of its script, of all modules that it imports and of the
schemas that these name as a parameter, so that an edit reruns what depends on it and nothing else. Imports and the
names of schemas are read from the text, without running any module.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from cospeech.data import project

PACKAGE = Path(__file__).parents[1]
SCHEMAS = project.root() / "data_schema"


def closure(script: Path) -> tuple[Path, ...]:
    """Return ``script`` and every module of the package that it imports, directly or indirectly, sorted."""
    found: set[Path] = set()
    open_paths = [script]
    while open_paths:
        path = open_paths.pop()
        if path not in found:
            found.add(path)
            open_paths.extend(imports(path))
    return tuple(sorted(found))


def schemas(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the schemas that the text of some files names, sorted."""
    return tuple(sorted({schema for path in paths for schema in _mentions(path).schemas}))


def code_hash(script: Path) -> str:
    """Return the hash of the text of all files in the closure of ``script``, and of the schemas that these name.

    It does not depend on absolute paths.
    """
    known = closure(script)
    return _hash([*known, *schemas(known)])


def modules_hash(modules: Sequence[str]) -> str:
    """Return the hash of modules that a script imports by name only when it runs, and of all that they import.

    Of a module of another package, every file of its package counts.
    """
    paths: list[Path] = []
    for name in sorted(set(modules)):
        top = name.split(".")[0]
        for path in _module(name) if top == PACKAGE.name else _package_files(top):
            known = closure(path) if path.suffix == ".py" and top == PACKAGE.name else (path,)
            paths += [*known, *schemas(one for one in known if one.suffix == ".py")]
    return _hash(paths)


def _hash(paths: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _package_files(name: str) -> tuple[Path, ...]:
    """Return the files of another package, or the one file of a single module; none where it is not installed."""
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        return ()
    if spec.submodule_search_locations is None:
        return (Path(spec.origin),)
    files = (path for folder in spec.submodule_search_locations for path in Path(folder).rglob("*"))
    return tuple(sorted(path for path in files if path.is_file() and "__pycache__" not in path.parts))


class _Mentions(NamedTuple):
    """The files that the text of a module names: modules that it imports, and schemas."""

    imports: tuple[Path, ...]
    schemas: tuple[Path, ...]


def imports(path: Path) -> tuple[Path, ...]:
    """Return the files of the package that the imports of ``path`` read, anywhere in it, sorted."""
    return _mentions(path).imports


@functools.cache
def _mentions(path: Path) -> _Mentions:
    names: set[str] = set()
    found: set[Path] = set()
    known = _known_schemas()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names.add(node.module)
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in known:
            found.add(known[node.value])
    modules = {file for name in names for file in _module(name)}
    return _Mentions(tuple(sorted(modules)), tuple(sorted(found)))


@functools.cache
def _known_schemas() -> dict[str, Path]:
    """Return the schemas of tables by name; that of the configuration is not one of them."""
    return {path.stem: path for path in SCHEMAS.glob("*.yaml") if path.stem != "config"}


def _module(name: str) -> tuple[Path, ...]:
    """Return the files of the package that importing ``name`` reads: the module and its parent packages."""
    parts = name.split(".")
    if parts[0] != PACKAGE.name:
        return ()
    files = []
    folder = PACKAGE
    for part in parts[1:]:
        files.append(folder / "__init__.py")
        folder = folder / part
    files.extend([folder.with_suffix(".py"), folder / "__init__.py"])
    return tuple(file for file in files if file.is_file())
