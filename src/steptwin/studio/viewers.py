"""Viewers over WebSockets: each request is answered, and messages of a session are sent as fast as its viewer reads.

Everything runs in the event loop of the world, so commands are done between the requests of its other clients, without locks.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.studio.hub import Hub
from steptwin.studio.session import ViewerSession
from steptwin.subject.dispatch import Message, failure

AsgiScope: TypeAlias = MutableMapping[str, Any]
AsgiReceive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
AsgiSend: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]

PATH = "/ws"
TICK_S = 1 / 30
PATIENCE_S = 10.0
"""Time-out for a viewer that does not read."""
HELLO_S = 10.0
"""Time-out for the hello of a connection."""
REFUSED, SLOW, SILENT = 4401, 4408, 4400
"""Close codes: wrong token, does not read, no hello."""


class Viewers:
    """All connections. ``clock`` is the wall clock in nanoseconds, which must never go back."""

    def __init__(self, hub: Hub, clock: Callable[[], Nanos]) -> None:
        self._hub = hub
        self._clock = clock
        self._connections: set[_Connection] = set()
        self._ticking: asyncio.Task[None] | None = None

    async def serve(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        """One connection, from its beginning to its end."""
        await receive()  # that it wants to connect
        await send({"type": "websocket.accept"})
        session = ViewerSession(self._hub, _peer(scope))
        connection = _Connection(session, send, self._clock, scope["state"]["abort"])
        self._connections.add(connection)
        if self._ticking is None:
            self._ticking = asyncio.create_task(self._tick())
        try:
            await connection.serve(receive)
        finally:
            self._connections.discard(connection)
            session.close()
            await connection.close()

    async def _tick(self) -> None:
        """Runs while there are connections. An error in one connection does not affect the others."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while self._connections:
            now = self._clock()
            self._hub.tick(now)
            for connection in self._connections:
                connection.look(now)
            due = max(due + TICK_S, loop.time() + TICK_S / 4)
            await asyncio.sleep(due - loop.time())
        self._ticking = None

    async def close(self) -> None:
        if self._ticking is not None:
            self._ticking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._ticking


class _Connection:
    """A connection. Answers are sent in order; a separate task sends messages, so that only that task waits for a slow reader."""

    def __init__(self, session: ViewerSession, send: AsgiSend, clock: Callable[[], Nanos], abort: Callable[[], None]) -> None:
        self._session = session
        self._send = send
        self._clock = clock
        self._abort = abort
        self._news = asyncio.Event()
        self._answers: deque[str] = deque()
        """Later answers that are not sent yet."""
        self._writing: asyncio.Task[None] | None = None

    async def serve(self, receive: AsgiReceive) -> None:
        loop = asyncio.get_running_loop()
        silent = loop.call_later(HELLO_S, self._abort)
        self._writing = asyncio.create_task(self._write())
        try:
            while (message := await receive())["type"] == "websocket.receive":
                await self._answer(message.get("text"))
                if self._session.is_refused:
                    await self._send({"type": "websocket.close", "code": REFUSED})
                    return
                if self._session.has_entered:
                    silent.cancel()
                self.look(self._clock())
        except (TimeoutError, OSError):
            self._abort()
        finally:
            silent.cancel()

    async def _answer(self, text: str | None) -> None:
        """Send an answer when it is available; other requests are served meanwhile."""
        if text is None:
            await self._written(_text(failure(Misuse("a message is a text of JSON; this one is binary"))))
            return
        answer = self._session.receive(text, self._clock())
        if answer.is_done:
            await self._written(_text(answer.result()))
        else:
            answer.then(lambda: self._answered(answer.result()))

    def _answered(self, answer: Message) -> None:
        self._answers.append(_text(answer))
        self._news.set()

    async def _write(self) -> None:
        try:
            while True:
                await self._news.wait()
                self._news.clear()
                while self._answers:
                    await self._written(self._answers.popleft())
                for text in self._session.take(self._clock()):
                    await self._written(text)
        except (TimeoutError, OSError):
            self._abort()

    async def _written(self, text: str) -> None:
        """Raises `TimeoutError` if the viewer does not read, `OSError` if it has disconnected."""
        async with asyncio.timeout(PATIENCE_S):
            await self._send({"type": "websocket.send", "text": text})

    def look(self, now: Nanos) -> None:
        """Send the available messages."""
        if not self._news.is_set() and self._session.has_news(now):
            self._news.set()

    async def close(self) -> None:
        if self._writing is not None:
            self._writing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._writing


def _text(message: Message) -> str:
    return json.dumps(message, separators=(",", ":"))


def _peer(scope: AsgiScope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else "local"
