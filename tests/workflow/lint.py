"""Snakemake's own linter, with one exception stated in the open.

The linter asks for a conda or container directive in every rule. This project's environment is one hash-locked
requirements file for all rules (see the README), so that advice is answered once, here, and nothing else is excused.
"""

import json
import subprocess
import sys
from pathlib import Path

EXCUSED = {"Specify a conda environment or container for each rule.", "No log directive defined"}
WITHOUT_LOG = {"all", "sweep", "annotate"}  # targets only: they run nothing
ROOT = Path(__file__).parents[2]


def findings() -> list[str]:
    """Return what the linter says of the Snakefile and of each rule, without the exception."""
    command = [sys.executable, "-m", "snakemake", "--lint", "json", "--configfile", "config/test.yaml"]
    said = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout)
    found = []
    for place in [*said.get("rules", []), *said.get("snakefiles", [])]:
        for lint in place["lints"]:
            target_only = lint["title"] == "No log directive defined" and place.get("for") in WITHOUT_LOG
            if lint["title"] != "Specify a conda environment or container for each rule." and not target_only:
                found.append(f"{place.get('rule', place.get('snakefile'))}: {lint['title']}")
    return found


if __name__ == "__main__":
    problems = findings()
    print("\n".join(problems) or "snakemake --lint: nothing but the documented exception")
    sys.exit(bool(problems))
