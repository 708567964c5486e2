"""HTTP in the present event loop: a socket that listens, and the service behind it until it is closed."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn

from steptwin.errors import LineFailure
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason

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


class _Server(uvicorn.Server):
    """No signal handlers: signals end the world, which ends the service."""

    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None]:
        yield


class HttpService:
    """Serves the ASGI application ``app`` at ``listening`` until it is closed.

    ``options``: further settings of uvicorn.
    """

    def __init__(self, app: Any, listening: socket.socket, tls: Tls | None = None, **options: Any) -> None:
        self._socket = listening
        for name in ("uvicorn.error", "uvicorn.asgi"):  # errors come to the application's own handler; the rest is no news
            logging.getLogger(name).addHandler(logging.NullHandler())
            logging.getLogger(name).propagate = False
        self._server = _Server(
            uvicorn.Config(
                app,
                http="h11",
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
                **options,
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
        self._server.should_exit = True
        if self._task is not None:
            await self._task
        self._socket.close()
