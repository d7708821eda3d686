"""Common environment of all scripts: settings, reading and writing tables, logging, and one-line error messages."""

from __future__ import annotations

import gc
import hashlib
import json
import logging
import os
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

gc.disable()  # repeated garbage collection during imports takes 0.1 s per job

import pandas as pd  # noqa: E402

from cospeech.data import tables  # noqa: E402
from cospeech.errors import UserError  # noqa: E402
from cospeech.workflow import progress, receipts  # noqa: E402

gc.freeze()
gc.enable()

log = logging.getLogger("cospeech")

Item = TypeVar("Item")


def settings_hash(settings: dict[str, Any]) -> str:
    """Return the hash of the parameters of a rule, without those that are hashes of code (``code``, ``..._code``)."""
    relevant = {key: value for key, value in settings.items() if key != "code" and not key.endswith("_code")}
    return hashlib.sha256(json.dumps(relevant, sort_keys=True, default=str).encode()).hexdigest()[:16]


class Job:
    """A running script: inputs, outputs and settings under short names."""

    def __init__(self, snakemake: Any) -> None:
        self.input = snakemake.input
        self.output = snakemake.output
        self.wildcards = snakemake.wildcards
        self.params: dict[str, Any] = dict(snakemake.params.items())
        self.corpus: str = self.params["corpus"]
        self.rule: str = snakemake.rule
        self.config_hash = settings_hash(self.params)
        self.written: list[str] = list(snakemake.output)

    def read(self, path: str | Sequence[str], schema: str, columns: list[str] | None = None) -> pd.DataFrame:
        """Read one table (see ``tables.read``), or several tables and concatenate them."""
        if isinstance(path, str):
            return tables.read(path, schema, columns)
        return pd.concat([tables.read(one, schema, columns) for one in path], ignore_index=True)

    def read_each(self, names: Sequence[str], paths: Sequence[str], schema: str) -> dict[str, pd.DataFrame]:
        """Read one table per name from the corresponding path; the result is empty if there are no paths."""
        return {name: tables.read(path, schema) for name, path in zip(names, paths, strict=bool(paths))}

    def write(self, frame: pd.DataFrame | Sequence[pd.DataFrame], path: str | Path, schema: str) -> None:
        """Write one table, or several concatenated, with the provenance of this job (see ``tables.write``)."""
        whole = frame if isinstance(frame, pd.DataFrame) else pd.concat(frame, ignore_index=True)
        tables.write(whole, path, schema, corpus=self.corpus, config_hash=self.config_hash)
        self.written.append(str(path))

    def warn(self, message: str) -> None:
        """Write one line to the log of this job and to stderr."""
        log.warning(f"WARNING {message}")
        progress.write_line(f"cospeech: {message}")

    def say(self, message: str) -> None:
        """Write one line to the log of this job."""
        log.info(message)

    def followed(self, items: Sequence[Item], unit: str) -> Iterator[Item]:
        """Yield ``items`` and report the progress in the log and on stderr (see ``progress.followed``)."""
        name = " ".join([self.rule, *self.wildcards])

        def report(line: str) -> None:
            self.say(line)
            if progress.JOB_PROGRESS_VARIABLE in os.environ:
                progress.write_line(f"  {name}: {line}")

        return progress.followed(items, unit, report)


@contextmanager
def run(snakemake: Any) -> Iterator[Job]:
    """Run the body of a script as a ``Job``.

    A UserError ends the process with exit status 1 and a one-line message on stderr and in the log. Any other
    exception also ends the process; its traceback is written to the log, and one line on stderr names the log file.
    """
    gc.freeze()  # imported modules are never freed; collecting them, now and at exit, takes 0.3 s per job
    path = Path(snakemake.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    handler = logging.FileHandler(path, mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        work = Job(snakemake)
        wildcards = dict(snakemake.wildcards.items())
        results = path.parents[len(wildcards) + 1]  # the log is <results>/logs/<rule>/<wildcards>.log
        receipt = receipts.place(results, work.rule, wildcards)
        receipts.begin(receipt)
        yield work
        if work.written:
            receipts.save(receipt, work.rule, wildcards, work.config_hash, work.written)
    except UserError as error:
        _stop(f"{snakemake.rule}: {error}")
    except OSError as error:
        if error.errno in (28, 122):
            _stop(f"{snakemake.rule}: the disk is full ({error.filename}); free some space and run again")
        log.error(traceback.format_exc())
        _stop(f"{snakemake.rule}: {error}; the traceback is in {path}")
    except Exception as error:
        log.error(traceback.format_exc())
        _stop(f"{snakemake.rule}: defect in cospeech ({type(error).__name__}: {error}); the traceback is in {path}")


def _stop(message: str) -> None:
    line = " ".join(message.split())
    log.error(f"ERROR {line}")
    progress.write_line(f"cospeech: {line}")
    logging.shutdown()
    os._exit(1)
