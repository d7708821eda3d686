"""Changes of style and keywords by Open Sound Control."""

import socket

import pytest
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import build_msg

from cospeech.errors import UserError
from cospeech.live.osc import Messages, changes


def test_messages_become_changes():
    assert list(changes(build_msg("/style", ["energetic", 0.75]).dgram)) == [("style:energetic", 0.75)]
    assert list(changes(build_msg("/style", ["energetic", 1]).dgram)) == [("style:energetic", 1.0)]
    builder = OscBundleBuilder(IMMEDIATELY)
    for word in ("left", "right"):
        builder.add_content(build_msg("/keyword", [word]))
    assert list(changes(builder.build().dgram)) == [("keyword", "left"), ("keyword", "right")]


@pytest.mark.parametrize(
    "packet",
    [
        b"",
        b"no message",
        b"/style\0\0,s\0\0",
        build_msg("/style", ["energetic"]).dgram,
        build_msg("/style", ["energetic", "high"]).dgram,
        build_msg("/style", ["energetic", True]).dgram,
        build_msg("/keyword", [3]).dgram,
        build_msg("/stop", []).dgram,
    ],
)
def test_anything_else_takes_one_line(packet):
    with pytest.raises(UserError, match=r"^OSC: .* send /style .*/keyword.*$"):
        list(changes(packet))


def test_a_listener_yields_what_has_arrived_and_goes_on_after_a_wrong_packet():
    listener = Messages("127.0.0.1", 0)
    port = listener._socket.getsockname()[1]
    assert list(listener.changes()) == []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for packet in (b"wrong", build_msg("/keyword", ["left"]).dgram):
            sender.sendto(packet, ("127.0.0.1", port))
    with pytest.raises(UserError, match="OSC"):
        list(listener.changes())
    assert list(listener.changes()) == [("keyword", "left")]
    with pytest.raises(UserError, match=f"--osc 127.0.0.1:{port}: cannot listen there .*; choose another port"):
        Messages("127.0.0.1", port)
    listener.close()
