"""Reading a configuration file strictly: what YAML permits and a reader would misunderstand is an error."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from cospeech.errors import UserError

DEEPEST = 50
"""Largest number of lists and mappings inside one another. Ours has eight, and Snakemake fails at a few hundred."""

LARGEST = 1_000_000
"""Largest number of values, counting those of an anchor once for each alias that refers to it."""

NOT_DECIMAL = re.compile(r"[-+]?(0[0-9_]+|[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?)")
"""Numbers that YAML 1.1 reads in base 8 (``010``) or 60 (``1:30``), which is hardly ever meant."""

MERGE = "<<"


@dataclass
class _Open:
    """A list or mapping whose end was not read yet."""

    line: int
    mapping: bool
    anchor: str | None
    size: int = 1
    at_key: bool = True
    keys: set[str] = field(default_factory=set)


def check(path: Path) -> None:
    """Raise UserError, one line, unless ``path`` is a YAML or JSON file with settings, each given once.

    The values themselves are checked when the file has been merged into the default configuration.
    """
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        text = _text(path)
        _scan(yaml.parse(text, Loader=loader), str(path))
        settings = yaml.load(text, Loader=loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark else ""
        reason = " ".join(str(getattr(error, "problem", None) or "unreadable").split())
        raise UserError(f"{path}: {place}not valid YAML ({reason}); correct it") from error
    except (ValueError, TypeError) as error:  # a date such as 2024-13-01, or a key that is a list
        raise UserError(f"{path}: not valid YAML ({error}); correct it, or put the value in quotes") from error
    if not isinstance(settings, dict):
        raise UserError(f"{path}: contains no settings; write them as 'key: value' (see cospeech report --help)")


def _text(path: Path) -> str:
    if path.is_dir():
        raise UserError(f"{path}: is a folder; name the configuration file")
    if not path.is_file():
        where = "" if path.is_absolute() else f" in {Path.cwd()}"
        raise UserError(f"{path}: no such file{where}; correct the path of the configuration")
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise UserError(f"{path}: line {line}: not in UTF-8; save the file in this encoding") from error


def _scan(events: Iterable[Any], name: str) -> None:
    """Check the nesting, aliases and keys of a file from its parser events, before anything is built from them."""
    import yaml

    opened: list[_Open] = []
    sizes: dict[str, int] = {}
    documents = 0

    def fail(line: int, problem: str) -> NoReturn:
        raise UserError(f"{name}: line {line}: {problem}")

    def add(size: int) -> None:
        """Count a complete value in the list or mapping that contains it."""
        if opened:
            opened[-1].size += size
            opened[-1].at_key = not opened[-1].at_key

    for event in events:
        line = event.start_mark.line + 1
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                fail(line, "a second document begins; keep one configuration per file")
        elif isinstance(event, yaml.CollectionStartEvent):
            if len(opened) >= DEEPEST:
                fail(
                    line, f"more than {DEEPEST} lists or mappings inside one another; correct the brackets or indents"
                )
            opened.append(_Open(line, isinstance(event, yaml.MappingStartEvent), event.anchor))
            sizes.pop(event.anchor or "", None)
        elif isinstance(event, yaml.CollectionEndEvent):
            ended = opened.pop()
            if ended.anchor:
                sizes[ended.anchor] = ended.size
            add(ended.size)
        elif isinstance(event, yaml.AliasEvent):
            if any(outer.anchor == event.anchor for outer in opened):
                fail(line, f"*{event.anchor} refers to the value that contains it; write the value out")
            add(sizes.get(event.anchor or "", 1))
        elif isinstance(event, yaml.ScalarEvent):
            if event.implicit[0] and NOT_DECIMAL.fullmatch(event.value):
                fail(line, f"YAML reads {event.value} in base 8 or 60; write a decimal number, or use quotes")
            if opened and opened[-1].mapping and opened[-1].at_key and event.value != MERGE:
                if event.value in opened[-1].keys:
                    fail(line, f"'{event.value}' is given twice; keep one of them")
                opened[-1].keys.add(event.value)
            if event.anchor:
                sizes[event.anchor] = 1
            add(1)
        if opened and opened[-1].size > LARGEST:
            fail(line, f"more than {LARGEST:,} values once aliases are replaced; write out only what is needed")
