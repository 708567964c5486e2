"""A chip made ready for a line that is open already, for programs that type by themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486.lines import TALK, talking
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.m1486.unit import ChipUnit
from steptwin.drivers.place import Channel
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos

TIMEOUT_NS: Nanos = 500 * MILLISECOND


def wake(channel: Channel, place: str, address: int | None, baud: int, log: Callable[[str], object] | None = None) -> None:
    """End what may stand in front of the next command, switch function 41 (echo) on, select the chip; each verified by the echo.

    Raises `NoEcho` when it is not there, moves or runs a program. ``channel`` stays open.
    """
    endpoint = _Opened(channel, place)
    exchanger, talk = talking(endpoint, baud, log)
    line: ThreadLine[ChipRequest, bytes] = ThreadLine(endpoint, exchanger)
    line.notes[TALK] = talk
    finish(line.open())
    finish(ChipUnit(line, address, timeout_ns=TIMEOUT_NS).wake())


class _Opened:
    """An endpoint whose channel exists."""

    def __init__(self, channel: Channel, place: str) -> None:
        self._channel = channel
        self._place = place

    def __str__(self) -> str:
        return self._place

    def open(self) -> Channel:
        return self._channel

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        raise Misuse(f"{self._place} is open for a thread")
