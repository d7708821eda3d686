"""The import rules of the package: what may import what, and the drawing that shows what does."""

import ast
from graphlib import CycleError

import draw_package
import pytest
from draw_package import part

from cospeech.kernels import code_hash

PACKAGE = code_hash.PACKAGE
ROOT = PACKAGE.parents[1]

ROOMS, FOUNDATIONS = set(draw_package.ROOMS), set(draw_package.FOUNDATIONS)
ENTRY_POINTS = set(draw_package.ENTRY_POINTS) - {"scripts"}

MODULES = sorted(PACKAGE.rglob("*.py"))
SYNTHESIS = sorted((PACKAGE / "synthesis").rglob("*.py"))
SCRIPTS = sorted((ROOT / "scripts").rglob("*.py"))


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
def test_scripts_import_rooms_foundations_the_api_and_the_viewer(path):
    assert imported(path) <= ROOMS | FOUNDATIONS | {"api", "viewer"}


@pytest.mark.parametrize("path", MODULES + SCRIPTS, ids=name)
def test_imports_are_absolute(path):
    """Relative imports would escape these rules, and the code hashes."""
    lines = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    assert not [line.lineno for line in lines if isinstance(line, ast.ImportFrom) and line.level]


def test_foundations_do_not_import_one_another_in_a_circle():
    draw_package.by_level(FOUNDATIONS, draw_package.read_imports())


def test_the_drawing_of_the_package_is_up_to_date():
    drawn = draw_package.draw(draw_package.read_imports())
    assert draw_package.DRAWING.read_text(encoding="utf-8") == drawn, "run python docs/draw_package.py"


def test_the_drawing_shows_each_import_as_one_arrow():
    imports = {"scripts": {"studio", "data"}, "studio": {"data"}, "data": set(), "errors": set()}
    drawn = draw_package.draw({name: frozenset(found) for name, found in imports.items()})
    assert drawn.count("l-4.5 -8h9z") == 3
    assert [drawn.count(f">{name}<") for name in (*imports, "corpus")] == [1, 1, 1, 1, 0]
    with pytest.raises(CycleError):
        draw_package.by_level({"data", "errors"}, {"data": {"errors"}, "errors": {"data"}})


def test_no_system_is_named_outside_synthesis():
    from cospeech.synthesis import controls, hsmm

    names = {system.name for system in (*controls.SYSTEMS, *hsmm.SYSTEMS)}
    rules = [ROOT / "Snakefile", *sorted((ROOT / "workflow").rglob("*.smk"))]
    found = []
    for path in [path for path in MODULES if part(path) != "synthesis"] + SCRIPTS:
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        found += [
            f"{name(path)}:{node.lineno} {node.value}"
            for node in nodes
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in names
        ]
    for path in rules:
        text = path.read_text(encoding="utf-8")
        found += [f"{name(path)} {word}" for word in names if f'"{word}"' in text or f"'{word}'" in text]
    assert found == []
