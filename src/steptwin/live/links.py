"""Byte streams and their ports: the common part of all links."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Protocol

from steptwin.controller import Nanos, Port, SendingPort, sends_by_itself
from steptwin.live.realtimedriver import RealTimeDriver

SLICE_BYTES = 2048
"""Bytes of one client that are served at once, so that others do not wait."""


class Writer(Protocol):
    def write(self, data: bytes) -> None: ...


class Feed:
    """Connects a stream of bytes with a port: input, answers, and timers for later output."""

    __slots__ = ("_loop", "_port", "_realtime", "_talks", "_timer", "_writer", "is_read")

    def __init__(self, realtime: RealTimeDriver, port: Port, writer: Writer) -> None:
        self._realtime = realtime
        self._port = port
        self._writer = writer
        self._loop = asyncio.get_running_loop()
        self._timer: asyncio.Handle | None = None
        self.is_read = True
        """Whether the other end reads. If not, unsolicited output is lost, as on a wire."""
        self._talks: SendingPort | None = None
        if sends_by_itself(port):
            self._talks = port  # announces its output: it is not asked when there will be some
            port.on_output = self._fetch_soon

    def take(self, data: bytes) -> None:
        realtime = self._realtime
        answer = self._port.exchange(data, realtime.enter())
        if answer:
            self._writer.write(answer)
        if realtime.scheduler.is_dirty:
            realtime.leave()
        if self._talks is None:
            due = self._port.deadline()
            if due is not None:
                self._arm(due)

    def _arm(self, due: Nanos) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(self._realtime.clock.wait_s(due), self._wake)

    def _fetch_soon(self) -> None:
        # The port calls this while controllers are being advanced.
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_soon(self._wake)

    def _wake(self) -> None:
        self._timer = None
        now = self._realtime.enter()
        is_taken = self.is_read or self._talks is None
        for _, data in self._port.to_send(now):
            if is_taken:
                self._writer.write(data)
        self._realtime.leave()
        due = self._port.deadline() if self._talks is None else None
        if due is not None:
            self._arm(due)

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._port.close()


class Link(Protocol):
    """A connection of a port to other programs."""

    async def close(self) -> None: ...


class PathLink(Link, Protocol):
    """A link with a path."""

    @property
    def path(self) -> Path: ...
    async def open(self) -> Path: ...
