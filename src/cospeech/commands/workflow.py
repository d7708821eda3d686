"""``cospeech report``, ``sweep``, ``verify`` and ``run``: the workflow, run by Snakemake in the current folder."""

from __future__ import annotations

import argparse
import os
import signal
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from cospeech.data import project
from cospeech.errors import UserError
from cospeech.workflow import config_file

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser

TARGETS = {
    "models": "systems trained on all of an actor's records, for 'cospeech synthesize'",
    "libraries": "motion libraries of the virtual studio without speech, as BVH",
    "annotate": "annotations of all records for ELAN and Praat, to be corrected",
    "markers": "tracked markers and joint angles as TRC, C3D and BVH",
    "survey": "clips of 8 to 12 s for perception studies, without labels",
    "calibration": "camera calibration, also for Pose2Sim and caliscope",
    "quality": "one page per filmed record with the worst moments of tracking",
}
"""The named targets of the Snakefile that have no command of their own."""

SETTINGS = f"""\
The settings are explained in
  {project.root() / "data_schema" / "config.yaml"}
and configurations to start from are in
  {project.root() / "config"}"""

REPORT = """\
Run the workflow, from video and sound to the report.

Everything is written to results/<run> and reports/<run> in the current folder,
where <run> is named by the configuration. Paths in the configuration are
relative to the current folder, too. Only what is missing or out of date
is computed, so an interrupted run continues where it stopped when the command
is given again."""

REPORT_EXAMPLES = f"""\
examples:
  cospeech report                       the demo, with virtual actors
  cospeech report --config mine.yaml    your own corpus
  cospeech report --config mine.yaml -n
                                        list its jobs without running them
  cospeech report -- --quiet progress   pass an option to Snakemake:
                                        print errors only
  cospeech report -- --workflow-profile slurm
                                        submit the jobs to a Slurm cluster

{SETTINGS}"""

SWEEP = """\
Score the synthesis over the numbers of prosody clusters and states that are
listed in the section `sweep` of the configuration, and draw figures 7.2a and
7.2b in reports/<run>/figures."""

VERIFY = """\
Compare every file in results/<run> and reports/<run> with the manifest of the
run, results/<run>/run/manifest.parquet. Files that were changed since the run
wrote them, are missing, were left over from another configuration, or that
no job of the run wrote, are listed, and the exit status is 1."""

RUN = """\
Make one or more targets of the workflow: names from the list below, or paths
of files that the workflow makes.

targets:
""" + "\n".join(f"  {name:<12} {what}" for name, what in TARGETS.items())

RUN_EXAMPLES = f"""\
examples:
  cospeech run annotate --config mine.yaml
  cospeech run results/demo/evaluation/session_scores.parquet

{SETTINGS}"""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the commands that run the workflow."""
    for name, targets, summary, description, epilog in (
        ("report", [], "run the workflow and write the report", REPORT, REPORT_EXAMPLES),
        ("sweep", ["sweep"], "score the synthesis over numbers of clusters and states", SWEEP, SETTINGS),
        ("verify", ["verify"], "check the files of a run for damage", VERIFY, None),
    ):
        _add(commands, name, help=summary, description=description, epilog=epilog).set_defaults(targets=targets)
    other = _add(
        commands, "run TARGET ...", help="make other targets of the workflow", description=RUN, epilog=RUN_EXAMPLES
    )
    other.add_argument("targets", nargs="+", metavar="TARGET", help="what to make")


def _add(commands: argparse._SubParsersAction[Parser], call: str, **texts: Any) -> Parser:
    """Declare a command, which is the first word of ``call``, with the options that all commands here have."""
    options = "[--config FILE] [--cores N] [--dry-run] [-- SNAKEMAKE_ARGUMENT ...]"
    parser = commands.add_parser(call.split()[0], usage=f"cospeech {call} {options}", forwarded="snakemake", **texts)
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="YAML file with the settings that differ from the demo's (default: run the demo)",
    )
    parser.add_argument("--cores", type=_cores, metavar="N", help="number of processor cores to use (default: all)")
    parser.add_argument("-n", "--dry-run", action="store_true", help="list the jobs without running them")
    parser.set_defaults(execute=run)
    return parser


def _cores(text: str) -> str:
    if text != "all" and not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is neither a positive number nor 'all'")
    return text


def run(arguments: argparse.Namespace) -> int:
    """Run the workflow as the command line says and return the exit status."""
    elsewhere = any(argument.partition("=")[0] in ("--directory", "-d") for argument in arguments.snakemake)
    if not elsewhere and not os.access(Path.cwd(), os.W_OK):
        raise UserError(f"{Path.cwd()}: this folder is not writable; run the command where results may be written")
    options = []
    if arguments.config is not None:
        config_file.check(arguments.config)
        options += ["--configfile", str(arguments.config)]
    if arguments.cores is not None:
        options += ["--cores", arguments.cores]
    if arguments.dry_run:
        options.append("--dry-run")
    # Not --configfile last: it takes any number of values, and would take what is forwarded for more of them.
    options += ["--snakefile", str(project.root() / "Snakefile")]
    return _snakemake([*arguments.targets, *options, *arguments.snakemake])


def _snakemake(arguments: list[str]) -> int:
    """Run Snakemake in this process.

    Raises
    ------
    KeyboardInterrupt : after Ctrl-C, which Snakemake itself reports as an ordinary failure once its jobs have ended.
    """
    interrupted = False

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        signal.default_int_handler(number, frame)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where a shell made it ignored
        signal.signal(signal.SIGINT, interrupt)
    from snakemake.cli import main

    try:
        main(arguments)
    except SystemExit as ended:
        if interrupted:
            raise KeyboardInterrupt from None
        return int(ended.code or 0)
    return 0
