"""Only one run at a time can hold the lock, and a killed run releases it."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cospeech.errors import UserError
from cospeech.workflow import run_lock

HOLD = """
import sys, time
from pathlib import Path
from cospeech.workflow import run_lock
run_lock.hold(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(60)
"""


def test_a_second_run_is_rejected_until_the_first_is_killed(tmp_path):
    path = tmp_path / ".lock"
    with subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        with pytest.raises(UserError, match="another cospeech run"):
            run_lock.hold(path)
        first.kill()
        first.wait()
    run_lock.hold(path)
    os.close(run_lock._held.pop(path))


def test_a_link_in_place_of_the_lock_is_not_followed(tmp_path):
    precious = tmp_path / "thesis.txt"
    precious.write_text("not to be truncated")
    path = tmp_path / "results" / ".lock"
    path.parent.mkdir()
    path.symlink_to(precious)
    with pytest.raises(UserError, match=r"\.lock: is a symbolic link.*remove it"):
        run_lock.hold(path)
    assert precious.read_text() == "not to be truncated"


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
def test_what_is_no_file_cannot_be_the_lock(tmp_path, make):
    path = tmp_path / ".lock"
    make(path)
    with pytest.raises(UserError, match=r"\.lock: is not an ordinary file"):
        run_lock.hold(path)


def test_a_folder_of_other_files_is_not_taken_for_results(tmp_path):
    path = tmp_path / "results" / ".lock"
    (path.parent / "photos").mkdir(parents=True)
    with pytest.raises(UserError, match="results: contains files, but no results of cospeech"):
        run_lock.hold(path)
    assert not path.exists()
    (path.parent / "logs").mkdir()  # a copy of results without hidden files
    run_lock.hold(path)
    os.close(run_lock._held.pop(path))


@pytest.mark.parametrize("use", [lambda path: run_lock.hold(path / ".lock"), run_lock.check_writable])
def test_results_that_cannot_be_written_are_refused_in_one_line(tmp_path, monkeypatch, use):
    blocked = tmp_path / "results"
    blocked.write_text("")
    with pytest.raises(UserError, match="results: is a file, where a folder of results is needed"):
        use(blocked)
    with pytest.raises(UserError, match="results: is a file, where a folder"):
        use(blocked / "demo")
    blocked.unlink()

    def denied(path, *_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "mkdir", denied)
    with pytest.raises(UserError, match="results: is read-only, or belongs to another user"):
        use(blocked)
