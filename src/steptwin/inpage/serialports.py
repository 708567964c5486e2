"""Serial ports that a browser lets its page use (Web Serial), as lines of drivers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from steptwin.drivers.exchange import LineLost
from steptwin.drivers.lineaddress import SERIAL_PORT_IS_NOT_OPENED
from steptwin.drivers.tcp import Channel
from steptwin.errors import Misuse
from steptwin.messages import Message

PREFIX = "webserial"
"""Beginning of the names of ports, which are their addresses."""
UNKNOWN_PORT = Message(
    "inpage.unknown-port",
    "{place}: the page has no such port; it has {names}. From a page only ports that were chosen are reached",
)
NO_THREADS = Message("inpage.no-threads", "{place}: a page has no threads")


class SerialPage(Protocol):
    """Page that opens, writes and closes ports by their numbers; it answers with calls of `SerialPorts`."""

    def openPort(self, number: int, baud: int) -> None: ...  # noqa: N802  as the page names it

    def writePort(self, number: int, data: bytes) -> None: ...  # noqa: N802

    def closePort(self, number: int) -> None: ...  # noqa: N802


class SerialPorts:
    """The ports that the user has chosen."""

    def __init__(self, page: SerialPage) -> None:
        self._page = page
        self._chosen: dict[str, tuple[int, str]] = {}
        self._opening: dict[int, asyncio.Future[None]] = {}
        self._open: dict[int, PortTransport] = {}

    def add(self, number: int, what: str) -> str:
        """A port that was chosen; its address."""
        place = f"{PREFIX}{number}"
        self._chosen[place] = number, what
        return place

    def listed(self) -> list[dict[str, object]]:
        """See `steptwin.devices.connections.Computer`."""
        return [{"address": place, "what": what} for place, (_, what) in self._chosen.items()]

    def endpoint(self, place: str, baud: int) -> PortEndpoint:
        """Raises `Misuse`."""
        if place not in self._chosen:
            raise Misuse(UNKNOWN_PORT(place=place, names=list(self._chosen)))
        return PortEndpoint(self, place, self._chosen[place][0], baud)

    async def connect(self, number: int, baud: int, protocol: asyncio.Protocol) -> asyncio.Transport:
        """Open a port. Raises `OSError` with the words of the browser."""
        opening = self._opening[number] = asyncio.get_running_loop().create_future()
        self._page.openPort(number, baud)
        try:
            await opening
        finally:
            del self._opening[number]
        made = self._open[number] = PortTransport(self._page, number, protocol)
        protocol.connection_made(made)
        return made

    # ------------------------------------------------------------------ from the page

    def opened(self, number: int) -> None:
        opening = self._opening.get(number)
        if opening is None or opening.done():  # nobody waits for it any more
            self._page.closePort(number)
        else:
            opening.set_result(None)

    def failed(self, number: int, why: str) -> None:
        """It could not be opened."""
        opening = self._opening.get(number)
        if opening is not None and not opening.done():
            opening.set_exception(OSError(why))

    def received(self, number: int, data: bytes | memoryview) -> None:
        if number in self._open:
            self._open[number].protocol.data_received(bytes(data))

    def lost(self, number: int, why: str) -> None:
        """It is closed: ``why``, empty where that was wanted."""
        closed = self._open.pop(number, None)
        if closed is not None:
            closed.protocol.connection_lost(OSError(why) if why else None)


@dataclass(frozen=True, slots=True)
class PortEndpoint:
    """See `steptwin.drivers.tcp.Endpoint`."""

    ports: SerialPorts
    place: str
    number: int
    baud: int

    def __str__(self) -> str:
        return self.place

    def open(self) -> Channel:
        raise Misuse(NO_THREADS(place=self.place))

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        try:
            return await self.ports.connect(self.number, self.baud, make())
        except OSError as error:
            raise LineLost(SERIAL_PORT_IS_NOT_OPENED(device=self.place, baud=self.baud, why=str(error))) from error


class PortTransport(asyncio.Transport):
    """An open port."""

    def __init__(self, page: SerialPage, number: int, protocol: asyncio.Protocol) -> None:
        super().__init__()
        self._page = page
        self._number = number
        self.protocol = protocol

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self._page.writePort(self._number, bytes(data))

    def close(self) -> None:
        self._page.closePort(self._number)

    def abort(self) -> None:
        self.close()
