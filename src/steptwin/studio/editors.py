"""The editor server over WebSockets: help while typing, for the page and for any other client of its protocol.

The first message is ``hello`` with a token, as at the other WebSocket; what follows are messages of the Language Server
Protocol.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol, TypeAlias

from steptwin.access.rate import RateLimit
from steptwin.access.tokens import AccessGate
from steptwin.controller import Nanos
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.messages import Message
from steptwin.studio.requests import REQUESTS
from steptwin.studio.viewers import (
    BINARY_MESSAGE,
    HELLO_S,
    REFUSED,
    SILENT,
    AsgiReceive,
    AsgiScope,
    AsgiSend,
    patience_s,
    until_first,
)
from steptwin.subject.dispatch import failure, fields_of, read_message

PATH = "/editor"
MOST_EDITORS = 32
MOST_DOCUMENTS = 64
MOST_WAITING = 1000
"""Messages for a client that reads nothing."""
RATE, BURST = 200.0, 1000.0
"""Messages of a client in a second, and at once."""

Analyse: TypeAlias = Callable[[Callable[[], Any]], Awaitable[Any]]
"""Calls, and gives what the call gives."""


class Conversation(Protocol):
    """An editor server for one client (`steptwin.lsp.messages.MessageServer`)."""

    @property
    def documents(self) -> int: ...
    def receive(self, text: str) -> None: ...
    def close(self) -> None: ...


HELLO_COMES_FIRST = Message("studio.hello-comes-first", "the first message is hello")
TOO_MANY_EDITORS = Message("studio.too-many-editors", "there are {most} editors already, the most possible")
TOO_MANY_MESSAGES = Message("studio.too-many-messages", "too many messages: permitted are {rate:g} a second")
TOO_MANY_TEXTS = Message("studio.too-many-texts", "too many texts: permitted are {most}")


class Editors:
    """All connections. ``files`` gives the present texts of the subject by address, ``clock`` the wall clock in nanoseconds;
    ``analyse`` calls where the time that it takes matters to nobody else."""

    def __init__(
        self, gate: AccessGate, files: Callable[[], Mapping[str, bytes]], clock: Callable[[], Nanos], analyse: Analyse
    ) -> None:
        self._gate = gate
        self._files = files
        self._clock = clock
        self._analyse = analyse
        self._count = 0

    async def serve(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        """One connection, from its beginning to its end."""
        await receive()  # that it wants to connect
        await send({"type": "websocket.accept"})
        try:
            async with asyncio.timeout(HELLO_S):
                token = self._enter((await receive()).get("text"))
        except TimeoutError:
            await _end(send, SILENT, Misuse(HELLO_COMES_FIRST()))
        except SteptwinError as error:
            await _end(send, REFUSED, error)
        else:
            self._count += 1
            try:
                await self._converse(receive, send, token)
            finally:
                self._count -= 1

    def _enter(self, text: str | None) -> str | None:
        """The token that was given. Raises `Misuse` and `Refusal`."""
        message = read_message((text or "").encode("utf-8", "replace"))
        if message["do"] != "hello":
            raise Misuse(HELLO_COMES_FIRST())
        token: str | None = REQUESTS["hello"].read(fields_of(message)).token
        self._gate.enter(token)
        if self._count >= MOST_EDITORS:
            raise Refusal(TOO_MANY_EDITORS(most=MOST_EDITORS))
        return token

    async def _converse(self, receive: AsgiReceive, send: AsgiSend, token: str | None) -> None:
        loop, is_full = asyncio.get_running_loop(), asyncio.Event()
        outgoing: asyncio.Queue[str] = asyncio.Queue(MOST_WAITING)

        def put(text: str) -> None:
            if outgoing.full():
                is_full.set()
            else:
                outgoing.put_nowait(text)

        def say(text: str) -> None:
            """Called where texts are analysed."""
            with contextlib.suppress(RuntimeError):  # the service has ended
                loop.call_soon_threadsafe(put, text)

        files = self._files()
        there = await self._analyse(lambda: _begin(files, say))
        await outgoing.put(json.dumps({"ok": None}))
        try:
            await until_first(self._read(receive, there, token), _write(outgoing, send), is_full.wait())
        except SteptwinError as error:
            await _end(send, SILENT, error)
        except (TimeoutError, OSError):
            pass  # it does not read, or is gone
        finally:
            await self._analyse(there.close)

    async def _read(self, receive: AsgiReceive, there: Conversation, token: str | None) -> None:
        limit = RateLimit(RATE, BURST)
        while (message := await receive())["type"] == "websocket.receive":
            text = message.get("text")
            if text is None:
                raise Misuse(BINARY_MESSAGE())
            self._gate.enter(token)  # it may be asked for since a device was connected
            if not limit.allows(self._clock()):
                raise Refusal(TOO_MANY_MESSAGES(rate=RATE))
            if await self._analyse(lambda text=text: _receive(there, text)) > MOST_DOCUMENTS:
                raise Refusal(TOO_MANY_TEXTS(most=MOST_DOCUMENTS))


def _begin(files: Mapping[str, bytes], say: Callable[[str], None]) -> Conversation:
    from steptwin.lsp.files import GivenTexts
    from steptwin.lsp.messages import MessageServer

    return MessageServer(GivenTexts(files), say)


def _receive(there: Conversation, text: str) -> int:
    """How many texts are open then."""
    there.receive(text)
    return there.documents


async def _write(outgoing: asyncio.Queue[str], send: AsgiSend) -> None:
    before = 0
    while True:
        text = await outgoing.get()
        async with asyncio.timeout(patience_s(before)):
            await send({"type": "websocket.send", "text": text})
        before = len(text)


async def _end(send: AsgiSend, code: int, error: Exception) -> None:
    with contextlib.suppress(OSError):
        await send({"type": "websocket.send", "text": json.dumps(failure(error))})
        await send({"type": "websocket.close", "code": code})
