"""A real serial port, 8N1."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import serialx

from steptwin.errors import LineFailure
from steptwin.runtime.cell import Cell
from steptwin.runtime.links import Port, where
from steptwin.runtime.tcp import Clients, Connection

RETRY_S = 1.0
"""How often a device that has disappeared is looked for."""


class SerialLink:
    """A serial port that a port answers on.

    When the device disappears (a USB adapter is pulled out) it is looked for until it is back; ``notice`` is told of both.
    """

    def __init__(self, cell: Cell, device: str, baud: int, make_port: Callable[[], Port], notice: Callable[[str], None]) -> None:
        self._cell = cell
        self._device = device
        self._baud = baud
        self._make_port = make_port
        self._notice = notice
        self._clients = Clients()
        self._search: asyncio.Task[None] | None = None
        self._closing = False

    async def open(self) -> str:
        """Open the port. Raises `LineFailure` naming it."""
        loop = asyncio.get_running_loop()
        try:
            await serialx.create_serial_connection(loop, self._line, self._device, self._baud)
        except (OSError, serialx.SerialException) as error:
            reason = where(error) if isinstance(error, OSError) else str(error)
            raise LineFailure(f"cannot open serial port {self._device} at {self._baud} bit/s: {reason}") from error
        return self._device

    def _line(self) -> Connection:
        return _Line(self._cell, self._make_port, self._clients, self._lost)

    def _lost(self, error: Exception | None) -> None:
        if not self._closing:
            reason = where(error) if isinstance(error, OSError) else str(error or "closed")
            self._notice(f"serial port {self._device} is gone ({reason}); it is looked for")
            self._search = asyncio.get_running_loop().create_task(self._look_for_it())

    async def _look_for_it(self) -> None:
        while True:
            await asyncio.sleep(RETRY_S)
            try:
                await self.open()
            except LineFailure:
                continue
            self._notice(f"serial port {self._device} is back")
            return

    async def close(self) -> None:
        self._closing = True
        if self._search is not None:
            self._search.cancel()
        for line in list(self._clients.present):
            line.abort()


class _Line(Connection):
    def __init__(
        self, cell: Cell, make_port: Callable[[], Port], clients: Clients, lost: Callable[[Exception | None], None]
    ) -> None:
        super().__init__(cell, make_port, clients)
        self._lost = lost

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._lost(exc)
