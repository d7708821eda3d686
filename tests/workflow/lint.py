"""Snakemake's own linter, with two exceptions stated in the open; everything else it says is an error.

- It asks for a conda or container directive in every rule. This project's environment is one hash-locked requirements
  file for all rules (see the README), so that advice is answered once, here.
- It wants functions in a common module. Ours that several rooms ask are in ``common.smk``; an input function that
  serves the rules of one room is in their file.
"""

import subprocess
import sys
from pathlib import Path

EXCUSED = {"Specify a conda environment or container for each rule.", "Mixed rules and functions in same snakefile."}
ROOT = Path(__file__).parents[2]


def findings() -> list[str]:
    """Return what the linter says, a line a finding with its place, without the exceptions."""
    command = [sys.executable, "-m", "snakemake", "--lint", "--configfile", "config/test.yaml"]
    said = subprocess.run(command, cwd=ROOT, text=True, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if "Lints for" not in said.stdout:
        return [said.stdout]
    found, place = [], ""
    for line in said.stdout.splitlines():
        if line.startswith("Lints for"):
            place = line.removeprefix("Lints for ").split(" (")[0].rstrip(":")
        elif line.startswith("    * ") and (title := line[6:].rstrip(":")) not in EXCUSED:
            found.append(f"{place}: {title}")
    return found


if __name__ == "__main__":
    problems = findings()
    print("\n".join(problems) or "snakemake --lint: nothing but the documented exceptions")
    sys.exit(bool(problems))
