"""Verification of the files of a run: each is compared with the manifest."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from cospeech.workflow import manifest
from cospeech.workflow.manifest import Receipt

NOT_ARTIFACTS = ("logs", "benchmarks", "run", ".lock")
"""What a run leaves in the folder of its results besides artifacts."""

TIMESTAMP = ".snakemake_timestamp"
"""Name of the file with which Snakemake marks the age of a folder."""

CHANGED = "changed since the run wrote it; delete it and run again"
MISSING = "missing; run again"
UNFINISHED = "the job that writes it was interrupted; run again"
LEFT_OVER = "left over from another configuration; delete it if you do not need it"
FOREIGN = "foreign (no job of this run wrote it); move it elsewhere or delete it"


def problems(folders: Collection[Path], receipts: Collection[Receipt], planned: Collection[Receipt]) -> list[str]:
    """Return one message per file that is changed, missing, unfinished, left over or foreign, sorted by path.

    Parameters
    ----------
    folders : folders of the results and the report of a run; every file in them should be an artifact of the run.
    receipts : receipts of all jobs that ever wrote to these folders (see ``manifest.load``).
    planned : receipts of the jobs that belong to the present configuration.
    """
    wanted = {path for receipt in planned for path, _, _ in receipt.artifacts}
    known = {path for receipt in receipts for path, _, _ in (*receipt.artifacts, *receipt.former)}
    found = {path: LEFT_OVER if path in known else FOREIGN for path in _files(folders) if path not in wanted}
    for receipt in planned:
        if not receipt.finished:
            found |= {path: UNFINISHED for path, _, _ in receipt.artifacts}
        else:
            found |= dict.fromkeys(manifest.missing(receipt), MISSING)
            found |= dict.fromkeys(manifest.changed(receipt, thoroughly=True), CHANGED)
    return [f"{path}: {what}" for path, what in sorted(found.items())]


def _files(folders: Collection[Path]) -> Iterator[str]:
    for folder in folders:
        for path in folder.rglob("*"):
            other = path.relative_to(folder).parts[0] in NOT_ARTIFACTS or path.name == TIMESTAMP
            if not other and (path.is_file() or path.is_symlink()):
                yield str(path)
