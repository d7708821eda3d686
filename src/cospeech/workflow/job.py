"""What every script does around its one call: settings, outputs, the log, and one line on a mistake."""

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

gc.disable()  # to look through what is imported for garbage, again and again, takes 0.1 s of every job

import pandas as pd  # noqa: E402

from cospeech.data import tables  # noqa: E402
from cospeech.errors import UserError  # noqa: E402
from cospeech.workflow import progress  # noqa: E402

gc.freeze()
gc.enable()

log = logging.getLogger("cospeech")

Thing = TypeVar("Thing")


def settings_hash(settings: dict[str, Any]) -> str:
    """Return the hash of the settings that a rule was given; the code's own hash is no setting."""
    given = {key: value for key, value in settings.items() if key != "code"}
    return hashlib.sha256(json.dumps(given, sort_keys=True, default=str).encode()).hexdigest()[:16]


class Job:
    """One running script: its inputs, outputs and settings under short names."""

    def __init__(self, snakemake: Any) -> None:
        self.input = snakemake.input
        self.output = snakemake.output
        self.wildcards = snakemake.wildcards
        self.params: dict[str, Any] = dict(snakemake.params.items())
        self.corpus: str = self.params["corpus"]
        self.rule: str = snakemake.rule
        self.config_hash = settings_hash(self.params)

    def read(self, path: str | Sequence[str], schema: str, columns: list[str] | None = None) -> pd.DataFrame:
        """Read one table (see ``tables.read``), or several, one below the other."""
        if isinstance(path, str):
            return tables.read(path, schema, columns)
        return pd.concat([tables.read(one, schema, columns) for one in path], ignore_index=True)

    def read_each(self, names: Sequence[str], paths: Sequence[str], schema: str) -> dict[str, pd.DataFrame]:
        """Read the table of each name, in step with ``paths``; no name has one where there are no paths."""
        return {name: tables.read(path, schema) for name, path in zip(names, paths, strict=bool(paths))}

    def write(self, frame: pd.DataFrame | Sequence[pd.DataFrame], path: str, schema: str) -> None:
        """Write one table, or several one below the other, with the origin of this job (see ``tables.write``)."""
        whole = frame if isinstance(frame, pd.DataFrame) else pd.concat(frame, ignore_index=True)
        tables.write(whole, path, schema, corpus=self.corpus, config_hash=self.config_hash)

    def warn(self, message: str) -> None:
        """Put one line into the log of this job, and onto stderr."""
        log.warning(f"WARNING {message}")
        progress.tell(f"cospeech: {message}")

    def say(self, message: str) -> None:
        """Put one line into the log of this job."""
        log.info(message)

    def followed(self, things: Sequence[Thing], unit: str) -> Iterator[Thing]:
        """Yield ``things``, and tell a person who waits how many are done (see ``progress.followed``)."""
        name = " ".join([self.rule, *self.wildcards])

        def say(line: str) -> None:
            self.say(line)
            if progress.SAID_BY_JOBS in os.environ:
                progress.tell(f"  {name}: {line}")

        return progress.followed(things, unit, say)


@contextmanager
def run(snakemake: Any) -> Iterator[Job]:
    """Run the body of a script as a ``Job``.

    A UserError ends the process with its one line on stderr and in the log, and exit status 1; any other exception
    leaves its traceback in the log, and one line on stderr says where.
    """
    gc.freeze()  # what was imported stays: to look through it again, and at the end, takes 0.3 s of a job
    path = Path(snakemake.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    handler = logging.FileHandler(path, mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield Job(snakemake)
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
    progress.tell(f"cospeech: {line}")
    logging.shutdown()
    os._exit(1)
