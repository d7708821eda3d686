"""Receipts of jobs: which files each job wrote, with checksums.

Jobs may run on several machines at once and can be killed at any time, so no common table is written while they run.
Each job leaves a receipt instead, a JSON file in ``results/<run>/run/receipts``. The manifest of the run is made from
all receipts when the run ends (``cospeech.workflow.manifest``).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from cospeech.errors import UserError

RECEIPTS = "run/receipts"

END_OF_RUN = "end_of_run"
"""Stands for a rule in the receipt of the files that are written when all jobs have ended."""


class Artifact(NamedTuple):
    """One file that a job wrote: path relative to the folder of the run, SHA-256 of the content, and size."""

    path: str
    sha256: str
    bytes: int


@dataclass(frozen=True)
class Receipt:
    """What one job wrote.

    Attributes
    ----------
    rule : rule of the job.
    wildcards : values of its wildcards.
    config_hash : hash of the settings that it was given.
    output : its first output, a file or folder.
    artifacts : the files it wrote.
    former : files that the same job wrote under another configuration and does not write any longer.
    finished : False from the start of a job to its end; the files may be incomplete.
    path : path of the receipt.
    written_ns : time at which the receipt was written, in nanoseconds since the epoch.
    """

    rule: str
    wildcards: dict[str, str]
    config_hash: str
    output: str
    artifacts: tuple[Artifact, ...]
    former: tuple[Artifact, ...] = ()
    finished: bool = True
    path: str = ""
    written_ns: int = 0


def place(results: str | Path, rule: str, wildcards: Mapping[str, str]) -> Path:
    """Return the path of the receipt of a job, which is named after its rule and wildcards as its log is."""
    return Path(results, RECEIPTS, rule, *(wildcards[name] for name in sorted(wildcards))).with_suffix(".json")


def begin(path: Path) -> None:
    """Mark the receipt of an earlier run of the same job, if there is one: its files are about to be replaced."""
    if path.is_file():
        _write(_read(path), path, finished=False)


def save(path: Path, rule: str, wildcards: Mapping[str, str], config_hash: str, written: Sequence[str]) -> None:
    """Write the receipt of a finished job to ``path``.

    Parameters
    ----------
    path : see ``place``.
    rule, wildcards, config_hash : see ``Receipt``.
    written : the files and folders that the job wrote, its first output first; a folder stands for all files in it.
    """
    artifacts = tuple(_artifact(file) for file in dict.fromkeys(_files(written)))
    former: tuple[Artifact, ...] = ()
    if path.is_file():
        earlier, now = _read(path), {artifact.path for artifact in artifacts}
        known = (*earlier.artifacts, *earlier.former)
        former = tuple(one for one in known if one.path not in now and Path(one.path).is_file())
    _write(Receipt(rule, dict(wildcards), config_hash, written[0], artifacts, former), path, finished=True)


def load(results: str | Path) -> list[Receipt]:
    """Return all receipts of a run, sorted by their paths."""
    return [_read(path) for path in sorted(Path(results, RECEIPTS).rglob("*.json"))]


def missing(receipt: Receipt) -> list[str]:
    """Return the artifacts of a receipt that do not exist."""
    return [artifact.path for artifact in receipt.artifacts if not Path(artifact.path).is_file()]


def changed(receipt: Receipt, *, thoroughly: bool) -> list[str]:
    """Return the artifacts of a receipt that differ from what the job wrote.

    Parameters
    ----------
    receipt : receipt of a finished job.
    thoroughly : whether to read every file. Otherwise, only files that were modified after the job's end are read.
    """
    found = []
    for artifact in receipt.artifacts:
        try:
            state = Path(artifact.path).stat()
        except FileNotFoundError:
            continue
        suspect = thoroughly or state.st_size != artifact.bytes or state.st_mtime_ns > receipt.written_ns
        if suspect and _artifact(artifact.path) != artifact:
            found.append(artifact.path)
    return found


def _files(written: Iterable[str]) -> Iterator[str]:
    for path in written:
        if Path(path).is_dir():
            yield from (str(file) for file in sorted(Path(path).rglob("*")) if file.is_file())
        else:
            yield path


def _artifact(path: str) -> Artifact:
    with Path(path).open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return Artifact(path, digest, file.tell())


def _read(path: Path) -> Receipt:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        for key in ("artifacts", "former"):
            content[key] = tuple(Artifact(*artifact) for artifact in content[key])
        return Receipt(**content, path=str(path), written_ns=path.stat().st_mtime_ns)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path}: damaged ({error}); delete it and the files of its job, and run again") from error


def _write(receipt: Receipt, path: Path, *, finished: bool) -> None:
    from cospeech.data import tables  # not above: it imports pandas

    content = {
        "rule": receipt.rule,
        "wildcards": receipt.wildcards,
        "config_hash": receipt.config_hash,
        "output": receipt.output,
        "artifacts": receipt.artifacts,
        "former": receipt.former,
        "finished": finished,
    }
    with tables.replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
