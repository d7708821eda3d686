"""Plot time and memory against hours of speech and number of records: python bench/growth.py [--most-hours 100]

Labels and features without sound (as in config/long.yaml) pass through the workflow to the session scores: first of
two actors with four records each of increasing length, then of an increasing number of actors with four records of
one minute. (The time is quadratic in the records of one actor, because leave-one-out has more folds, each trained on
more records.) Finally, the time to plan 10,000 jobs is measured, and that of Snakemake for as many empty jobs. Table
and figure are written to bench/out.
"""

from __future__ import annotations

import argparse
import os
import re
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from runs import OUT, RUN, Took, folder, snakemake

HOURS = (1 / 6, 1 / 2, 3 / 2, 5, 20, 100)
RECORDS = (8, 24, 72)
PLANNED_RECORDS = (2_500, 3_076)
"""Numbers of records that are planned; the second one makes 10,000 jobs."""

BARE = """
rule end:
    input: expand("{{number}}", number=range({number}))
rule step:
    output: "{{number}}"
    log: "logs/{{number}}"
    shell: "touch {{output}}"
"""
"""A number of empty jobs: what planning costs in Snakemake itself."""

EXPONENT_GOAL, PEAK_GOAL_MB, PLANNING_GOAL_S = 1.05, 2048, 25
SCORES = f"results/{RUN}/evaluation/session_scores.parquet"


def config(actors: int, duration_s: float) -> dict[str, Any]:
    """Return a configuration of actors with four records each, without sound and sweep."""
    cast = [
        {"actor": f"a{number}", "voice": ("Female1", "Male1")[number % 2], "records": 4, "duration_s": duration_s}
        for number in range(actors)
    ]
    return {"studio": {"sound": False, "film": False, "actors": cast}, "sweep": {"clusters": [], "states": []}}


def exponent(points: pd.DataFrame, axis: str, measure: str) -> tuple[float, float]:
    """Return the slope of the logarithms over all points, and between the last two, where start-up matters least."""
    size, took = np.log(points[axis]), np.log(points[measure])
    last = np.diff(took.to_numpy()[-2:]) / np.diff(size.to_numpy()[-2:])
    return float(np.polyfit(size, took, 1)[0]), float(last[0])


def figure(table: pd.DataFrame) -> None:
    """Plot processor time and peak memory, with one column for each way to grow."""
    panes, axes = plt.subplots(2, 2, figsize=(9, 6), sharey="row", layout="constrained")
    for column, (axis, label) in enumerate((("hours", "hours of speech"), ("records", "records of a minute"))):
        points = table[table["growing"] == axis]
        for row, (measure, title) in enumerate((("cpu_s", "processor (s)"), ("peak_mb", "peak of a process (MB)"))):
            pane = axes[row, column]
            pane.loglog(points[axis], points[measure], marker="o", color="#2278b5")
            pane.set_xlabel(label)
            pane.grid(visible=True, which="major", color="#dfe3e8")
            if column == 0:
                pane.set_ylabel(title)
            if measure == "cpu_s":
                linear = points[measure].iloc[-1] * points[axis] / points[axis].iloc[-1]
                pane.loglog(points[axis], linear, linestyle="--", color="#6a717b", label="linear")
                pane.legend(frameon=False)
            else:
                pane.axhline(PEAK_GOAL_MB, linestyle="--", color="#6a717b")
    panes.savefig(OUT / "growth.png", dpi=120)


def planning(records: int) -> tuple[int, Took, Took]:
    """Return the number of jobs of a corpus, and the cost of planning them and as many empty jobs."""
    quiet = ("--dry-run", "--quiet", "rules")
    path = folder("planning", config(records // 4, 60))
    ours = snakemake(path, SCORES, *quiet)
    jobs = int(re.search(r"^total +(\d+)", (path / "snakemake.log").read_text(), re.MULTILINE).group(1))
    path = folder("planning_bare", {})
    (path / "Snakefile").write_text(BARE.format(number=jobs - 1))
    return jobs, ours, snakemake(path, *quiet, snakefile=path / "Snakefile")


def main() -> None:
    """Print the table, the exponents, and whether the goals were reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most-hours", type=float, default=5.0)
    parser.add_argument("--most-records", type=int, default=24)
    given = parser.parse_args()
    rows: list[dict[str, object]] = []

    def measure(growing: str, actors: int, duration_s: float) -> None:
        took: Took = snakemake(folder("growth", config(actors, duration_s)), SCORES)
        size = {"hours": actors * 4 * duration_s / 3600, "records": actors * 4}
        rows.append({"growing": growing, **size, **took._asdict(), "load": os.getloadavg()[0]})
        print(f"{size['hours']:8.2f} h {size['records']:5d} records {took.wall_s:9.1f} s {took.cpu_s:9.1f} s of "
              f"processor {took.peak_mb:7.0f} MB   load {os.getloadavg()[0]:.1f}", flush=True)  # fmt: skip

    OUT.mkdir(parents=True, exist_ok=True)
    for hours in HOURS:
        if hours <= given.most_hours:
            measure("hours", 2, hours * 3600 / 8)
    for records in RECORDS:
        if records <= given.most_records:
            measure("records", records // 4, 60)
    table = pd.DataFrame(rows)
    table.to_csv(OUT / "growth.csv", index=False, float_format="%.4g")
    figure(table)
    for axis in ("hours", "records"):
        every, last = exponent(table[table["growing"] == axis], axis, "cpu_s")
        verdict = "reached" if max(every, last) <= EXPONENT_GOAL else "MISSED"
        print(f"exponent against {axis}: {every:.2f} over all, {last:.2f} at last; goal {EXPONENT_GOAL}: {verdict}")
    peak = table["peak_mb"].max()
    print(f"peak of a process: {peak:.0f} MB; goal {PEAK_GOAL_MB}: {'reached' if peak < PEAK_GOAL_MB else 'MISSED'}")
    for records in PLANNED_RECORDS:
        jobs, ours, bare = planning(records)
        print(f"planning {jobs} jobs of {records} records: {ours.wall_s:.1f} s, {ours.cpu_s:.1f} s of processor; "
              f"as many empty jobs: {bare.wall_s:.1f} s, {bare.cpu_s:.1f} s; "
              f"ratio {ours.cpu_s / bare.cpu_s:.2f}, {ours.peak_mb:.0f} MB; "
              f"goal {PLANNING_GOAL_S} s: {'reached' if ours.wall_s <= PLANNING_GOAL_S else 'MISSED'}")  # fmt: skip


if __name__ == "__main__":
    main()
