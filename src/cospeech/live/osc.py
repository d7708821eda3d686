"""Changes while motion is made: messages of Open Sound Control, ``/style <name> <value>`` and ``/keyword <word>``."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from pythonosc.osc_packet import OscPacket, ParseError

from cospeech.errors import UserError
from cospeech.live.changes import Change

LARGEST_BYTES = 65536
"""Size of the largest UDP packet."""


class Messages:
    """Listens for messages; see ``changes.Listener``.

    Parameters
    ----------
    host, port : address to listen at.

    Raises
    ------
    UserError : if the port is in use, or this machine does not have the address.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
        except OSError as error:
            raise UserError(f"--osc {host}:{port}: no such address ({error.strerror}); correct it") from error
        self._socket.setblocking(False)
        try:
            self._socket.bind(address)
        except OSError as error:
            self._socket.close()
            raise UserError(
                f"--osc {host}:{port}: cannot listen there ({error.strerror}); choose another port"
            ) from error

    def changes(self) -> Iterator[Change]:
        """Yield the changes that have arrived.

        Raises
        ------
        UserError : if a message is neither. The next call continues with the messages after it.
        """
        while True:
            try:
                packet = self._socket.recv(LARGEST_BYTES)
            except OSError:  # none has arrived
                return
            yield from changes(packet)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def changes(packet: bytes) -> Iterator[Change]:
    """Yield the changes in a packet.

    Raises
    ------
    UserError : if it contains something else.
    """
    try:
        messages = [timed.message for timed in OscPacket(packet).messages]
    except ParseError as error:
        raise UserError("OSC: a packet is not a message of Open Sound Control; send /style or /keyword") from error
    for message in messages:
        match message.address, *message.params:
            case "/style", str(name), int(value) | float(value) if not isinstance(value, bool):
                yield Change(f"style:{name}", float(value))
            case "/keyword", str(word):
                yield Change("keyword", word)
            case _:
                given = " ".join(map(str, message.params))[:40]
                raise UserError(
                    f"OSC: '{message.address[:40]} {given}' is unknown; send /style with a name and a number, or "
                    "/keyword with a word"
                )
