"""The page that shows the motion while somebody speaks."""

import json
import struct
import time
from urllib.error import HTTPError
from urllib.request import urlopen

import browser
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from cospeech.errors import UserError
from cospeech.live import web
from cospeech.live.changes import Change
from cospeech.motion.body import STANDARD
from cospeech.synthesis.live import Controls

POSE = np.concatenate([[0.1, 0.2, 0.3], np.tile([1.0, 0, 0, 0], len(STANDARD.joints))])


def free_port():
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def page():
    shown = web.Page(STANDARD, 20.0, Controls(("hello",), ("energetic",)), "127.0.0.1", free_port())
    yield shown
    shown.close()


def socket_of(page, **settings):
    return connect(page.address.replace("http", "ws") + web.SOCKET, **settings)


def wait_for(found):
    end = time.monotonic() + 20
    while time.monotonic() < end:
        if value := found():
            return value
        time.sleep(0.02)
    raise AssertionError("nothing came")


def test_the_page_contains_all_it_needs(page):
    with urlopen(page.address) as answer:
        text = answer.read().decode()
    assert "CospeechViewer.mount" in text
    assert '"styles":["energetic"]' in text
    with pytest.raises(HTTPError, match="404"):
        urlopen(f"{page.address}/other")


def test_frames_arrive_as_they_are_shown(page):
    page.follow(lambda: 12.5)
    with socket_of(page) as socket:
        page.show(7, 0.375, POSE)
        message = socket.recv(timeout=20)
    assert struct.unpack_from("<Id", message) == (7, 12.5)
    np.testing.assert_allclose(np.frombuffer(message, "<f4", offset=12), POSE.astype("<f4"))


def test_a_page_can_ask_for_the_time(page):
    with socket_of(page) as socket:
        before = time.perf_counter()
        socket.send(json.dumps({"asked": 3.5}))
        answer = json.loads(socket.recv(timeout=20))
    assert answer["asked"] == 3.5
    assert before <= answer["now"] <= time.perf_counter()


def test_changes_reach_the_engine_and_nonsense_is_one_line(page):
    with socket_of(page) as socket:
        socket.send(json.dumps({"name": "style:energetic", "value": 0.7}))
        socket.send("nonsense")
        socket.send(json.dumps({"name": "keyword", "value": "hello"}))
        wait_for(lambda: page._changes.qsize() == 3)
    changes = page.changes()
    assert next(changes) == Change("style:energetic", 0.7)
    with pytest.raises(UserError, match="neither a style nor a keyword"):
        next(changes)
    assert list(page.changes()) == [Change("keyword", "hello")]


def test_another_site_cannot_listen(page):
    with pytest.raises(InvalidStatus, match="403"), socket_of(page, origin="http://elsewhere.example"):
        pass


def test_a_port_in_use_is_one_line(page):
    port = int(page.address.rpartition(":")[2])
    with pytest.raises(UserError, match="choose another port"):
        web.Page(STANDARD, 20.0, Controls(), "127.0.0.1", port)


@pytest.mark.skipif(browser.CHROMIUM is None, reason="needs Chromium (Debian package chromium)")
def test_a_browser_shows_the_pose_and_the_delay(page, tmp_path):
    with browser.tab(tmp_path) as tab:
        tab.call("Page.navigate", url=page.address)
        tab.wait("window.viewer !== undefined || typeof viewer !== 'undefined'")
        tab.value("viewer.ready")
        tab.wait("viewer.live && viewer.live.offset !== undefined")
        pose = POSE.copy()
        pose[3 : 3 + 4] = [np.sqrt(0.5), 0, np.sqrt(0.5), 0]
        page.follow(time.perf_counter)
        page.show(3, 0.0, pose)
        tab.wait("viewer.live.frame === 3 && viewer.live.delay.textContent !== ''")
        head = STANDARD.joints.index("head")
        places = STANDARD.world(pose[None, :3], pose[None, 3:].reshape(1, -1, 4))[1][0]
        found = tab.value(f"Array.from(viewer.figures[0].now.place.slice({3 * head}, {3 * head + 3}))")
        np.testing.assert_allclose(found, places[head], atol=1e-4)
        assert 0 < float(tab.value("viewer.live.delay.textContent").split()[-2]) < 10_000
        tab.value("viewer.element.focus()")
        tab.press("1")
        assert wait_for(lambda: list(page.changes())) == [Change("keyword", "hello")]
        assert tab.errors == []
