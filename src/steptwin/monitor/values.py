"""Present values for the monitor: a device is polled; a running twin is followed, and positions are computed from its plans."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

from steptwin.drivers import AsyncMic488, Mic488Status
from steptwin.live.remote import RemoteSubject
from steptwin.live.twins import TwinController
from steptwin.live.watching import TwinWatch
from steptwin.mic488.registers import AXES, INPUTS, OUTPUTS
from steptwin.mic488.values import RegisterValue

MonitorValues: TypeAlias = Mapping[str, tuple[RegisterValue, str]]
"""Value and unit of registers by name."""


class MonitorReading(NamedTuple):
    """The known values at a moment."""

    status: Mic488Status
    values: MonitorValues


class MonitorSource(Protocol):
    """Raises the errors of drivers; the next reading starts again."""

    async def look(self, names: Sequence[str]) -> MonitorReading:
        """The status, and the values of registers by name."""
        ...

    async def close(self) -> None: ...


class PolledValues:
    """Of a device, in as few frames as possible."""

    def __init__(self, mic: AsyncMic488) -> None:
        self._mic = mic

    async def look(self, names: Sequence[str]) -> MonitorReading:
        status = await self._mic.status()
        return MonitorReading(status, await self._mic.get_shown(*names) if names else {})

    async def close(self) -> None:
        """The owner of the driver closes it."""


class FollowedValues:
    """Of a MIC488 of a running twin (`steptwin.live.watching`): nothing goes over its line."""

    def __init__(self, twin: TwinController, connect: Callable[[str], RemoteSubject] = RemoteSubject) -> None:
        self._twin = twin
        self._connect = connect
        self._subject: RemoteSubject | None = None
        self._watch: TwinWatch | None = None
        self._names: tuple[str, ...] = ()

    async def look(self, names: Sequence[str]) -> MonitorReading:
        return await asyncio.to_thread(self._look, tuple(names))  # a twin that hangs must not keep keys from acting

    async def close(self) -> None:
        self._drop()

    def _look(self, names: tuple[str, ...]) -> MonitorReading:
        try:
            found = self._watched(names).look()
        except BaseException:
            self._drop()
            raise
        known = {name: (value, unit) for name, (value, unit) in found.items() if value is not None}
        return MonitorReading(_status(known), {name: known[name] for name in names if name in known})

    def _watched(self, names: tuple[str, ...]) -> TwinWatch:
        """A watch of what the status has, and of the registers."""
        subject = self._subject
        if subject is None:
            subject = self._subject = self._connect(self._twin.twin)
        if self._watch is None or names != self._names:
            if self._watch is not None:
                self._watch.close()
            parts = [part for part in subject.description.machines if part.name == self._twin.name]
            there = {point.path for part in parts for point in part.datasheet.points}
            paths = dict.fromkeys((*(name for name in _STATUS if name in there), *names))
            self._watch, self._names = TwinWatch(subject, self._twin.name, tuple(paths)), names
        return self._watch

    def _drop(self) -> None:
        if self._subject is not None:
            self._subject.close()
        self._subject = self._watch = None


def _of_axes(name: str) -> list[str]:
    return [f"M{axis}_{name}" for axis in range(1, AXES + 1)]


_INPUTS = [f"IN{number}" for number in range(1, INPUTS + 1)]
_OUTPUTS = [f"OUT{number}" for number in range(1, OUTPUTS + 1)]
_STATUS = (*_of_axes("POS_ACT"), *_of_axes("VEL_ACT"), *_of_axes("STATUS"), *_INPUTS, *_OUTPUTS, "M_STATUS", "PROGRAM_CTRL")
"""The registers of `Mic488Status`; firmware before 1.70 has no M_STATUS."""


def _status(found: MonitorValues) -> Mic488Status:
    def numbers(names: Sequence[str]) -> list[float]:
        return [float(found[name][0]) for name in names]

    controller = found.get("M_STATUS")
    return Mic488Status(
        positions=tuple(numbers(_of_axes("POS_ACT"))),
        velocities=tuple(numbers(_of_axes("VEL_ACT"))),
        units=tuple(found[name][1] for name in _of_axes("POS_ACT")),
        axes=tuple(map(int, numbers(_of_axes("STATUS")))),
        inputs=tuple(map(bool, numbers(_INPUTS))),
        outputs=tuple(map(bool, numbers(_OUTPUTS))),
        controller=None if controller is None else int(controller[0]),
        program=int(found["PROGRAM_CTRL"][0]),
    )
