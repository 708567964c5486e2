"""The service of the studio: page, WebSocket and REST over HTTP, in the event loop of the world that it shows."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from steptwin import __version__
from steptwin.access.origin import Origins
from steptwin.errors import LineFailure
from steptwin.studio import editors, viewers
from steptwin.studio.editors import Editors
from steptwin.studio.guard import Guard
from steptwin.studio.hub import Hub
from steptwin.studio.rest import Rest, describe_api
from steptwin.studio.static import add_page
from steptwin.studio.viewers import Viewers
from steptwin.subject.dispatch import LONGEST_REQUEST
from steptwin.system import reason
from steptwin.world.addresses import Address

PORTS_TRIED = 20
MOST_CONNECTIONS = 256
END_S = 1
"""Time-out for connections to end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tls:
    """Files with the certificate and its key."""

    certificate: Path
    key: Path


def listen(address: Address, *, is_fixed: bool) -> socket.socket:
    """Listen there; if the port is in use and not ``is_fixed``, on one of the next ports. Raises `LineFailure`."""
    tried = 1 if is_fixed or address.port == 0 else PORTS_TRIED
    for port in range(address.port, address.port + tried):
        try:
            return socket.create_server((address.host, port), family=_family(address.host), backlog=128)
        except OSError as error:
            if port == address.port + tried - 1:
                raise LineFailure(f"cannot listen on {Address(address.host, port)}: {reason(error)}") from error
    raise AssertionError


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


class _Protocol(WebSocketsSansIOProtocol):
    """Permits closing a connection whose other end does not read."""

    def connection_made(self, transport: Any) -> None:
        self.app_state = {**self.app_state, "abort": transport.abort}
        super().connection_made(transport)


class _Server(uvicorn.Server):
    """No signal handlers: signals end the world, which ends the service."""

    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None]:
        yield


class Service:
    """Serves ``hub`` at ``listening`` until it is closed. A `Link` of a server."""

    def __init__(self, hub: Hub, listening: socket.socket, origins: Origins, tls: Tls | None = None) -> None:
        clock = time.monotonic_ns
        self._socket = listening
        self._viewers = Viewers(hub, clock)
        around = hub.around
        self._editors = Editors(around.gate, around.programs.files, clock)
        sockets = {viewers.PATH: self._viewers.serve, editors.PATH: self._editors.serve}
        app = make_app(hub, clock)
        for name in ("uvicorn.error", "uvicorn.asgi"):  # errors come to `on_internal`; the rest is no news
            logging.getLogger(name).addHandler(logging.NullHandler())
            logging.getLogger(name).propagate = False
        self._server = _Server(
            uvicorn.Config(
                Guard(app, sockets, origins, clock, around.on_internal),
                http="h11",
                ws=_Protocol,
                ws_max_size=LONGEST_REQUEST,
                ws_per_message_deflate=False,
                lifespan="off",
                interface="asgi3",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                limit_concurrency=MOST_CONNECTIONS,
                timeout_graceful_shutdown=END_S,
                ssl_certfile=None if tls is None else tls.certificate,
                ssl_keyfile=None if tls is None else tls.key,
            )
        )
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Raises `LineFailure` for a certificate that cannot be used."""
        try:
            self._server.config.load()
        except OSError as error:
            raise LineFailure(f"cannot use the certificate: {reason(error)}") from error
        self._task = asyncio.create_task(self._server.serve([self._socket]))

    async def close(self) -> None:
        await self._viewers.close()
        self._server.should_exit = True
        if self._task is not None:
            await self._task
        self._editors.close()
        self._socket.close()


def make_app(hub: Hub, clock: Callable[[], int]) -> FastAPI:
    """What is behind the guard."""
    app = FastAPI(title="steptwin studio", version=__version__, docs_url=None, redoc_url=None)
    Rest(hub, clock).add_to(app)
    describe_api(app, asks=hub.around.gate.asks)
    add_page(app)
    return app
