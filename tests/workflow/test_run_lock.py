"""One run at a time, and a killed run leaves no lock behind."""

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


def test_second_holder_is_refused_and_a_killed_one_forgotten(tmp_path):
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
