"""The page: self-contained, honest about what it shows, fit for a screen reader."""

import html.parser
import itertools
import re
from pathlib import Path

import pytest

from cospeech.report.exhibits import EXHIBITS

VOID = {"meta", "br", "img", "link", "input", "hr"}


class Reader(html.parser.HTMLParser):
    """Reads a page strictly: every tag closed in order, attributes kept."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.tags, self.words = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "title", "script"):
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    def of(self, name):
        return [attrs for tag, attrs in self.tags if tag == name]


@pytest.fixture(scope="session")
def virtual(virtual_page):
    return Reader(virtual_page)


@pytest.fixture(scope="session")
def real(real_page):
    return Reader(real_page)


def test_nothing_is_loaded_from_elsewhere(virtual_page, real_page):
    for text in (virtual_page, real_page):
        plain = re.sub(r'xmlns(:\w+)?="http://www\.w3\.org/[^"]+"', "", text)
        plain = plain.replace('"http://www.w3.org/1999/xhtml"', "")  # the name of a language, in three.js
        assert "http:" not in plain
        assert "https:" not in plain
        assert "<script src" not in plain
        assert "@import" not in plain
        for address in re.findall(r'(?:src|poster)="([^"]{0,40})', plain):
            assert address.startswith("data:")


def test_links_lead_somewhere(virtual, exhibits):
    links = [attrs["href"] for attrs in virtual.of("a")]
    anchors = {attrs["id"] for _, attrs in virtual.tags if "id" in attrs}
    assert len(links) > 30
    for link in links:
        if link.startswith("#"):
            assert link[1:] in anchors
        elif link != "seconds.html":  # which the run writes when it has ended
            assert (exhibits.reports / link).resolve().is_file(), link


def test_ids_are_unique(virtual):
    ids = [attrs["id"] for _, attrs in virtual.tags if "id" in attrs]
    assert len(ids) == len(set(ids))


def test_every_reference_inside_a_picture_has_its_target(virtual_page):
    ids = set(re.findall(r'\bid="([^"]+)"', virtual_page))
    wanted = set(re.findall(r"url\(#([^)]+)\)", virtual_page)) | set(
        re.findall(r'xlink:href="#([^"]+)"', virtual_page)
    )
    assert wanted
    assert wanted <= ids


def test_the_page_says_that_a_corpus_is_virtual_before_any_number(virtual):
    text = virtual.text
    assert "Everything here is virtual: nobody was recorded." in text
    assert text.index("Everything here is virtual") < text.index("In short")
    assert "They say nothing about people" in text
    assert "filmed by 5 virtual cameras at 696 x 520 pixels and 20 frames/s" in text
    assert "were computed from these films, with the robust tracker" in text


def test_the_page_says_that_a_corpus_is_real_before_any_number(real):
    text = real.text
    assert "Real recordings: the corpus “beat2”." in text
    assert text.index("Real recordings") < text.index("In short")
    assert "filmed by" not in text
    assert "virtual" not in text.lower().split("how it was made")[0].replace("virtual studio", "")


def test_the_notes_of_records_are_shown(virtual):
    assert "Notes on the records" in virtual.text
    assert "mixed down to <mono> ada_2, ada_3, ada_4, deniz_1, deniz_2, deniz_3, deniz_4" in virtual.text


def test_a_screen_reader_can_follow(virtual):
    for attrs in virtual.of("svg"):
        assert attrs["role"] == "img"
        assert attrs["aria-label"]
    for attrs in virtual.of("video"):
        assert attrs["aria-label"]
        assert "controls" in attrs
    for attrs in virtual.of("th"):
        assert attrs["scope"] in ("row", "col", "colgroup")
    assert virtual.of("html") == [{"lang": "en"}]
    levels = [int(tag[1]) for tag, _ in virtual.tags if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))


def test_every_exhibit_is_there_and_names_its_tables(virtual):
    names = {attrs["id"] for attrs in virtual.of("figure") if "id" in attrs}
    assert names == {exhibit.name for exhibit in EXHIBITS}
    assert virtual.text.count("· from ") == len(names)


def test_published_values_are_next_to_ours(virtual):
    for value in ("0.8313", "1.0714 s (at 8)", "about 2 hours"):
        assert value in virtual.text


def test_videos_play_from_the_page(virtual_page, virtual):
    films = virtual.of("video")
    assert len(films) == 9
    assert all(film["src"].startswith("data:video/mp4;base64,") for film in films)
    assert all(film["poster"].startswith("data:image/jpeg;base64,") for film in films)
    assert len(virtual_page.encode()) < 25_000_000


def test_what_a_run_lacks_is_left_out_with_a_reason(real):
    names = {attrs["id"] for attrs in real.of("figure") if "id" in attrs}
    assert not names & {"fig-4.3", "fig-6.3", "fig-6.4", "fig-motion", "table-motion-quality", "fig-recovery"}
    assert real.of("video") == []
    absent = "fig-6.4, fig-motion, table-motion-quality, fig-6.3, fig-4.3 and videos"
    assert f"{absent}: the corpus has gesture labels but no motion." in real.text
    assert "table-capture and fig-rig: there are no films." in real.text
    assert "System nodding failed: system 'nodding' of package 'nods': ImportError: no module 'neck'" in real.text
    assert 'href="#watch"' not in str(real.of("a"))


def test_figures_follow_the_theme(virtual_page):
    drawn = "".join(re.findall(r"<svg.*?</svg>", virtual_page, flags=re.DOTALL))
    assert "var(--ink)" in drawn
    for colour in ("#22262b", "#dfe3e8", "#fffffe"):
        assert colour not in drawn


def test_the_same_run_gives_the_same_bytes(exhibits, virtual_page):
    from conftest import make_page

    assert make_page(exhibits, "again.html") == virtual_page
    Path(exhibits.reports, "again.html").unlink()
