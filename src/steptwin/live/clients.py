"""The TCP clients of a process and their limit."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from steptwin.access.notices import ClientNotices
from steptwin.simulation.toml.addresses import Address

BACKLOG = 1024
RETRY_S = 1.0
"""Pause before the next client is accepted if the system has no room for one more, s."""


class Client(Protocol):
    @property
    def waiting(self) -> int:
        """Number of bytes for which the client has no room."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes; those without room wait."""
        ...

    def close(self) -> None: ...


def _unnoticed(text: str) -> None:
    """For shells without an observer."""


@dataclass(slots=True)
class Clients:
    """All TCP clients of a process. Every one is an open file, so there is a limit: ``most``.

    ``notice`` is called for clients that were refused or closed because of invalid data.
    """

    most: int = 65536
    notice: Callable[[str], None] = _unnoticed
    present: set[Client] = field(default_factory=set)
    _notices: ClientNotices = field(init=False)

    def __post_init__(self) -> None:
        self._notices = ClientNotices(self.notice, time.monotonic_ns)

    def have_room(self) -> bool:
        """Whether one more client may connect; if not, a notice is given."""
        if len(self.present) < self.most:
            return True
        self.tell("", f"more than {self.most} clients at once are turned away")
        return False

    def made_no_sense(self, peer: Address, why: str) -> None:
        self.tell(peer.host, f"client {peer}: {why}; its connection is closed")

    def tell(self, host: str, text: str) -> None:
        """Give a notice about a client at ``host``, or about all of them, unless there have been too many."""
        self._notices.say(host, text)


def listening(address: Address) -> socket.socket:
    """A listening socket. Raises `OSError`, or `UnicodeError` for an invalid host name."""
    family = socket.getaddrinfo(*address, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
    listener = socket.create_server(address, family=family, backlog=BACKLOG)
    listener.setblocking(False)
    set_up(listener)  # what is accepted inherits it on Linux
    return listener


def is_taken(address: Address) -> bool:
    """Whether others listen there, or nobody may."""
    try:
        listening(address).close()
    except OSError:
        return True
    return False


def set_up(connection: socket.socket) -> None:
    """Set options of a socket: send small answers at once, detect lost clients."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
