"""Sockets that listen for HTTP."""

from __future__ import annotations

import socket

import pytest

from steptwin.httpservice import listen
from steptwin.simulation.toml.addresses import Address


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="only Linux has this time-out")
def test_a_download_may_pause_for_long() -> None:
    with listen(Address("127.0.0.1", 0), is_fixed=True) as listening, socket.create_connection(listening.getsockname()):
        accepted, _ = listening.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 0  # the system's own: none
