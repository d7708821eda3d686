"""Progress reports of a long job and of the whole run."""

import io
import logging
import os
import sys
from collections import Counter
from threading import Thread
from types import SimpleNamespace

import pytest

from cospeech.workflow import progress
from snakemake_logger_plugin_cospeech import LogHandler


@pytest.fixture
def clock(monkeypatch):
    """A clock that the tests control."""
    now = SimpleNamespace(s=0.0)
    monkeypatch.setattr("time.monotonic", lambda: now.s)
    return now


@pytest.mark.parametrize(("seconds", "text"), [(0.4, "0:00:00"), (59.6, "0:01:00"), (3725, "1:02:05")])
def test_clock(seconds, text):
    assert progress.clock(seconds) == text


def test_a_long_job_reports_every_ten_seconds_and_yields_all_items(clock):
    reported, yielded = [], []
    for item in progress.followed("abcdef", "letters", reported.append):
        yielded.append(item)
        clock.s += 6
    assert "".join(yielded) == "abcdef"
    assert reported == ["2 of 6 letters, about 0:00:24 left", "4 of 6 letters, about 0:00:12 left"]


def handler(monkeypatch, quiet=()):
    monkeypatch.setenv(progress.JOB_PROGRESS_VARIABLE, "")  # so that it is restored after the test
    monkeypatch.delenv(progress.JOB_PROGRESS_VARIABLE)
    return LogHandler(SimpleNamespace(dryrun=False, quiet=quiet), None)


def event(name, message="", **fields):
    return logging.makeLogRecord({"event": name, "msg": message, "levelno": logging.INFO} | fields)


def test_each_finished_job_is_a_line_with_the_estimated_time_left(monkeypatch, clock, capsys):
    run = handler(monkeypatch)
    run.emit(event("run_info", "Job stats", stats={"slow": 2, "fast": 3, "total": 5}))
    for number, rule, seconds in ((1, "slow", 60), (2, "fast", 3)):
        run.emit(event("job_info", jobid=number, rule_name=rule, rule_msg=f"{rule} task"))
        clock.s += seconds
        run.emit(event("job_finished", job_id=number))
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "Job stats",
        "[1/5, 0:01:00, about 0:04:00 left] slow task (60.0 s)",
        "[2/5, 0:01:03, about 0:01:06 left] fast task (3.0 s)",  # one slow job of 60 s and two fast ones of 3 s
    ]


def test_rules_that_have_not_run_are_expected_to_take_the_median_time(monkeypatch, clock, capsys):
    run = handler(monkeypatch)
    run.emit(event("run_info", "Job stats", stats={"film": 1, "table": 1, "figure": 1, "page": 10, "total": 13}))
    for number, (rule, seconds) in enumerate((("film", 100), ("table", 2), ("figure", 3))):
        run.emit(event("job_info", jobid=number, rule_name=rule, rule_msg=rule))
        clock.s += seconds
        run.emit(event("job_finished", job_id=number))
    assert "about 0:00:30 left" in capsys.readouterr().err.splitlines()[-1]


def test_errors_are_passed_on(monkeypatch, capsys):
    run = handler(monkeypatch)
    run.emit(event("job_error", "Error in rule slow", levelno=logging.ERROR))
    run.emit(event("job_started", "Execute 1 jobs..."))
    assert capsys.readouterr().err == "Error in rule slow\n"


def test_a_quiet_run_shows_errors_only(monkeypatch, capsys):
    run = handler(monkeypatch, ("progress",))
    run.emit(event(None, "Building DAG of jobs..."))
    run.emit(event("run_info", "Job stats", stats={"slow": 1, "total": 1}))
    run.emit(event("job_info", jobid=1, rule_name="slow", rule_msg="slow task"))
    run.emit(event("job_finished", job_id=1))
    progress.tell("done; the report is index.html")
    run.emit(event("job_error", "Error in rule slow", levelno=logging.ERROR))
    assert capsys.readouterr().err == "Error in rule slow\n"


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (
            'WorkflowError in file "Snakefile", line 5:\ncospeech: config: run: no\n  File "x"',
            "cospeech: config: run: no",
        ),
        (
            "Traceback\n in _get_overwrite_config\nRecursionError: too deep\n",
            "cospeech: a file of --configfile cannot be read (RecursionError: too deep); it must be",
        ),
    ],
)
def test_an_error_of_the_configuration_is_one_line(monkeypatch, capsys, error, shown):
    handler(monkeypatch).emit(event("error", error, levelno=logging.ERROR))
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(shown)


def test_the_failures_of_jobs_that_ctrl_c_ended_are_not_shown(monkeypatch, capsys):
    monkeypatch.setattr(progress.interrupted, "is_set", lambda: True)
    handler(monkeypatch).emit(event("job_error", "Error in rule slow", levelno=logging.ERROR))
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("jobs", "line"),
    [
        ([([], ["r/a/index.html", "s/a/film.mp4"])], "done; the report is r/a/index.html"),
        ([(["r/a/index.html"], ["s/a/x"])], "done; the report is r/a/index.html"),
        ([([], ["s/a/export/1.trc", "s/a/export/1.c3d"])], "done; see s/a/export"),
        ([(["s/a/b.parquet"], ["r/a/index.html"])], "done; see s/a/b.parquet"),
        ([([], [])], "done"),
    ],
)
def test_the_end_of_a_run_names_what_was_asked_for(jobs, line):
    targets = [SimpleNamespace(output=output, input=given) for output, given in jobs]
    assert progress.done(targets, "r/a/index.html") == line


@pytest.mark.parametrize(("quiet", "reports"), [((), True), (("progress",), False)])
def test_the_option_quiet_is_passed_to_the_jobs(monkeypatch, quiet, reports):
    handler(monkeypatch, quiet)
    assert (progress.JOB_PROGRESS_VARIABLE in os.environ) is reports


def test_lines_written_by_parallel_threads_do_not_mix(monkeypatch, tmp_path):
    stream = io.TextIOWrapper((tmp_path / "stderr").open("wb", buffering=0), write_through=True)  # PYTHONUNBUFFERED
    monkeypatch.setattr("sys.stderr", stream)
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    threads = [
        Thread(target=lambda name=name: [progress.write_line(name * 40) for _ in range(2000)]) for name in "abcd"
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    sys.setswitchinterval(interval_s)
    stream.close()
    assert Counter((tmp_path / "stderr").read_text().splitlines()) == {name * 40: 2000 for name in "abcd"}
