"""User errors are reported in one line, defects keep their traceback, and the settings hash is well defined."""

import subprocess
import sys
from types import SimpleNamespace

import pandas as pd
import pytest

from cospeech.data import segments
from cospeech.workflow import job

PROGRAM = """
from types import SimpleNamespace
from cospeech.workflow import job
from cospeech.errors import UserError
class Params(dict): pass
snakemake = SimpleNamespace(
    log=[{log!r}], rule="prosody", input=None, output=[], wildcards={{}},
    params=Params(corpus="virtual", code="x"),
)
with job.run(snakemake) as work:
    work.say("began")
    {body}
"""


def run(tmp_path, body):
    log = tmp_path / "logs" / "a.log"
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(log=str(log), body=body)],
        capture_output=True,
        text=True,
        check=False,
    )
    return ended, log.read_text()


def test_a_user_error_is_reported_in_one_line(tmp_path):
    ended, log = run(tmp_path, "raise UserError('a.wav: holds no sound; record it again')")
    assert ended.returncode == 1
    assert ended.stderr == "cospeech: prosody: a.wav: holds no sound; record it again\n"
    assert log == "began\nERROR prosody: a.wav: holds no sound; record it again\n"


def test_a_defect_keeps_its_traceback_in_the_log(tmp_path):
    ended, log = run(tmp_path, "1 / 0")
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "ZeroDivisionError" in ended.stderr
    assert "Traceback" in log


def test_a_full_disk_is_reported_in_one_line(tmp_path):
    ended, _ = run(tmp_path, "raise OSError(28, 'No space left on device', 'x.mp4')")
    assert ended.stderr == "cospeech: prosody: the disk is full (x.mp4); free some space and run again\n"


def test_success_is_silent(tmp_path):
    ended, log = run(tmp_path, "pass")
    assert (ended.returncode, ended.stderr, log) == (0, "", "began\n")


@pytest.mark.parametrize(("other", "same"), [({"a": 1, "code": "2"}, True), ({"a": 2, "code": "1"}, False)])
def test_the_settings_hash_does_not_depend_on_the_code(other, same):
    assert (job.settings_hash({"a": 1, "code": "1"}) == job.settings_hash(other)) is same


def test_several_tables_are_read_and_written_as_one(tmp_path):
    class Params(dict):
        pass

    work = job.Job(
        SimpleNamespace(input=None, output=[], wildcards={}, rule="any", params=Params(corpus="virtual", code="x"))
    )
    parts = [segments.from_starts(record, [0, 3], ["rest", "open"], 7, 20.0) for record in ("a", "b")]
    whole, first = str(tmp_path / "whole.parquet"), str(tmp_path / "first.parquet")
    work.write(parts, whole, "segments")
    work.write(parts[0], first, "segments")
    pd.testing.assert_frame_equal(work.read(whole, "segments"), pd.concat(parts, ignore_index=True))
    assert work.read([first, whole], "segments")["record"].tolist() == ["a", "a", "a", "a", "b", "b"]
    assert work.read([first], "segments").index.tolist() == [0, 1]
