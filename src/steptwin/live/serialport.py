"""A real serial port, 8N1."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import cast

import serialx

from steptwin.controller import Port
from steptwin.errors import LineFailure
from steptwin.live.links import Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.system import reason

RETRY_S = 1.0
"""Interval of attempts to reopen a lost device, s."""


class SerialLink:
    """A real serial port in front of a twin's port.

    If the device disappears (a USB adapter is unplugged), it is reopened when it is back; ``notice`` is called for both.
    """

    def __init__(
        self, realtime: RealTimeDriver, device: str, baud: int, make_port: Callable[[], Port], notice: Callable[[str], None]
    ) -> None:
        self._realtime = realtime
        self._device = device
        self._baud = baud
        self._make_port = make_port
        self._notice = notice
        self._transport: serialx.BaseSerialTransport | None = None
        self._search: asyncio.Task[None] | None = None
        self._closing = False

    async def open(self) -> str:
        """Open the port. Raises `LineFailure` naming it."""
        loop = asyncio.get_running_loop()
        try:
            self._transport, _ = await serialx.create_serial_connection(loop, self._make_line, self._device, self._baud)
        except (OSError, serialx.SerialException) as error:
            why = reason(error)
            raise LineFailure(f"cannot open serial port {self._device} at {self._baud} bit/s: {why}") from error
        return self._device

    def _make_line(self) -> _SerialProtocol:
        return _SerialProtocol(self._realtime, self._make_port(), self._lost)

    def _lost(self, error: Exception | None) -> None:
        self._transport = None
        if not self._closing:
            why = "closed" if error is None else reason(error)
            self._notice(f"serial port {self._device} was lost ({why}); trying to open it again")
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
        if self._transport is not None:
            self._transport.abort()


class _SerialProtocol(asyncio.Protocol):
    """The protocol of the serial port. While the other end does not accept output, no input is read."""

    def __init__(self, realtime: RealTimeDriver, port: Port, lost: Callable[[Exception | None], None]) -> None:
        self._realtime = realtime
        self._port = port
        self._lost = lost

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._feed = Feed(self._realtime, self._port, self._transport)

    def data_received(self, data: bytes) -> None:
        self._feed.take(data)

    def pause_writing(self) -> None:
        self._feed.is_read = False
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        self._feed.is_read = True
        self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        self._feed.close()
        self._lost(exc)
