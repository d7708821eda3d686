"""Running the workflow in a folder of its own, as a user would."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from cospeech.workflow import manifest, receipts

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Project:
    """A folder that results are written to, and the copy of the program that writes them.

    ``packages`` are folders with packages that the program finds as if they were installed.
    """

    folder: Path
    program: Path = ROOT
    packages: tuple[Path, ...] = ()

    def command(
        self, *arguments: str, config: str | Path = ROOT / "config" / "test.yaml", cores: int = 2
    ) -> list[str]:
        return [
            *(sys.executable, "-m", "snakemake", *arguments),
            *("--snakefile", str(self.program / "Snakefile"), "--directory", str(self.folder)),
            *("--configfile", str(config), "--cores", str(cores)),
        ]

    @property
    def environment(self) -> dict[str, str]:
        folders = [self.program / "src", *self.packages]
        return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, folders)), "PYTHONWARNINGS": "ignore"}

    def run(self, *arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
        """Run Snakemake to its end and return what it said (stdout and stderr together)."""
        return subprocess.run(
            self.command(*arguments, **options),  # type: ignore[arg-type]
            env=self.environment, text=True, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip

    def make(self, *arguments: str, **options: object) -> str:
        """Run Snakemake, which must succeed, and return what it said."""
        ended = self.run(*arguments, **options)
        assert ended.returncode == 0, ended.stdout[-4000:]
        return ended.stdout

    def planned(self, *arguments: str, **options: object) -> set[str]:
        """Return the names of the rules that a dry run would run."""
        said = self.make("--dry-run", *arguments, **options)
        stats = said.partition("Job stats:")[2].partition("\ntotal ")[0]
        counts = [line.split() for line in stats.splitlines()]
        return {words[0] for words in counts if len(words) == 2 and words[1].isdigit()} - {"all"}

    def artifacts(self) -> dict[str, bytes]:
        """Return the bytes of every table, figure, body and film that the run made, by path, but for its times."""
        kinds = {".parquet", ".svg", ".png", ".csv", ".html", ".bvh", ".wav", ".mp4", ".eaf", ".TextGrid"}
        found = [path for top in ("results", "reports") for path in sorted((self.folder / top).rglob("*"))]
        return {
            str(path.relative_to(self.folder)): path.read_bytes()
            for path in found
            if path.suffix in kinds and path.stem not in {"seconds", "table-seconds", "manifest"}
        }

    def problems(self, run: str = "test") -> list[str]:
        """Return what differs from the manifest of a run."""
        with contextlib.chdir(self.folder):
            known = receipts.load(Path("results", run))
            return manifest.problems([Path("results", run), Path("reports", run)], known, known)


def differing(one: dict[str, bytes], other: dict[str, bytes]) -> list[str]:
    """Return the artifacts that only one run has, or that differ in any byte."""
    return sorted(path for path in one.keys() | other.keys() if one.get(path) != other.get(path))
