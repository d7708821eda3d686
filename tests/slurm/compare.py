"""Run the test configuration through a real Slurm and compare every artifact with a local run, byte for byte.

As a script: ``python tests/slurm/compare.py``. Where no Slurm can be started it says why, and that nothing was tried.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from cluster import cluster, obstacle

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
from project import ROOT, Project, differing

LIMIT_S = 1500


def through_slurm(project: Project, partition: str) -> None:
    """Run the test configuration with the profile ``slurm``; one that does not end in time is killed."""
    subprocess.run(
        project.command(
            *("--workflow-profile", str(ROOT / "workflow" / "profiles" / "slurm")),
            *("--slurm-no-account", "--slurm-status-command", "squeue"),
            *("--slurm-init-seconds-before-status-checks", "1", "--seconds-between-status-checks", "1"),
            *("--default-resources", f"slurm_partition={partition}", "mem_mb=1024", "runtime=20"),
            *("--jobs", "20"),
        ),
        env=project.environment, check=True, timeout=LIMIT_S, stdout=subprocess.DEVNULL,
    )  # fmt: skip


def main() -> int:
    """Compare, and report how many artifacts are the same."""
    reason = obstacle()
    if reason:
        print(f"slurm: skipped, nothing was tried: {reason}")
        return 0
    with tempfile.TemporaryDirectory() as folder, cluster() as partition:
        local, remote = Project(Path(folder, "local")), Project(Path(folder, "slurm"))
        for project in (local, remote):
            project.folder.mkdir()
        local.make()
        through_slurm(remote, partition)
        wrong = [*differing(local.artifacts(), remote.artifacts()), *remote.problems()]
        print(f"slurm: {len(local.artifacts())} artifacts, {len(wrong)} differ from a local run {wrong[:5]}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
