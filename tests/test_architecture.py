"""The import rules of the package: what may import what."""

import ast

import pytest

from cospeech.kernels import code_hash

PACKAGE = code_hash.PACKAGE
ROOT = PACKAGE.parents[1]

ROOMS = {
    "studio", "corpus", "capture", "speech", "segmentation",
    "synthesis", "identity", "rendering", "evaluation", "report",
}  # fmt: skip
FOUNDATIONS = {"data", "formats", "geometry", "motion", "metrics", "markov", "kernels", "workflow", "errors"}
ENTRY_POINTS = {"api", "cli"}
"""Modules that may import several rooms, as scripts may."""

MODULES = sorted(PACKAGE.rglob("*.py"))
SYNTHESIS = sorted((PACKAGE / "synthesis").rglob("*.py"))
SCRIPTS = sorted((ROOT / "scripts").rglob("*.py"))


def part(path):
    """The room, foundation or entry point that a file of the package belongs to; None for the package itself."""
    name = path.relative_to(PACKAGE).with_suffix("").parts[0]
    return None if name == "__init__" else name


def system(path):
    """The sub-package of synthesis that a file belongs to; None for the modules directly under synthesis."""
    inside = path.relative_to(PACKAGE / "synthesis").parts
    return inside[0] if len(inside) > 1 else None


def imported(path):
    """The rooms, foundations and entry points that a file imports, wherever in the file."""
    return {part(file) for file in code_hash.imports(path)} - {None}


def name(path):
    return path.relative_to(ROOT).as_posix()


def test_every_part_of_the_package_is_a_room_a_foundation_or_an_entry_point():
    assert {part(path) for path in MODULES} - {None} <= ROOMS | FOUNDATIONS | ENTRY_POINTS


@pytest.mark.parametrize("path", [path for path in MODULES if part(path) not in ENTRY_POINTS], ids=name)
def test_no_room_imports_another_and_no_foundation_a_room(path):
    own = {part(path)} & ROOMS
    assert imported(path) <= FOUNDATIONS | own


@pytest.mark.parametrize("path", SYNTHESIS, ids=name)
def test_systems_import_the_interface_and_not_one_another(path):
    others = [file for file in code_hash.imports(path) if part(file) == "synthesis"]
    assert {system(file) for file in others} <= {None, system(path)}


@pytest.mark.parametrize("path", SCRIPTS, ids=name)
def test_scripts_import_rooms_foundations_and_the_api(path):
    assert imported(path) <= ROOMS | FOUNDATIONS | {"api"}


@pytest.mark.parametrize("path", MODULES + SCRIPTS, ids=name)
def test_imports_are_absolute(path):
    """Relative imports would escape these rules, and the code hashes."""
    lines = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    assert not [line.lineno for line in lines if isinstance(line, ast.ImportFrom) and line.level]
