"""``steptwin bridge``: devices that are not there yet."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.live.bridge import open_device
from steptwin.live.devicefile import DeviceSpec
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.server import Server

TABLE = DeviceSpec(name="table", address="/dev/ttyUSB0")


class Connections:
    """Opening fails with each of ``errors`` first."""

    def __init__(self, *errors: SteptwinError) -> None:
        self.errors = list(errors)
        self.opened: list[tuple[float, str, str]] = []

    async def open(self, address: str, name: str) -> None:
        if self.errors:
            raise self.errors.pop(0)
        self.opened.append((asyncio.get_running_loop().time(), address, name))


def test_a_device_that_is_away_is_waited_for(run: Any) -> None:
    told: list[str] = []
    connections = Connections(LineFailure("no such port"), LineFailure("no answer"), LineFailure("no answer"))
    run(open_device(cast("Any", connections), TABLE, told.append))
    assert connections.opened == [(3.5, "/dev/ttyUSB0", "table")], "0.5, 1 and 2 s later"
    assert told == ["table: no such port; nothing is served before it is there", "table: it is there"]


def test_an_address_that_is_wrong_is_not_waited_for(run: Any) -> None:
    with pytest.raises(Misuse, match="not an address"):
        run(open_device(cast("Any", Connections(Misuse("not an address"))), TABLE, lambda text: None))


def test_a_server_ends_while_it_waits(run: Any, make_realtime: Any) -> None:
    async def story() -> list[object]:
        realtime: RealTimeDriver = make_realtime()[0]
        server = Server(realtime, lambda text: None)
        found: list[object] = [await server.unless_ended(open_device(cast("Any", Connections()), TABLE, server.notice))]
        asyncio.get_running_loop().call_later(1.0, server.end)
        away = cast("Any", Connections(*[LineFailure("no answer")] * 9))
        found.append(await server.unless_ended(open_device(away, TABLE, server.notice)))
        found.append(asyncio.get_running_loop().time())
        await server.close()
        return found

    assert run(story()) == [True, False, 1.0]
