"""What a person who waits is told: of a long job, and of the whole run."""

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
    """A clock that tests set."""
    now = SimpleNamespace(s=0.0)
    monkeypatch.setattr("time.monotonic", lambda: now.s)
    return now


@pytest.mark.parametrize(("seconds", "text"), [(0.4, "0:00:00"), (59.6, "0:01:00"), (3725, "1:02:05")])
def test_clock(seconds, text):
    assert progress.clock(seconds) == text


def test_a_long_job_speaks_every_ten_seconds_and_yields_everything(clock):
    said, got = [], []
    for thing in progress.followed("abcdef", "letters", said.append):
        got.append(thing)
        clock.s += 6
    assert "".join(got) == "abcdef"
    assert said == ["2 of 6 letters, about 0:00:24 left", "4 of 6 letters, about 0:00:12 left"]


def handler(monkeypatch, quiet=()):
    monkeypatch.setenv(progress.SAID_BY_JOBS, "")  # so that it is put back after the test
    monkeypatch.delenv(progress.SAID_BY_JOBS)
    return LogHandler(SimpleNamespace(dryrun=False, quiet=quiet), None)


def event(name, message="", **fields):
    return logging.makeLogRecord({"event": name, "msg": message} | fields)


def test_a_line_a_finished_job_with_the_time_that_its_like_will_take(monkeypatch, clock, capsys):
    run = handler(monkeypatch)
    run.emit(event("run_info", "Job stats", stats={"slow": 2, "fast": 3, "total": 5}))
    for number, rule, seconds in ((1, "slow", 60), (2, "fast", 3)):
        run.emit(event("job_info", jobid=number, rule_name=rule, rule_msg=f"{rule} task"))
        clock.s += seconds
        run.emit(event("job_finished", job_id=number))
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "Job stats",
        "[1/5, 0:01:00, about 0:04:00 left] slow task (60.0 s)",
        "[2/5, 0:01:03, about 0:01:06 left] fast task (3.0 s)",  # a slow one of 60 s and two fast ones of 3 s
    ]


def test_rules_that_have_not_run_are_expected_to_be_as_long_as_most(monkeypatch, clock, capsys):
    run = handler(monkeypatch)
    run.emit(event("run_info", "Job stats", stats={"film": 1, "table": 1, "figure": 1, "page": 10, "total": 13}))
    for number, (rule, seconds) in enumerate((("film", 100), ("table", 2), ("figure", 3))):
        run.emit(event("job_info", jobid=number, rule_name=rule, rule_msg=rule))
        clock.s += seconds
        run.emit(event("job_finished", job_id=number))
    assert "about 0:00:30 left" in capsys.readouterr().err.splitlines()[-1]


def test_errors_pass_through(monkeypatch, capsys):
    run = handler(monkeypatch)
    run.emit(event("job_error", "Error in rule slow"))
    run.emit(event("job_started", "Execute 1 jobs..."))
    assert capsys.readouterr().err == "Error in rule slow\n"


@pytest.mark.parametrize(("quiet", "speak"), [((), True), (("progress",), False)])
def test_quiet_reaches_the_jobs(monkeypatch, quiet, speak):
    handler(monkeypatch, quiet)
    assert (progress.SAID_BY_JOBS in os.environ) is speak


def test_threads_that_speak_at_once_do_not_break_one_anothers_lines(monkeypatch, tmp_path):
    said = io.TextIOWrapper((tmp_path / "said").open("wb", buffering=0), write_through=True)  # PYTHONUNBUFFERED
    monkeypatch.setattr("sys.stderr", said)
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    speakers = [Thread(target=lambda name=name: [progress.tell(name * 40) for _ in range(2000)]) for name in "abcd"]
    for speaker in speakers:
        speaker.start()
    for speaker in speakers:
        speaker.join()
    sys.setswitchinterval(usual_s)
    said.close()
    assert Counter((tmp_path / "said").read_text().splitlines()) == {name * 40: 2000 for name in "abcd"}
