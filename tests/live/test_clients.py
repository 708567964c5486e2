"""The clients of a process together."""

from __future__ import annotations

from steptwin.access.notices import AT_ONCE
from steptwin.live.clients import Clients
from steptwin.simulation.toml.addresses import Address


def test_clients_that_make_no_sense_do_not_fill_the_log() -> None:
    told: list[str] = []
    clients = Clients(0, told.append)
    for port in range(1000):
        clients.made_no_sense(Address("192.0.2.7", port), f"MBAP length {port} is outside 2 to 260 bytes")
        assert not clients.have_room()
    assert len(told) == 2 * AT_ONCE
    clients.made_no_sense(Address("192.0.2.8", 1), "MBAP protocol 7 is not 0")
    assert told[-1] == "client 192.0.2.8:1: MBAP protocol 7 is not 0; its connection is closed"
