"""What a person sees while Snakemake runs: one line for each finished job, with how far it is and how long still.

Snakemake finds the plugin by its name (``--logger cospeech``, which the default profile sets). Errors, and whatever
else Snakemake has to say, pass through as it words them; ``--quiet progress`` leaves nothing but those.
"""

from __future__ import annotations

import os
import time
from collections import Counter, defaultdict
from logging import LogRecord
from statistics import median
from typing import NamedTuple

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from cospeech.workflow.progress import SAID_BY_JOBS, clock, tell

SILENT = (LogEvent.JOB_INFO, LogEvent.JOB_STARTED, LogEvent.JOB_FINISHED, LogEvent.RESOURCES_INFO, LogEvent.PROGRESS)
"""Events that the lines of finished jobs stand for."""

SELECTING = "Select jobs to execute..."
"""What Snakemake says before each job; it is no event."""


class Job(NamedTuple):
    """A job that runs: its rule, what it does, and when it began."""

    rule: str
    task: str
    begun_s: float


class LogHandler(LogHandlerBase):
    """Follows the jobs, and writes to stderr."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self.begun_s = time.monotonic()
        self.planned: Counter[str] = Counter()
        self.running: dict[int, Job] = {}
        self.spent_s: defaultdict[str, float] = defaultdict(float)
        self.finished: Counter[str] = Counter()
        quiet = {str(kind) for kind in self.common_settings.quiet or ()}
        if not quiet & {"progress", "all"}:
            os.environ[SAID_BY_JOBS] = "1"  # jobs inherit it

    def emit(self, record: LogRecord) -> None:
        """Take note of an event, and write what there is to write."""
        event = getattr(record, "event", None)
        if self.common_settings.dryrun:
            self._write(self.format(record))
        elif event == LogEvent.JOB_INFO:
            task = getattr(record, "rule_msg", None) or record.rule_name  # type: ignore[attr-defined]
            self.running[record.jobid] = Job(record.rule_name, task, time.monotonic())  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_FINISHED:
            self._finished(record.job_id)  # type: ignore[attr-defined]
        elif event not in SILENT and record.getMessage() != SELECTING:
            if event == LogEvent.RUN_INFO:
                self.planned = Counter({rule: n for rule, n in record.stats.items() if rule != "total"})  # type: ignore[attr-defined]
            self._write(self.format(record))

    def _finished(self, number: int) -> None:
        now_s = time.monotonic()
        job = self.running.pop(number, Job("", f"job {number}", now_s))
        self.finished[job.rule] += 1
        self.spent_s[job.rule] += now_s - job.begun_s
        done, total = self.finished.total(), self.planned.total()
        left = f"about {clock(self.left_s(now_s))} left" if done < total else "done"
        self._write(
            f"[{done}/{total}, {clock(now_s - self.begun_s)}, {left}] {job.task} ({now_s - job.begun_s:.1f} s)"
        )

    def left_s(self, now_s: float) -> float:
        """Return the seconds that the jobs still to run may take, as many side by side as so far.

        A job is expected to take what the jobs of its rule took, or, where none has finished, what the middle one of
        the other rules takes: most rules are short, and the long ones, which come first, say little of them.
        """
        each_s = {rule: self.spent_s[rule] / number for rule, number in self.finished.items()}
        usual_s = median(each_s.values())
        expected_s = sum(
            (number - self.finished[rule]) * each_s.get(rule, usual_s) for rule, number in self.planned.items()
        )
        expected_s -= sum(now_s - job.begun_s for job in self.running.values())
        side_by_side = max(1.0, sum(self.spent_s.values()) / (now_s - self.begun_s))
        return max(0.0, expected_s) / side_by_side

    @staticmethod
    def _write(line: str) -> None:
        if line:
            tell(line)
