"""How the processes of jobs start and end."""

import os
import signal
import subprocess
import sys

SNAKEFILE = """
import sys
from cospeech.workflow import processes
sys.executable = {python!r}
processes.prepare()
onstart:
    processes.end_on_interrupt()
rule all:
    output: "out.txt"
    script: "job.py"
"""


def start(folder, job, python=sys.executable):
    """Start a workflow of one job, a script, in a process group of its own, as a terminal does."""
    (folder / "Snakefile").write_text(SNAKEFILE.format(python=str(python)))
    (folder / "job.py").write_text(job)
    return subprocess.Popen(
        [sys.executable, "-m", "snakemake", "--cores", "1", "--logger", "cospeech"],
        cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip


def test_a_job_starts_where_python_lies_in_a_folder_with_spaces(tmp_path):
    folder = tmp_path / "x y (1)"
    folder.mkdir()
    interpreter = folder / "python"
    interpreter.symlink_to(sys.executable)
    with start(folder, "open(snakemake.output[0], 'w').write('made')\n", interpreter) as run:
        said = run.communicate()[0]
    assert run.returncode == 0, said
    assert (folder / "out.txt").read_text() == "made"


def test_ctrl_c_ends_jobs_at_once_and_without_their_tracebacks(tmp_path):
    job = "import time\nprint('working', flush=True)\ntime.sleep(600)\n"
    with start(tmp_path, job) as run:
        assert run.stdout is not None
        said = []
        for line in run.stdout:
            said.append(line)
            if line == "working\n":
                os.killpg(run.pid, signal.SIGINT)
    assert run.returncode != 0
    assert said.index("working\n") >= len(said) - 4, said
    assert "Traceback" not in "".join(said)
    assert "Error in rule" not in "".join(said)
