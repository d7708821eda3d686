"""A whole run that identifies speakers, and commands on films."""

import re

import pandas as pd
import pytest
import yaml
from project import Project

from cospeech import cli

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("identity")]

TINY = {
    "run": "tiny",
    "studio": {"population": {"speakers": 4, "repetitions": 3, "others": 2, "film": False, "sound": False}},
    "identity": {
        "population": True,
        "thresholds": [0.0, 0.6],
        "controls": ["whitened"],
        "eer_shifts_ms": [0, 40],
        "delay": {"samples": 20, "mismatches": 19},
        "word_models": {"states": 3, "iterations": 3},
        "populations": {"number": 2, "speakers": 3, "threshold": 0.6},
    },
    "evaluation": {"bootstrap": {"samples": 100}},
}


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    project = Project(tmp_path_factory.mktemp("identity"))
    (project.folder / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    project.make(config=project.folder / "tiny.yaml")
    return project


def test_the_report_has_every_exhibit_and_says_first_whether_fusion_gains(project):
    page = (project.folder / "reports/tiny/index.html").read_text(encoding="utf-8")
    for name in ("fig-2.1", "fig-2.2", "table-2.1", "table-2.2", "controls", "det", "gains"):
        assert f'id="identity-{name}"' in page
    first = re.search(r'<ul class="findings">\s*<li><strong>(.*?)</strong>', page)[1]
    assert "fusion" in first.lower()
    assert "virtual: nobody was recorded" in page


def test_trials_and_rates_are_complete(project):
    folder = project.folder / "results/tiny/identity"
    trials = pd.read_parquet(folder / "trials.parquet")
    assert set(trials["session"]) == {"1", "2", "3", "4"}
    assert set(trials["condition"]) == {"paired", "whitened", "tested clips too"}
    rates = pd.read_parquet(folder / "equal_error_rates.parquet")
    assert rates["eer_pct"].between(0, 100).all()
    assert set(pd.read_parquet(folder / "gains.parquet")["populations"]) == {2}


def test_a_second_run_has_nothing_to_do(project):
    assert project.planned(config=project.folder / "tiny.yaml") == set()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["sync", "none.mp4"], "none.mp4"),
        (["identity", "identify", "x.mp4", "--model", "nowhere"], "nowhere: contains no identity_speakers.parquet"),
        (["identity", "enrol", "none.csv", "--out", "new"], "none.csv"),
    ],
)
def test_bad_input_of_commands_ends_in_one_line(arguments, complaint, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 1
    said = capsys.readouterr().err.strip()
    assert said.startswith("cospeech: ")
    assert complaint in said
    assert "\n" not in said


@pytest.mark.parametrize(
    "arguments",
    [
        ["sync", "a.mp4", "--longest", "9"],
        ["sync", "a.mp4", "--mouth", "3"],
        ["identity", "identify", "a.mp4", "--model", "m", "--false-accept", "0"],
    ],
)
def test_impossible_options_are_refused(arguments):
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert ended.value.code == 2
