"""Paths in a configuration are relative to the working directory, and may contain almost every character."""

from pathlib import Path

import pytest
from snakemake.io import WILDCARD_REGEX
from snakemake.pathvars import PATHVAR_REGEX

from cospeech.errors import MissingFileError, UserError
from cospeech.workflow import paths

ODD = (
    "a b",
    "take (1)",
    "[x]",
    "st*r?",
    "d$llar",
    "q'u\"ote",
    "open{",
    "}{",
    "{}",
    "{a b}",
    "<",
    "<A>",
    "< a>",
    "%s",
    "ü",
)
REPLACED = ("{1}", "{record}", "{ a }", "{a,b}", "{a,x{2}}", "{a.b}", "<x>", "<results>", "{{x}}", "a{ü}")


@pytest.mark.parametrize("name", ODD)
def test_a_path_that_snakemake_leaves_alone_is_kept(name):
    assert paths.plain(f"dir/{name}.bvh", "motion") == f"dir/{name}.bvh"


@pytest.mark.parametrize("name", [*ODD, *REPLACED])
def test_just_what_snakemake_would_replace_is_refused(name):
    replaced = bool(WILDCARD_REGEX.search(name) or PATHVAR_REGEX.search(name))
    assert replaced is (name in REPLACED)
    assert bool(paths.PLACEHOLDER.search(name)) is replaced


@pytest.mark.parametrize("name", REPLACED)
def test_a_placeholder_is_named_in_one_line(name):
    with pytest.raises(UserError, match=r"config: views: .*rename this file or folder") as caught:
        paths.plain(f"films/{name}", "views")
    assert "\n" not in str(caught.value)


def test_redundant_parts_are_left_out():
    assert paths.plain("./a//b/../c.wav", "audio") == "a/b/../c.wav"


def test_a_missing_file_is_looked_for_next_to_the_configuration(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("corpus").mkdir()
    Path("corpus", "a.wav").touch()
    with pytest.raises(MissingFileError) as caught:
        paths.existing("a.wav", "capture.clicks")
    said = paths.explain(caught.value, ["mine.yaml", "corpus/mine.yaml"])
    assert f"config: capture.clicks: no file or folder a.wav in {tmp_path}: paths are relative to the folder" in said
    assert said.endswith("write corpus/a.wav")
    assert paths.explain(caught.value, ["mine.yaml"]).endswith(
        "which is relative to the folder in which the command is run"
    )
    assert paths.existing("corpus/a.wav", "capture.clicks") == "corpus/a.wav"
    assert (
        paths.explain(MissingFileError("/a.wav", "no file /a.wav"), ["x.yaml"]) == "no file /a.wav; correct its path"
    )
    assert paths.explain(UserError("other"), ["x.yaml"]) == "other"
