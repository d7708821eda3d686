"""The temporary files of a killed job are removed, and nothing else."""

import subprocess
import sys

import pytest

from cospeech.data import tables
from cospeech.workflow import leftovers

KILLED = """
import os, signal, sys
from cospeech.data import tables
with tables.replacing(sys.argv[1]) as path:
    path.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("name", ["motion~ada_1.parquet", "ada.TextGrid", "no_suffix", "index.tar.gz"])
def test_what_a_killed_job_left_is_removed_by_the_next_run(tmp_path, name):
    path = tmp_path / "synthesis" / "hsmm" / name
    subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    (left,) = path.parent.iterdir()
    assert tables.is_temporary(left.name)
    kept = [tmp_path / kind for kind in (".lock", ".snakemake_timestamp", "a.parquet", ".a-abcdefgh.parquet", "~a")]
    for one in kept:
        one.touch()
    assert leftovers.remove([tmp_path, tmp_path / "nowhere"]) == 1
    assert sorted(found for found in tmp_path.rglob("*") if found.is_file()) == sorted(kept)
