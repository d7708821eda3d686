"""One run at a time, and a killed run leaves no lock behind."""

import subprocess
import sys

import pytest

from cospeech import alone
from cospeech.errors import UserError

HOLD = """
import sys, time
from pathlib import Path
from cospeech import alone
alone.hold(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(60)
"""


def test_second_holder_is_refused_and_a_killed_one_forgotten(tmp_path):
    path = tmp_path / ".lock"
    with subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        with pytest.raises(UserError, match="another cospeech run"):
            alone.hold(path)
        first.kill()
        first.wait()
    alone.hold(path)
    alone._held.pop(path).close()
