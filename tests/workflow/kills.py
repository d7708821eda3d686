"""Kill the driver with SIGKILL at random moments, resume, and compare the bytes with those of an undisturbed run.

As a script: ``python tests/workflow/kills.py [TIMES]`` (fifty by default), in a temporary folder.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from project import Project, differing

LEAST_S = 2.0
"""A driver needs about this long to plan; earlier kills find no work."""


def kill_and_resume(project: Project, kills: int, seed: int, cores: int = 2) -> int:
    """Run, kill after a random time and start again, ``kills`` times; then run to the end. Return the kills done.

    If a run ends before it is killed, it starts again in an empty folder, so that every kill hits a running workflow.
    """
    moments = random.Random(seed)
    done = 0
    while done < kills:
        with subprocess.Popen(
            project.command(cores=cores),
            env=project.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as driver:
            try:
                driver.wait(timeout=moments.uniform(LEAST_S, 12.0))
            except subprocess.TimeoutExpired:
                os.kill(driver.pid, signal.SIGKILL)
        if driver.returncode == -signal.SIGKILL:
            done += 1
        else:
            subprocess.run(["rm", "-rf", *map(str, project.folder.iterdir())], check=True)
    project.make(cores=cores)
    return done


def main() -> int:
    """Kill as often as the command line says and report whether every byte came out the same."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    with tempfile.TemporaryDirectory() as folder:
        undisturbed, killed = Project(Path(folder, "undisturbed")), Project(Path(folder, "killed"))
        for project in (undisturbed, killed):
            project.folder.mkdir()
        undisturbed.make()
        done = kill_and_resume(killed, times, seed=times)
        wrong = differing(undisturbed.artifacts(), killed.artifacts())
        print(f"{done} kills, {len(undisturbed.artifacts())} artifacts, {len(wrong)} differ {wrong[:5]}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
