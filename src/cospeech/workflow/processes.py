"""How Snakemake starts and ends the processes of its jobs, where its own way does not serve our users."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable
from types import FrameType
from typing import Any

import psutil
from snakemake.script import PythonScript
from snakemake.shell import shell

from cospeech.workflow import progress

UNDISTURBED = "trap '' INT; exec "
"""Before the command of every job: Ctrl-C reaches the main process alone. Otherwise Python would interrupt each job
wherever it is, even in an import, and print a traceback. ``exec`` makes the job the process that is ended."""


def prepare() -> None:
    """Let jobs ignore Ctrl-C, and let Python lie in a folder of any name (Snakemake does not quote its path)."""
    shell.prefix(UNDISTURBED)
    execute: Callable[..., Any] = PythonScript._execute_cmd

    def quoted(self: PythonScript, command: str, **values: Any) -> Any:
        return execute(self, command.replace("{py_exec}", "{py_exec:q}"), **values)

    PythonScript._execute_cmd = quoted


def end_on_interrupt() -> None:
    """End all jobs on Ctrl-C, before the main process is interrupted itself and waits for them."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before):  # ignored, as in a shell script that runs in the background
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        progress.interrupted.set()
        for child in psutil.Process().children():
            with contextlib.suppress(psutil.NoSuchProcess):
                child.terminate()
        before(number, frame)

    signal.signal(signal.SIGINT, interrupt)
