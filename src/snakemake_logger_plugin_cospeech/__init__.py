"""Snakemake logger plugin: one line per finished job, with the progress of the run and the estimated time left.

Snakemake finds the plugin by its name (``--logger cospeech``, set in the default profile). Other messages of
Snakemake are passed on; with ``--quiet progress``, only errors are. An error that is ours is shown without its place
in the Snakefile, and after Ctrl-C, the failures of jobs that were ended are not shown.
"""

from __future__ import annotations

import logging
import os
import re
import time
from collections import Counter, defaultdict
from logging import LogRecord
from statistics import median
from typing import NamedTuple

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from cospeech.workflow.progress import JOB_PROGRESS_VARIABLE, clock, interrupted, write_line

SILENT = (LogEvent.JOB_INFO, LogEvent.JOB_STARTED, LogEvent.JOB_FINISHED, LogEvent.RESOURCES_INFO, LogEvent.PROGRESS)
"""Events that are replaced by the lines for finished jobs."""

SELECTING = "Select jobs to execute..."
"""Message of Snakemake before each job, which is not an event."""

OURS = re.compile(r"^(cospeech: .*)$", re.MULTILINE)
"""The line of an error of Snakemake that is a message of ours."""

UNREADABLE = re.compile(r"_get_overwrite_config.*^(\w+Error[^\n]*)$", re.MULTILINE | re.DOTALL)
"""A traceback of Snakemake's own reading of configuration files, before ours can check them; its last line."""


class Job(NamedTuple):
    """A running job: its rule, its message, and its start time."""

    rule: str
    task: str
    start_s: float


class LogHandler(LogHandlerBase):
    """Keeps track of the jobs and writes their progress to stderr."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self.start_s = time.monotonic()
        self.planned: Counter[str] = Counter()
        self.running: dict[int, Job] = {}
        self.spent_s: defaultdict[str, float] = defaultdict(float)
        self.finished: Counter[str] = Counter()
        self.quiet = bool({str(kind) for kind in self.common_settings.quiet or ()} & {"progress", "all"})
        if not self.quiet:
            os.environ[JOB_PROGRESS_VARIABLE] = "1"  # inherited by the jobs

    def emit(self, record: LogRecord) -> None:
        """Update the progress by an event, and write a line if there is something to report."""
        event = getattr(record, "event", None)
        if record.levelno >= logging.ERROR:
            if not interrupted.is_set():
                write_line(_message(self.format(record)))
        elif self.common_settings.dryrun:
            self._tell(self.format(record))
        elif event == LogEvent.JOB_INFO:
            task = getattr(record, "rule_msg", None) or record.rule_name  # type: ignore[attr-defined]
            self.running[record.jobid] = Job(record.rule_name, task, time.monotonic())  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_FINISHED:
            self._finished(record.job_id)  # type: ignore[attr-defined]
        elif event not in SILENT and record.getMessage() != SELECTING:
            if event == LogEvent.RUN_INFO:
                self.planned = Counter({rule: n for rule, n in record.stats.items() if rule != "total"})  # type: ignore[attr-defined]
            self._tell(self.format(record))

    def _finished(self, number: int) -> None:
        now_s = time.monotonic()
        job = self.running.pop(number, Job("", f"job {number}", now_s))
        self.finished[job.rule] += 1
        self.spent_s[job.rule] += now_s - job.start_s
        done, total = self.finished.total(), self.planned.total()
        left = f"about {clock(self.remaining_s(now_s))} left" if done < total else "done"
        self._tell(
            f"[{done}/{total}, {clock(now_s - self.start_s)}, {left}] {job.task} ({now_s - job.start_s:.1f} s)"
        )

    def remaining_s(self, now_s: float) -> float:
        """Return the estimated time left in seconds, assuming the same average number of parallel jobs as so far.

        A job is expected to take the mean time of the finished jobs of its rule. If there are none, it is expected to
        take the median of the mean times of the other rules: most rules are short, and a mean would be dominated by
        the few long ones, which run first.
        """
        each_s = {rule: self.spent_s[rule] / number for rule, number in self.finished.items()}
        usual_s = median(each_s.values())
        expected_s = sum(
            (number - self.finished[rule]) * each_s.get(rule, usual_s) for rule, number in self.planned.items()
        )
        expected_s -= sum(now_s - job.start_s for job in self.running.values())
        parallel = max(1.0, sum(self.spent_s.values()) / (now_s - self.start_s))
        return max(0.0, expected_s) / parallel

    def _tell(self, line: str) -> None:
        """Write a line that is not an error."""
        if line and not self.quiet:
            write_line(line)


def _message(error: str) -> str:
    """Return what a reader needs of an error message of Snakemake."""
    own, unreadable = OURS.search(error), UNREADABLE.search(error)
    if own:
        return own[1]
    if unreadable:
        return (
            f"cospeech: a file of --configfile cannot be read ({unreadable[1]}); it must be in UTF-8, without values "
            "that contain themselves or are nested hundreds deep"
        )
    return error
