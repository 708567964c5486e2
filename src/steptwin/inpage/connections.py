"""Connections of a page to what runs in its worker: messages instead of WebSockets, with the same end points behind them."""

from __future__ import annotations

import asyncio
import traceback
from typing import Any, Protocol

from steptwin.studio.guard import ServeSocket
from steptwin.studio.viewers import MOST_UNSENT

NORMAL, INTERNAL = 1000, 1011
"""Close codes, as those of WebSockets."""


class Page(Protocol):
    """Messages to a page, with the numbers that it has given its connections."""

    def opened(self, number: int) -> None: ...
    def send(self, number: int, text: str) -> None:
        """A message, which the page takes when it has time (`Connections.taken`)."""
        ...

    def closed(self, number: int, code: int) -> None: ...
    def keep(self, state: bytes) -> None:
        """A state from which a twin can go on that takes the place of this one."""
        ...

    def swapped(self) -> None:
        """Another world is shown: what the page knows is of the one before."""
        ...

    def saveText(self, file: str, text: str) -> None:  # noqa: N802  as the page names it
        """A download of the browser."""
        ...

    def refused(self, text: str) -> None:
        """There will be no twin, for this reason."""
        ...

    def failed(self, text: str) -> None:
        """An error in steptwin, which nobody asked for."""
        ...


def report(page: Page, error: Exception) -> None:
    page.failed("".join(traceback.format_exception(error)))


class Connections:
    """All connections of one page. ``serve`` serves one of them from its beginning to its end, in the running event loop."""

    def __init__(self, serve: ServeSocket, page: Page) -> None:
        self._serve = serve
        self._page = page
        self._open: dict[int, _Connection] = {}

    def open(self, number: int) -> None:
        self._open[number] = made = _Connection(number, self._page)
        made.task = asyncio.get_running_loop().create_task(self._run(made))

    async def _run(self, connection: _Connection) -> None:
        try:
            await self._serve({"type": "websocket"}, connection.receive, connection.send)
        except Exception as error:  # noqa: BLE001  it ends one connection, and is reported here only
            connection.code = INTERNAL
            report(self._page, error)
        finally:
            del self._open[connection.number]
            self._page.closed(connection.number, connection.code)

    def receive(self, number: int, text: str) -> None:
        """A message of the page. Messages for a connection that has ended are left out, as those on their way always can be."""
        if number in self._open:
            self._open[number].put({"type": "websocket.receive", "text": text})

    def taken(self, number: int, size: int) -> None:
        """The page has taken messages of so many characters."""
        if number in self._open:
            self._open[number].taken(size)

    def close(self, number: int) -> None:
        """The page has ended a connection: its viewer leaves, the world goes on."""
        if number in self._open:
            self._open[number].put({"type": "websocket.disconnect", "code": NORMAL})


class _Connection:
    """One connection as ASGI has it. `send` waits while the page has not taken `MOST_UNSENT` characters."""

    def __init__(self, number: int, page: Page) -> None:
        self.number = number
        self.code = NORMAL
        self.task: asyncio.Task[None] | None = None
        self._page = page
        self._incoming: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._unread = 0
        self._has_room = asyncio.Event()
        self.put({"type": "websocket.connect"})

    def put(self, message: dict[str, Any]) -> None:
        self._incoming.put_nowait(message)

    async def receive(self) -> dict[str, Any]:
        return await self._incoming.get()

    async def send(self, message: Any) -> None:
        if message["type"] == "websocket.accept":
            self._page.opened(self.number)
        elif message["type"] == "websocket.close":
            self.code = message["code"]
        else:
            self._page.send(self.number, message["text"])
            self._unread += len(message["text"])
            while self._unread > MOST_UNSENT:
                self._has_room.clear()
                await self._has_room.wait()

    def taken(self, size: int) -> None:
        self._unread -= size
        self._has_room.set()
