"""Signals of ophyd-async whose values a driver reads and writes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

from bluesky.protocols import Reading
from event_model import DataKey
from ophyd_async.core import Callback, SignalBackend, SignalMetadata, make_datakey

from steptwin.datasheet import Limits
from steptwin.errors import Misuse, SteptwinError

ValueT = TypeVar("ValueT", float, str)
POLL_S = 0.1
"""How often a value that is monitored is read, s."""
INVALID = 3
"""Severity of a value that could not be read."""


def metadata_of(unit: str, limits: Limits | None = None) -> SignalMetadata:
    found = SignalMetadata(units=unit)
    if limits is not None:
        found["limits"] = {"control": {"low": limits.low, "high": limits.high}}
    return found


class DriverBackend(SignalBackend[ValueT]):
    """A value that ``read`` reads and ``write`` writes; a put is over when ``write`` is.

    ``metadata``: its unit and limits, asked for when they are needed. ``source``: where it is. ``poll_s``: how often a monitored
    value is read, s; None for one that is shown by `publish` only.
    """

    def __init__(
        self,
        datatype: type[ValueT],
        source: Callable[[], str],
        read: Callable[[], Awaitable[ValueT]],
        metadata: Callable[[], SignalMetadata],
        *,
        write: Callable[[ValueT], Awaitable[None]] | None = None,
        poll_s: float | None = None,
    ) -> None:
        super().__init__(datatype)
        self._type = datatype
        self._source = source
        self._read = read
        self._metadata = metadata
        self._write = write
        self._poll_s = poll_s
        self._setpoint: ValueT | None = None
        self._last: Reading[ValueT] | None = None
        self._callback: Callback[Reading[ValueT]] | None = None
        self._polling: asyncio.Task[None] | None = None

    def source(self, name: str, read: bool) -> str:
        return f"steptwin://{self._source()}"

    async def connect(self, timeout: float) -> None:
        """The driver is open, or opening it has failed."""

    async def put(self, value: ValueT | None) -> None:
        if self._write is None or value is None:
            raise Misuse(f"{self._source()} takes no {value}")
        self._setpoint = value
        await self._write(value)

    async def get_datakey(self, source: str) -> DataKey:
        return make_datakey(self._type, self._type(), source, self._metadata())

    async def get_reading(self) -> Reading[ValueT]:
        value = await self._read()
        self._last = Reading(value=value, timestamp=time.time(), alarm_severity=0)
        return self._last

    async def get_value(self) -> ValueT:
        return (await self.get_reading())["value"]

    async def get_setpoint(self) -> ValueT:
        return await self.get_value() if self._setpoint is None else self._setpoint

    def set_callback(self, callback: Callback[Reading[ValueT]] | None) -> None:
        if callback is not None and self._callback is not None:
            raise RuntimeError("a signal has one callback")
        self._callback = callback
        if self._polling is not None:
            self._polling.cancel()
            self._polling = None
        if callback is None:
            return
        if self._last is not None:
            callback(self._last)
        if self._poll_s is not None:
            self._polling = asyncio.get_running_loop().create_task(self._poll(self._poll_s))
        elif self._last is None:
            self._polling = asyncio.get_running_loop().create_task(self.publish())

    async def publish(self) -> None:
        """Show the present value to those who monitor it; of one that cannot be read the last, as invalid."""
        try:
            reading = await self.get_reading()
        except SteptwinError:
            if self._last is None:
                return
            reading = Reading(value=self._last["value"], timestamp=time.time(), alarm_severity=INVALID)
        if self._callback is not None:
            self._callback(reading)

    async def _poll(self, period_s: float) -> None:
        while True:
            await self.publish()
            await asyncio.sleep(period_s)
