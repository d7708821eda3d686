"""The manifest of a run, ``results/<run>/run/manifest.parquet``, and the verification of all its files."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

import pandas as pd

from cospeech.data import tables
from cospeech.workflow import receipts
from cospeech.workflow.receipts import Receipt

TABLE = "run/manifest.parquet"

NOT_ARTIFACTS = ("logs", "benchmarks", "run", ".lock")
"""What a run leaves in the folder of its results besides artifacts."""

TIMESTAMP = ".snakemake_timestamp"
"""Name of the file with which Snakemake marks the age of a folder."""

CHANGED = "changed since the run wrote it; delete it and run again"
MISSING = "missing; run again"
UNFINISHED = "the job that writes it was interrupted; run again"
LEFT_OVER = "left over from another configuration; delete it if you do not need it"
FOREIGN = "foreign (no job of this run wrote it); move it elsewhere or delete it"


def write_table(results: str | Path, planned: Iterable[Receipt], *, corpus: str, config_hash: str) -> None:
    """Write the manifest of a run from its receipts; ``corpus`` and ``config_hash`` as for ``tables.write``."""
    rows = [(*artifact, one.rule, one.config_hash) for one in planned if one.finished for artifact in one.artifacts]
    frame = pd.DataFrame(rows, columns=["path", "sha256", "bytes", "rule", "config_hash"])
    frame = frame.drop_duplicates("path").sort_values("path", ignore_index=True)
    tables.write(frame, Path(results, TABLE), "manifest", corpus=corpus, config_hash=config_hash)


def problems(folders: Collection[Path], known: Collection[Receipt], planned: Collection[Receipt]) -> list[str]:
    """Return one message per file that is changed, missing, unfinished, left over or foreign, sorted by path.

    Parameters
    ----------
    folders : folders of the results and the report of a run; every file in them should be an artifact of the run.
    known : receipts of all jobs that ever wrote to these folders (see ``receipts.load``).
    planned : receipts of the jobs that belong to the present configuration.
    """
    wanted = {path for receipt in planned for path, _, _ in receipt.artifacts}
    listed = {path for receipt in known for path, _, _ in (*receipt.artifacts, *receipt.former)}
    found = {path: LEFT_OVER if path in listed else FOREIGN for path in _files(folders) if path not in wanted}
    for receipt in planned:
        if not receipt.finished:
            found |= {path: UNFINISHED for path, _, _ in receipt.artifacts}
        else:
            found |= dict.fromkeys(receipts.missing(receipt), MISSING)
            found |= dict.fromkeys(receipts.changed(receipt, thoroughly=True), CHANGED)
    return [f"{path}: {what}" for path, what in sorted(found.items())]


def _files(folders: Collection[Path]) -> Iterator[str]:
    for folder in folders:
        for path in folder.rglob("*"):
            other = path.relative_to(folder).parts[0] in NOT_ARTIFACTS or path.name == TIMESTAMP
            if not other and (path.is_file() or path.is_symlink()):
                yield str(path)
