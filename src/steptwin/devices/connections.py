"""Connections to devices: drivers by address, lines that several devices share, controllers of the subject that come and go."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from steptwin.controller import Nanos
from steptwin.devices.composite import THERE_ARE, CompositeSubject
from steptwin.devices.device import ConnectedDevice, DeviceSurroundings
from steptwin.devices.digitalshadow import ShadowState
from steptwin.diagnostics import SourceText
from steptwin.drivers.exchange import ExchangeCounts, NoAnswer
from steptwin.drivers.kind import DeviceAddress, DriverKind
from steptwin.drivers.kinds import DRIVERS, others_there
from steptwin.drivers.line import DriverLine
from steptwin.drivers.subject import AsyncDeviceSubject, DevicePart
from steptwin.drivers.tcp import Endpoint
from steptwin.errors import LineFailure, Misuse
from steptwin.eventloop import later
from steptwin.messages import Message, text_of
from steptwin.nearmiss import NearMiss

MOST_DEVICES = 32
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")
NAME_FORM = "1 to 40 letters, digits, '-' and '_', the first no digit"


@dataclass(frozen=True, slots=True, kw_only=True)
class Computer:
    """Ports and twins of a computer. ``ports`` and ``find`` may block; all raise `SteptwinError`."""

    ports: Callable[[], Sequence[Mapping[str, object]]]
    """``address`` and ``what`` of serial ports."""
    find: Callable[[str], DeviceAddress]
    """The address in a text."""
    line: Callable[[DeviceAddress], str | Endpoint] = lambda address: address.place
    """Line that the driver of a device opens: its address, or a serial port."""


@dataclass(slots=True)
class _SharedLine:
    line: DriverLine[Any, Any]
    users: int = 0


@dataclass(slots=True)
class _Connected:
    device: ConnectedDevice
    key: tuple[str, str, int]


UNKNOWN_DEVICE = Message("devices.unknown-device", "no device is called {controller!r}{hint}; {known}")
THERE_IS_NONE = Message("devices.there-is-none", "there is none")
TOO_MANY_DEVICES = Message("devices.too-many-devices", "too many devices: the limit is {most}; disconnect one")
WRONG_NAME = Message("devices.wrong-name", "name = {name!r}: permitted are {form}")
NAME_IN_USE = Message("devices.name-in-use", "name = {name!r}: a controller is called that already")


class DeviceConnections:
    """See `steptwin.studio.surroundings.Connections`."""

    def __init__(self, subject: CompositeSubject, around: DeviceSurroundings, computer: Computer) -> None:
        self._subject = subject
        self._around = around
        self._computer = computer
        self._lines: dict[tuple[str, str, int], _SharedLine] = {}
        self._devices: dict[str, _Connected] = {}
        self._turn = asyncio.Lock()

    @property
    def kinds(self) -> Sequence[Mapping[str, object]]:
        return [
            {
                "kind": kind.name,
                "model": kind.title.partition(" ")[2],
                "options": kind.selection.forms,
                "is_searched": kind.search is not None,
            }
            for kind in DRIVERS.values()
            if kind.offers(DriverKind.part)
        ]

    async def ports(self) -> Sequence[Mapping[str, object]]:
        return await later(asyncio.to_thread(self._computer.ports))

    async def connect(self, address: str, name: str | None) -> str:
        return await later(self.open(address, name))

    async def disconnect(self, controller: str) -> None:
        await later(self._close(controller))

    async def settings(self, controller: str) -> str:
        return await later(self._connected(controller).device.settings())

    async def configuration(self, controller: str) -> SourceText | None:
        return await later(asyncio.to_thread(self._connected(controller).device.configuration))

    async def shadow(self, controller: str, *, on: bool) -> None:
        device = self._connected(controller).device
        if on:
            await later(device.begin_shadow())
        else:
            device.end_shadow()

    def shadow_of(self, controller: str, after: Nanos) -> ShadowState | None:
        return self._connected(controller).device.shadow_state(after)

    def traffic(self) -> dict[str, ExchangeCounts]:
        """Traffic on the line of each device, by the name of the device."""
        return {name: self._lines[one.key].line.counts for name, one in self._devices.items()}

    def _connected(self, controller: str) -> _Connected:
        """Raises `Misuse`."""
        if controller not in self._devices:
            known = THERE_ARE(names=list(self._devices)) if self._devices else THERE_IS_NONE()
            raise Misuse(UNKNOWN_DEVICE(controller=controller, hint=NearMiss().hint(controller, self._devices), known=known))
        return self._devices[controller]

    async def open(self, text: str, name: str | None = None) -> str:
        """As `connect`, in the event loop."""
        address = await asyncio.to_thread(self._computer.find, text)
        async with self._turn:
            if len(self._devices) >= MOST_DEVICES:
                raise Misuse(TOO_MANY_DEVICES(most=MOST_DEVICES))
            name = self._free_name(address, name)
            key = address.kind, address.place, address.baud
            line = self._lines.get(key) or _SharedLine(DRIVERS[address.kind].line(self._computer.line(address), address.baud))
            try:
                driver = await _device_at(address, line.line)
            except BaseException:
                if not line.users:
                    await line.line.close()
                raise
            self._lines[key] = line
            line.users += 1
            subject = AsyncDeviceSubject(name, driver, clock=self._subject.now, numbering=self._subject.numbering)
            device = ConnectedDevice(subject, driver, self._around)
            self._devices[name] = _Connected(device, key)
            self._subject.add(device)
        return name

    def _free_name(self, address: DeviceAddress, name: str | None) -> str:
        taken = [controller.name for controller in self._subject.description.controllers]
        if name is not None:
            if not NAME.fullmatch(name):
                raise Misuse(WRONG_NAME(name=name, form=NAME_FORM))
            if name in taken:
                raise Misuse(NAME_IN_USE(name=name))
            return name
        how, there = DRIVERS[address.kind].selection, address.number
        usual = address.kind if there is None or there == how.usual else f"{address.kind}-{how.show(there)}"
        number = 1
        while (found := usual if number == 1 else f"{usual}-{number}") in taken:
            number += 1
        return found

    async def _close(self, controller: str) -> None:
        async with self._turn:
            connected = self._connected(controller)
            del self._devices[controller]
            await connected.device.close()
            self._subject.remove(connected.device)
            line = self._lines[connected.key]
            line.users -= 1
            if not line.users:
                del self._lines[connected.key]
                await line.line.close()

    async def close(self) -> None:
        """All of them. Jogs end; other motions and programs of devices go on."""
        for controller in list(self._devices):
            await self._close(controller)


NO_ANSWER = Message("devices.no-answer", "{problem}{others}")


async def _device_at(address: DeviceAddress, line: DriverLine[Any, Any]) -> DevicePart:
    """Open the driver, which moves nothing. Raises `Misuse`, `Refusal`, `LineFailure`."""
    kind = DRIVERS[address.kind]
    try:
        return await kind.part(address, line)
    except NoAnswer as error:
        raise LineFailure(NO_ANSWER(problem=text_of(error), others=text_of(others_there(kind)))) from error
