"""Change the methods in one place at a time and see whether a test notices.

As a script, by hand: ``python tests/mutation.py [--share 0.1] [part or module ...]``. Each mutant is one change of
one expression: a comparison, an operator, a number, a function such as ``min`` for ``max``. It runs the tests of
its part of the package and, if these pass, those of the parts that use it. Survivors are listed: each needs a test,
or a reason (CONTRIBUTING.md).
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "cospeech"
LIMIT_S = 300

USED_BY = {
    "data": ["formats", "corpus", "speech"],
    "geometry": ["capture/tracking/test_tracking.py", "capture/calibration"],
    "markov": ["segmentation", "synthesis"],
    "metrics": ["evaluation"],
    "motion": ["rendering", "corpus", "synthesis"],
    "evaluation": ["report"],
    "segmentation": ["synthesis"],
    "synthesis": ["test_api.py", "test_cli_synthesize.py"],
}
"""The parts of the package that are mutated, and the tests that follow those of the part itself."""

OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv, ast.Pow: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip

NAMES = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax", "argmax": "argmin",
    "any": "all", "all": "any", "floor": "ceil", "ceil": "floor", "sum": "mean", "mean": "sum", "median": "mean",
    "sin": "cos", "cos": "sin", "zeros": "ones", "ones": "zeros", "std": "var", "var": "std", "exp": "log1p",
    "left": "right", "round": "floor",
}  # fmt: skip


class Mutant(NamedTuple):
    """One change of one file: place, text before and after, and the whole file with it."""

    path: Path
    line: int
    before: str
    after: str
    source: str

    def __str__(self) -> str:
        return f"{self.path.relative_to(PACKAGE)}:{self.line}: {self.before} -> {self.after}"


def mutants(path: Path) -> Iterator[Mutant]:
    """Return all mutants of a file in the order of their places."""
    text = path.read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in _expressions(ast.parse(text)):
        first = starts[node.lineno - 1] + node.col_offset
        last = starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        for changed in _changes(node):
            after = ast.unparse(changed)
            source = text[:first] + f"({after})".encode() + text[last:]
            yield Mutant(path, node.lineno, ast.unparse(node), after, source.decode())


def _expressions(tree: ast.AST) -> Iterator[ast.expr]:
    """Return the expressions that a method computes with: no annotations, decorators, messages and exceptions."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list") or isinstance(value, ast.JoinedStr):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, (ast.Raise, ast.Assert, ast.JoinedStr)):
                if isinstance(child, ast.expr):
                    yield child
                yield from _expressions(child)


def _changes(node: ast.expr) -> Iterator[ast.expr]:
    changed = copy.deepcopy(node)
    match changed:
        case ast.Compare(ops=[operator]) if type(operator) in OPERATORS:
            changed.ops = [OPERATORS[type(operator)]()]
        case ast.BinOp(op=operator) | ast.BoolOp(op=operator) if type(operator) in OPERATORS:
            changed.op = OPERATORS[type(operator)]()
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            changed = changed.operand
        case ast.Constant(value=bool(value)):
            changed.value = not value
        case ast.Constant(value=int(value)):
            changed.value = value + 1
        case ast.Constant(value=float(value)):
            changed.value = value * 1.5 or 1.0
        case ast.Call(func=ast.Name(id=name)) if name in NAMES:
            changed.func = ast.Name(NAMES[name])
        case ast.Call(func=ast.Attribute(attr=name) as function) if name in NAMES:
            function.attr = NAMES[name]
        case _:
            return
    yield changed


def chosen(names: list[str], share: float) -> list[Mutant]:
    """Return a share of the mutants of some parts or modules, drawn evenly from each file, always the same ones."""
    found = []
    for name in names:
        top = PACKAGE / name
        for path in sorted(top.rglob("*.py")) if top.is_dir() else [top.with_suffix(".py")]:
            possible = list(mutants(path))
            drawn = random.Random(str(path.relative_to(PACKAGE))).sample(possible, round(share * len(possible)))
            found += sorted(drawn, key=lambda mutant: mutant.line)
    return found


def tests_of(mutant: Mutant) -> tuple[list[str], list[str]]:
    """Return the tests of a mutant's part of the package, its own first, and those of the parts that use it."""
    part, *_ = mutant.path.relative_to(PACKAGE).parts
    folder = ROOT / "tests" / part
    own = [*folder.rglob(f"test_{mutant.path.stem}.py"), folder]
    return [str(path.relative_to(ROOT)) for path in own], [f"tests/{other}" for other in USED_BY[part]]


def survives(mutant: Mutant, checkout: Path) -> bool:
    """Whether all tests pass in a copy of the checkout with this mutant in it."""
    place = checkout / mutant.path.relative_to(ROOT)
    original = place.read_bytes()
    place.write_text(mutant.source, encoding="utf-8")
    try:
        return all(_pass(tests, checkout) for tests in tests_of(mutant) if tests)
    finally:
        place.write_bytes(original)


def _pass(tests: list[str], checkout: Path) -> bool:
    """Run tests in a fork of this process, which has imported what takes long. Tests that do not end have failed."""
    child = os.fork()
    if child == 0:
        try:
            os._exit(_tested(tests, checkout))
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    return status == 0


def _tested(tests: list[str], checkout: Path) -> int:
    import pytest

    signal.alarm(LIMIT_S)
    silent = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(silent, stream)
    os.chdir(checkout)
    sys.path.insert(0, str(checkout / "src"))
    os.environ["PYTHONPATH"] = str(checkout / "src")
    return pytest.main([*dict.fromkeys(tests), "-x", "-q", "-m", "not workflow"])


def main() -> int:
    """Try the mutants that the command line asks for, list the survivors, and count them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=sorted(USED_BY), metavar="NAME", help="parts, or modules of them")
    parser.add_argument("--share", type=float, default=0.1, help="share of all mutants to try (default: 0.1)")
    given = parser.parse_args()

    import numba  # noqa: F401  these take long to import, and every mutant needs them
    import pandas  # noqa: F401
    import pyarrow.parquet  # noqa: F401
    import scipy.optimize
    import scipy.signal
    import scipy.spatial  # noqa: F401

    tried, survived = Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        checkout = Path(folder, "cospeech")
        shutil.copytree(ROOT, checkout, ignore=shutil.ignore_patterns(".*", "results", "bench"))
        for part in sorted({name.partition("/")[0] for name in given.names}):
            if not _pass([f"tests/{part}"], checkout):
                sys.exit(f"the tests of {part} fail as they are; mend that first")
        for mutant in chosen(given.names, given.share):
            start_s, alive = time.monotonic(), survives(mutant, checkout)
            part = mutant.path.relative_to(PACKAGE).parts[0]
            tried[part] += 1
            survived[part] += alive
            print(f"{'SURVIVED' if alive else 'caught  '} {time.monotonic() - start_s:5.1f} s  {mutant}", flush=True)
    for part in sorted(tried):
        print(
            f"{part:<12} {tried[part]:5} tried, {tried[part] - survived[part]:5} caught, {survived[part]:3} survived"
        )
    whole = sum(tried.values())
    print(f"{'all':<12} {whole:5} tried, {1 - sum(survived.values()) / max(whole, 1):.1%} caught")
    return bool(sum(survived.values()))


if __name__ == "__main__":
    sys.exit(main())
