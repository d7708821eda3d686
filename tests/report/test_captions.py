"""Captions: one source for the page and for Snakemake's report."""

import html
import re
import warnings

import pytest
from plausible import ROOT

from cospeech.report.page import captions

FILES = sorted((ROOT / "reports/template/captions").glob("*.rst"))


def words(markup):
    """Return the words of some HTML, without its tags."""
    return re.findall(r"\w+", html.unescape(re.sub(r"<[^>]+>", " ", markup)))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_caption_reads_on_the_page_as_docutils_renders_it(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of docutils itself
        from docutils.core import publish_parts

        parts = publish_parts(
            path.read_text(encoding="utf-8"),
            writer_name="html5",
            settings_overrides={"halt_level": 2, "report_level": 2},
        )
    found = captions.read(str(path))
    ours = words(f"{found.title} {found.body} From {found.source}")
    theirs = words(parts["body"])

    assert ours == theirs


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_caption_opens_with_a_sentence_of_its_own(path):
    found = captions.read(str(path))
    assert re.fullmatch(r"<p>[A-Z].*", found.body, flags=re.DOTALL)
    assert found.source.startswith("<code>")
    assert "{" not in path.read_text(encoding="utf-8")  # Snakemake would take it for a template


def test_markup():
    assert (
        captions.inline("a *b* **c** ``d/*.e`` <f>") == "a <em>b</em> <strong>c</strong> <code>d/*.e</code> &lt;f&gt;"
    )


def test_a_caption_without_title_or_source_is_refused(tmp_path):
    (tmp_path / "x.rst").write_text("No title.\n\nFrom ``a``.\n", encoding="utf-8")
    with pytest.raises(ValueError, match="a caption opens with its title in bold"):
        captions.read(str(tmp_path / "x.rst"))
