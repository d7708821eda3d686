"""A page that shows the motion while somebody speaks, in the 3D viewer, and on which styles and gestures are chosen.

The page and its websocket are on one port. Frames are sent as they are made: the number of the frame, the time when
the sound that completed it arrived, and the pose. A page that is too slow gets the newest frame and misses others.
The page compares its clock with ours to tell the delay from sound to picture.
"""

from __future__ import annotations

import json
import logging
import queue
import struct
import threading
import time
from collections.abc import Callable, Iterator
from http import HTTPStatus

import numpy as np
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve
from websockets.typing import Origin

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.live.changes import Change
from cospeech.motion.body import STANDARD, Body
from cospeech.synthesis.live import Controls
from cospeech.viewer import page

HOST = "127.0.0.1"
"""Address at which the page is served unless the user names another one: this machine only."""

SOCKET = "/motion"
"""Path of the websocket."""

HEADER = struct.Struct("<Id")
"""What precedes a pose: number of the frame, and time of arrival of its sound in seconds."""

WAIT_S = 0.5
"""Longest time in seconds that a connection waits for a frame before it looks whether the page has gone."""

log = logging.getLogger("cospeech.web")
log.setLevel(logging.CRITICAL)  # a page that is closed while it loads is no error of the user


class Page:
    """Serves the page; an output of the engine (see ``outputs.Output``) and a listener (see ``changes.Listener``).

    Parameters
    ----------
    body, fps : the body that moves, and its frame rate.
    controls : the styles and keywords that the page offers.
    host, port : address at which the page is served.

    Raises
    ------
    UserError : if the port is in use, or this machine does not have the address.
    """

    in_real_time = True

    def __init__(self, body: Body, fps: float, controls: Controls, host: str, port: int) -> None:
        self.address = f"http://{host}:{port}"
        self._content = page.live_page(body, fps, controls.styles, controls.keywords, SOCKET, body is STANDARD)
        self._newest: bytes | None = None
        self._came = threading.Condition()
        self._closed = False
        self._changes: queue.SimpleQueue[str | bytes] = queue.SimpleQueue()
        self._arrived: Callable[[], float] = time.perf_counter
        self._server = self._serve(host, port)
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
        self._thread.start()

    def _serve(self, host: str, port: int) -> Server:
        same: list[Origin | None] = [Origin(f"http://{name}:{port}") for name in {host, "localhost", HOST}]
        try:
            return serve(
                self._talk, host, port, process_request=self._answer, origins=[*same, None], compression=None,
                logger=log,
            )  # fmt: skip
        except OSError as error:
            raise UserError(
                f"--web {host}:{port}: cannot serve there ({error.strerror}); choose another port"
            ) from error

    def follow(self, arrived: Callable[[], float]) -> None:
        """Learn how to ask when the sound that is processed arrived, as ``time.perf_counter`` tells it."""
        self._arrived = arrived

    def show(self, frame: int, time_s: float, pose: Floats) -> None:
        """Send a frame to every page that is open."""
        message = HEADER.pack(frame, self._arrived()) + np.asarray(pose, dtype="<f4").tobytes()
        with self._came:
            self._newest = message
            self._came.notify_all()

    def changes(self) -> Iterator[Change]:
        """Yield the changes that were chosen on a page.

        Raises
        ------
        UserError : if a page sends something else. The next call continues with what came after it.
        """
        while not self._changes.empty():
            yield _change(self._changes.get())

    def close(self) -> None:
        """Close the page's connections and stop serving; the engine calls it as an output and as a listener."""
        if self._closed:
            return
        with self._came:
            self._closed = True
            self._came.notify_all()
        self._server.shutdown()
        self._thread.join()

    def _answer(self, _: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page itself; None leaves it to the websocket."""
        if request.path == SOCKET:
            return None
        if request.path != "/":
            return _response(HTTPStatus.NOT_FOUND, "text/plain", "There is only one page, at /.\n")
        return _response(HTTPStatus.OK, "text/html", self._content)

    def _talk(self, connection: ServerConnection) -> None:
        """Send frames to one page until it or the engine has gone; what it sends meanwhile is read in a thread."""
        reader = threading.Thread(target=self._listen, args=(connection,), daemon=True)
        reader.start()
        sent: bytes | None = None
        try:
            while reader.is_alive() and not self._closed:
                message = self._next(sent)
                if message is not sent and message is not None:
                    connection.send(message)
                    sent = message
        except ConnectionClosed:
            return

    def _next(self, sent: bytes | None) -> bytes | None:
        """Return the newest message, once it is another one than ``sent``, or after ``WAIT_S``."""
        with self._came:
            self._came.wait_for(lambda: self._closed or self._newest is not sent, WAIT_S)
            return self._newest

    def _listen(self, connection: ServerConnection) -> None:
        """Answer questions for the time, and keep changes for the engine."""
        for message in connection:
            received = time.perf_counter()
            asked = _asked(message)
            if asked is None:
                self._changes.put(message)
            else:
                connection.send(json.dumps({"asked": asked, "now": received}))


def _response(status: HTTPStatus, kind: str, text: str) -> Response:
    body = text.encode()
    headers = Headers([("Content-Type", f"{kind}; charset=utf-8"), ("Content-Length", str(len(body)))])
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)


def _fields(message: str | bytes) -> dict[str, object]:
    try:
        found = json.loads(message)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _asked(message: str | bytes) -> float | None:
    """Return the time on the page's clock at which it asked for ours; None if it did not ask."""
    found = _fields(message).get("asked")
    return float(found) if isinstance(found, (int, float)) else None


def _change(message: str | bytes) -> Change:
    fields = _fields(message)
    name, value = fields.get("name"), fields.get("value")
    if name == "keyword" and isinstance(value, str):
        return Change(name, value)
    if isinstance(name, str) and name.startswith("style:") and isinstance(value, (int, float)):
        return Change(name, float(value))
    raise UserError(f"a page sent {str(message)[:80]!r}, which is neither a style nor a keyword")
