"""The page of a report in a real browser."""

from pathlib import Path

import browser
import pytest

AXE = Path(browser.__file__).parent / "vendor" / "axe.min.js"

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="needs Chromium (Debian package chromium)")


@pytest.fixture(scope="module")
def opened(exhibits, virtual_page, tmp_path_factory):
    with browser.tab(tmp_path_factory.mktemp("profile")) as tab:
        tab.size(1280, 900)
        tab.open(exhibits.reports / "index.html")
        tab.value("viewer.ready")
        yield tab


def test_the_viewer_shows_every_record_and_no_request_leaves_the_page(opened):
    assert opened.value("viewer.takes.length") == 8
    opened.value("viewer.choose(1)")
    assert opened.value("viewer.figures.length") == 1
    assert {url.split(":")[0] for url in opened.requests} <= {"file", "data", "blob"}
    assert opened.errors == []


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_there_is_no_serious_violation_of_accessibility(opened, width, theme):
    opened.size(width, 900)
    opened.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    opened.value(AXE.read_text(encoding="utf-8"))
    found = opened.value(
        "axe.run().then(found => found.violations.filter(one => ['serious', 'critical'].includes(one.impact))"
        ".map(one => `${one.id}: ${one.nodes.slice(0, 5).map(node => node.html.slice(0, 200)).join(' ')}`))"
    )
    assert found == []
    assert opened.value("document.documentElement.scrollWidth") <= width
