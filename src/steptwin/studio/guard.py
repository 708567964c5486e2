"""Checks of all HTTP requests: host names and origins, rates, headers; and handling of unexpected errors."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeAlias

from steptwin.access.origin import Origins
from steptwin.access.rate import RateLimits
from steptwin.controller import Nanos
from steptwin.errors import Refusal
from steptwin.messages import Message
from steptwin.studio.viewers import AsgiReceive, AsgiScope, AsgiSend
from steptwin.studio.viewersession import TOO_MANY_REQUESTS
from steptwin.subject.dispatch import failure

RATE, BURST = 100.0, 400.0
"""Rate limit of one address: HTTP requests per second, and burst."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; "
    "worker-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
ServeSocket: TypeAlias = Callable[[AsgiScope, AsgiReceive, AsgiSend], Awaitable[None]]
"""Serves one WebSocket from its beginning to its end."""


WEBSOCKETS_ARE_ELSEWHERE = Message("studio.websockets-are-elsewhere", "WebSockets are at {places}")


class Guard:
    """An ASGI application before ``app``, and before WebSockets by their paths."""

    def __init__(
        self,
        app: Any,
        sockets: Mapping[str, ServeSocket],
        origins: Origins,
        clock: Callable[[], Nanos],
        on_internal: Callable[[Exception], object],
    ) -> None:
        self._app = app
        self._sockets = sockets
        self._origins = origins
        self._clock = clock
        self._on_internal = on_internal
        self._limits = RateLimits(RATE, BURST)

    async def __call__(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        headers = {key: value.decode("latin-1") for key, value in scope.get("headers", ())}
        is_socket = scope["type"] == "websocket"
        refuse = _refuse_socket if is_socket else _refuse
        client = scope.get("client")
        try:
            self._origins.check(headers.get(b"host"), headers.get(b"origin"))
            if not self._limits.allows(client[0] if client else None, self._clock()):
                await refuse(send, receive, 429, Refusal(TOO_MANY_REQUESTS(rate=RATE)))
                return
        except Refusal as error:
            await refuse(send, receive, 403, error)
            return
        if not is_socket:
            await self._pass(scope, receive, send)
        elif scope["path"] not in self._sockets:
            await _refuse_socket(send, receive, 404, Refusal(WEBSOCKETS_ARE_ELSEWHERE(places=" and ".join(self._sockets))))
        else:
            try:
                await self._sockets[scope["path"]](scope, receive, _sending(send))
            except _ClientGone:
                return
            except Exception as error:  # noqa: BLE001  it is reported here only
                self._on_internal(error)

    async def _pass(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        has_begun = False

        sending = _sending(send)

        async def guarded(message: Any) -> None:
            nonlocal has_begun
            if message["type"] != "http.response.start":
                await send(message)
                return
            has_begun = True
            own = message.get("headers", ())
            names = {name.lower() for name, _ in own}
            await sending({**message, "headers": [*own, *(header for header in HEADERS if header[0] not in names)]})

        async def listening() -> Any:
            message = await receive()
            if message["type"] == "http.disconnect":
                raise _ClientGone
            return message

        try:
            await self._app(scope, listening, guarded)
        except _ClientGone:
            return
        except Exception as error:  # noqa: BLE001  every request gets an answer
            self._on_internal(error)
            if not has_begun:
                await _refuse(send, receive, 500, error)


class _ClientGone(Exception):
    """The client has ended the connection, or sent what is not HTTP: nobody waits for the answer, and nothing is wrong here."""


def _sending(send: AsgiSend) -> AsgiSend:
    """``send`` of a connection that may have ended; `_ClientGone` then."""

    async def to_client(message: Any) -> None:
        try:
            await send(message)
        except Exception as error:
            raise _ClientGone from error

    return to_client


async def _refuse(send: AsgiSend, receive: AsgiReceive, status: int, error: Exception) -> None:
    body = json.dumps(failure(error)).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode()), *HEADERS]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def _refuse_socket(send: AsgiSend, receive: AsgiReceive, status: int, error: Exception) -> None:
    """Before the connection is accepted: the answer to its request."""
    await receive()
    body = json.dumps(failure(error)).encode()
    headers = [(b"content-type", b"application/json")]
    await send({"type": "websocket.http.response.start", "status": status, "headers": headers})
    await send({"type": "websocket.http.response.body", "body": body})
