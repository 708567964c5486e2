"""Values of a controller by their names, all of one moment: Triggerable and Readable."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from bluesky.protocols import HasHints, Hints, Reading, Triggerable
from event_model import DataKey
from ophyd_async.core import AsyncReadable, AsyncStatus, Device

from steptwin.drivers.subject import DevicePart
from steptwin.errors import Refusal


class PointReadings(Device, AsyncReadable, Triggerable, HasHints):
    """The points ``points`` (``IN3``, ``M1_STATUS``, ``USER_REGISTER[5]``) of the controller ``part``, which is there once it is
    connected. A reading is that of the last trigger; without one since the last reading it is new."""

    def __init__(self, part: Callable[[], DevicePart], points: Sequence[str], name: str = "") -> None:
        self._part = part
        self._points = tuple(points)
        self._triggered: dict[str, Reading[float]] | None = None
        super().__init__(name)

    def _key(self, point: str) -> str:
        return f"{self.name}-{point}"

    @property
    def hints(self) -> Hints:
        return Hints(fields=[self._key(point) for point in self._points])

    @AsyncStatus.wrap
    async def trigger(self) -> None:
        """Reads them, in as few exchanges as possible."""
        self._triggered = await self._taken()

    async def read(self) -> dict[str, Reading[float]]:
        triggered, self._triggered = self._triggered, None
        return await self._taken() if triggered is None else triggered

    async def _taken(self) -> dict[str, Reading[float]]:
        part = self._part()
        values = await part.values(self._points)
        now = time.time()
        found: dict[str, Reading[float]] = {}
        for point, (value, _) in values.items():
            if value is None:
                raise Refusal(f"{part.line.place}: {point} is not known at present")
            found[self._key(point)] = Reading(value=value, timestamp=now)
        return found

    async def describe(self) -> dict[str, DataKey]:
        """Raises `Misuse` for a name that is not there."""
        part = self._part()
        return {
            self._key(point): DataKey(
                source=f"steptwin://{part.line.place}/{point}",
                dtype="number",
                dtype_numpy="<f8",
                shape=[],
                units=part.unit_of(point),
            )
            for point in self._points
        }
