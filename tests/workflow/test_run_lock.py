"""Only one run at a time can hold the lock, and a killed run releases it."""

import subprocess
import sys

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
    run_lock._held.pop(path).close()
