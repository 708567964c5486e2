"""A transport that the source does not know: programs reach a line over a Unix domain socket at a path. `registered` gives
descriptions the key ``unix`` of ``[[line]]``; it carries what a pty carries."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from steptwin.controller import Port
from steptwin.live.links import Feed
from steptwin.live.transports import LinkArguments, OpenLink, Transport, forget, register
from steptwin.simulation.kinds.links import LinkKey
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.values import text_value


class UnixClient(asyncio.Protocol):
    """One program."""

    def __init__(self, link: UnixLink, port: Port) -> None:
        self._link = link
        self._port = port

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._feed = Feed(self._link.opening.realtime, self._port, self._transport)
        self._link.clients.add(self)

    def data_received(self, data: bytes) -> None:
        self._feed.take(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self.end()

    def end(self) -> None:
        if self in self._link.clients:
            self._link.clients.remove(self)
            self._transport.abort()
            self._feed.close()


class UnixLink:
    def __init__(self, opening: LinkArguments) -> None:
        self.opening = opening
        self.clients: set[UnixClient] = set()

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_unix_server(lambda: UnixClient(self, self.opening.make_port()), self.opening.where)

    async def close(self) -> None:
        self._server.close()
        for client in list(self.clients):
            client.end()
        _remove(self.opening.where)


def _remove(where: str) -> None:
    Path(where).unlink(missing_ok=True)


async def _open(opening: LinkArguments) -> OpenLink:
    link = UnixLink(opening)
    await link.open()
    return OpenLink(link, opening.where, {"path": opening.where})


UNIX = Transport(kind="unix", is_address=False, has_several=True, open=_open)
UNIX_KEY = LinkKey(Key("unix", text_value, "path of a Unix domain socket", None), like="pty")


@contextmanager
def registered() -> Generator[None]:
    """Lines may be opened so meanwhile."""
    register(UNIX_KEY, UNIX)
    try:
        yield
    finally:
        forget(UNIX_KEY.name)
