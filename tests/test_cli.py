"""The command line: what it accepts, how it fails, and what it passes on to Snakemake."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import cospeech
from cospeech import cli
from cospeech.commands import workflow
from cospeech.data import project

COMMANDS = ("report", "sweep", "verify", "run")


@pytest.fixture
def snakemake(monkeypatch):
    """The command lines that Snakemake would have been run with."""
    seen = []
    monkeypatch.setattr(workflow, "_snakemake", lambda arguments: seen.append(arguments) or 0)
    return seen


def exit_of(*arguments):
    """Return the exit status, whether the command returns or the parser stops it."""
    try:
        return cli.main(arguments)
    except SystemExit as ended:
        return ended.code


def test_help_lists_every_command_and_each_explains_its_options(capsys):
    assert exit_of("--help") == 0
    overview = capsys.readouterr().out
    assert re.findall(r"^    (\w+) +\w", overview, re.MULTILINE) == [
        "synthesize",
        "live",
        "library",
        "view",
        "convert",
        "retarget",
        "identity",
        "sync",
        *COMMANDS,
    ]
    assert max(map(len, overview.splitlines())) <= 80
    for command in COMMANDS:
        assert exit_of(command, "--help") == 0
        page = capsys.readouterr().out
        for option in ("--config FILE", "--cores N", "--dry-run"):
            assert option in page, (command, option)


def test_help_names_every_target_of_the_workflow():
    declared = (project.root() / "Snakefile").read_text().partition("localrules:")[2].partition("\n\n")[0]
    targets = {line.strip(" ,") for line in declared.splitlines() if line.strip()}
    assert targets == {"all", "sweep", "verify", *workflow.TARGETS}


def test_version(capsys):
    assert exit_of("--version") == 0
    assert capsys.readouterr().out == f"cospeech {cospeech.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ((), "required: COMMAND"),
        (("repot",), "invalid choice: 'repot'"),
        (("report", "mine.yaml"), "cospeech report: error: unrecognized arguments: mine.yaml"),
        (("report", "--conf", "mine.yaml"), "unrecognized arguments: --conf"),
        (("report", "--quiet"), "unrecognized arguments: --quiet"),
        (("report", "--cores", "0"), "'0' is neither a positive number nor 'all'"),
        (("run",), "required: TARGET"),
        (("run", "--", "annotate"), "required: TARGET"),
    ],
)
def test_a_wrong_call_ends_with_status_2(snakemake, capsys, arguments, complaint):
    assert exit_of(*arguments) == 2
    assert complaint in capsys.readouterr().err
    assert snakemake == []


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "no such file in {folder}; correct the path"),
        ("", "contains no settings"),
        ("- a\n- b\n", "contains no settings"),
        ("run: x\nstudio: [1\n", "line 3: not valid YAML"),
        (b"\xff\xfe\x00", "line 1: not in UTF-8"),
    ],
)
def test_a_wrong_configuration_ends_with_status_1_and_one_line(
    snakemake, capsys, monkeypatch, tmp_path, content, complaint
):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        Path("mine.yaml").write_bytes(content if isinstance(content, bytes) else content.encode())
    assert exit_of("report", "--config", "mine.yaml") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("cospeech: mine.yaml: ")
    assert complaint.format(folder=tmp_path) in line
    assert snakemake == []


def test_a_folder_is_no_configuration(snakemake, capsys, tmp_path):
    assert exit_of("verify", "--config", str(tmp_path)) == 1
    assert capsys.readouterr().err == f"cospeech: {tmp_path}: is a folder; name the configuration file\n"


def test_a_folder_that_is_not_writable_is_refused(snakemake, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert exit_of("report") == 1
    assert f"cospeech: {tmp_path}: this folder is not writable" in capsys.readouterr().err
    assert exit_of("report", "--", "--directory=/elsewhere") == 0
    assert len(snakemake) == 1


def test_options_and_what_follows_two_dashes_reach_snakemake(snakemake, tmp_path):
    config = tmp_path / "mine.yaml"
    config.write_text("run: mine\n")
    snakefile = ["--snakefile", str(project.root() / "Snakefile")]
    own = ["--configfile", str(config), "--cores", "2", "--dry-run", *snakefile]
    given = ["--config", str(config), "--cores", "2", "-n", "--", "--quiet", "progress", "--", "x"]
    assert [exit_of(*call) for call in (["report"], ["report", *given], ["run", "a", "b", *given])] == [0, 0, 0]
    assert snakemake == [
        snakefile,
        [*own, "--quiet", "progress", "--", "x"],
        ["a", "b", *own, "--quiet", "progress", "--", "x"],
    ]
    assert exit_of("sweep", "--cores", "all") == exit_of("verify") == 0
    assert snakemake[3:] == [["sweep", "--cores", "all", *snakefile], ["verify", *snakefile]]


def test_importing_the_command_line_loads_nothing_slow():
    program = "import sys; from cospeech import cli; cli.parser(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.split()
    assert {"numpy", "pandas", "numba", "scipy", "yaml", "snakemake"} & set(loaded) == set()


WHILE_IMPORTING = """
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "snakemake":
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(60)

sys.meta_path.insert(0, Finder())
"""
WHILE_RUNNING = """
def main(arguments):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)
    except KeyboardInterrupt:
        sys.exit(1)

sys.modules["snakemake"] = types.ModuleType("snakemake")
sys.modules["snakemake.cli"] = types.SimpleNamespace(main=main)
"""


@pytest.mark.parametrize("moment", [WHILE_IMPORTING, WHILE_RUNNING])
def test_ctrl_c_ends_with_one_line_and_status_130(tmp_path, moment):
    program = (
        "import os, signal, sys, time, types\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored if the tests run in the background
        f"{moment}\nfrom cospeech import cli\nsys.exit(cli.main(['report']))"
    )
    ended = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, text=True, capture_output=True)
    assert (ended.returncode, ended.stderr) == (130, "cospeech: interrupted\n")
