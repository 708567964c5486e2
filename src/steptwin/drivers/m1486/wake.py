"""Prepare a chip on an open line, for programs that send commands themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486.lines import talking
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.m1486.unit import ChipUnit
from steptwin.drivers.tcp import Channel
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse

TIMEOUT_NS: Nanos = 500 * MILLISECOND


def wake(channel: Channel, place: str, address: int | None, baud: int, log: Callable[[str], object] | None = None) -> None:
    """End the rest of earlier commands, switch function 41 (echo) on and select the chip; each step is verified by the echo.

    Raises `NoEcho` if the chip is absent, moves or runs a program. ``channel`` stays open.
    """
    endpoint = _Opened(channel, place)
    line: ThreadLine[ChipRequest, bytes] = ThreadLine(endpoint, *talking(endpoint, baud, log))
    finish(line.open())
    finish(ChipUnit(line, address, timeout_ns=TIMEOUT_NS).wake())


class _Opened:
    """An endpoint with an open channel."""

    def __init__(self, channel: Channel, place: str) -> None:
        self._channel = channel
        self._place = place

    def __str__(self) -> str:
        return self._place

    def open(self) -> Channel:
        return self._channel

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        raise Misuse(f"{self._place} is open for a thread")
