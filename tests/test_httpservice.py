"""Sockets that listen for HTTP."""

from __future__ import annotations

import socket

import pytest

from steptwin.httpservice import UNREAD_MS, listen
from steptwin.simulation.toml.addresses import Address


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="only Linux can be asked to end them")
def test_connections_end_whose_other_end_takes_nothing() -> None:
    with listen(Address("127.0.0.1", 0), is_fixed=True) as listening, socket.create_connection(listening.getsockname()):
        accepted, _ = listening.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == UNREAD_MS
