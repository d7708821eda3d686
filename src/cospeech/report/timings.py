"""The time that each rule of a run took, from Snakemake's benchmark files.

Times differ from run to run, so this page is not the output of a rule: it is written at the end of every run, next to
the report, and nothing depends on it.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import jinja2

from cospeech.data import tables


class Row(NamedTuple):
    """What the jobs of one rule took; ``share_pct`` is their share of the time of all jobs."""

    rule: str
    jobs: int
    total_s: float
    mean_s: float
    max_rss_mb: float
    share_pct: float


def rows(benchmarks: Path) -> list[Row]:
    """Return a row for each rule with benchmark files (<rule>.tsv or <rule>/...tsv), the longest first."""
    took: dict[str, list[tuple[float, float]]] = {}
    for path in sorted(benchmarks.rglob("*.tsv")):
        rule = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
        with path.open(newline="", encoding="utf-8") as file:
            for line in csv.DictReader(file, delimiter="\t"):
                took.setdefault(rule, []).append((float(line["s"]), _number(line["max_rss"])))
    whole_s = sum(seconds for jobs in took.values() for seconds, _ in jobs)
    found = []
    for rule, jobs in took.items():
        total_s = sum(seconds for seconds, _ in jobs)
        peak = max(memory for _, memory in jobs)
        found.append(Row(rule, len(jobs), total_s, total_s / len(jobs), peak, 100 * total_s / whole_s))
    return sorted(found, key=lambda row: -row.total_s)


def _number(text: str) -> float:
    """Return a field of a benchmark file; Snakemake writes words if a job was too short to be measured."""
    try:
        return float(text)
    except ValueError:
        return 0.0


def save(benchmarks: Path, reports: Path, template: Path, title: str) -> list[str]:
    """Write ``seconds.html`` and ``tables/table-seconds.csv`` into the folder of a report and return their paths."""
    found = rows(benchmarks)
    table, seconds = reports / "tables" / "table-seconds.csv", reports / "seconds.html"
    with tables.replacing(table) as temporary, temporary.open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row._fields)
        writer.writerows([*row[:2], *(f"{value:.2f}" for value in row[2:])] for row in found)
    page = jinja2.Template(template.read_text(encoding="utf-8"), autoescape=True).render(title=title, rows=found)
    with tables.replacing(seconds) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return [str(table), str(seconds)]
