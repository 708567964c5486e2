"""A device behind a bridge in virtual time: a twin in memory whose line can fall silent, its driver, the subject of gateways.

`BridgeRig` has a MIC488, `ChipBridgeRig` an M1486.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from chip_rig import ChipWire, chip_task_line
from mic488_rig import MM, controller, loaded

from steptwin.controller import SECOND, Nanos
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.device import ConnectedDevice, DeviceSurroundings
from steptwin.drivers.lineaddress import LineAddress
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.mic488.driver import AsyncMic488
from steptwin.drivers.mic488.lines import modbus_exchanger
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.subject import AsyncDeviceSubject, DevicePart
from steptwin.drivers.tasks import TaskLine
from steptwin.live.bridge import _Devices, connections_of
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program import ProgramState
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.script.steps import Write
from steptwin.subject.events import Numbering
from steptwin.wire.slave import TcpSlavePort

AXIS = 1
PROGRAM = "MAIN:\nDELAY 0.1\nJUMP MAIN\n"
PLACE = "memory"
ADDRESS = 7
BEGINS = ("moves", "seeks")
"""Codes of events of an M1486."""


class SilentLine:
    """A Modbus TCP line to a twin. While it is silent, what is sent waits, in its order."""

    def __init__(self, realtime: RealTimeDriver, device: Mic488Device) -> None:
        self._realtime = realtime
        self._port = TcpSlavePort({1: device})
        self._protocol: asyncio.Protocol | None = None
        self._waiting: list[bytes] = []
        self._is_silent = False

    def __str__(self) -> str:
        return PLACE

    def fall_silent(self) -> None:
        self._is_silent = True

    def answer_again(self) -> None:
        self._is_silent = False
        waiting, self._waiting = self._waiting, []
        for data in waiting:
            self.write(data)

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> Any:
        self._protocol = make()
        self._protocol.connection_made(self)  # type: ignore[arg-type]
        return self

    # ------------------------------------------------------------------ as a transport

    def write(self, data: bytes) -> None:
        if self._is_silent:
            self._waiting.append(data)
            return
        now = self._realtime.enter()
        answer = self._port.exchange(data, now)
        self._realtime.leave()
        if answer and self._protocol is not None:
            asyncio.get_running_loop().call_soon(self._protocol.data_received, answer)

    def close(self) -> None:
        if self._protocol is not None:
            self._protocol.connection_lost(None)

    abort = close


class BridgedDevice:
    """A device as a bridge shows it. ``subject`` is that of gateways, ``composite`` that of the studio."""

    composite: CompositeSubject
    connected: ConnectedDevice
    subject: _Devices

    def add(self, part: DevicePart) -> None:
        loop = asyncio.get_running_loop()
        numbering = Numbering({})

        def now() -> int:
            return round(loop.time() * 1e9)

        self.composite = CompositeSubject(None, now, numbering)
        around = DeviceSurroundings(clock=now, keep=lambda name, text: "a file", on_internal=self._fail)
        self.connected = ConnectedDevice(AsyncDeviceSubject("table", part, clock=now, numbering=numbering), part, around)
        self.composite.add(self.connected)
        self.subject = _Devices("cell", self.composite, connections_of(self.composite, self._fail))

    def _fail(self, error: Exception) -> None:
        raise error


class BridgeRig(BridgedDevice):
    """Made in a running virtual loop."""

    def __init__(self) -> None:
        program, _ = loaded(PROGRAM)
        self.device = Mic488Device(controller(MM), "1.70", programs={0: program})
        scheduler = Scheduler()
        scheduler.add("table", self.device)
        loop: Any = asyncio.get_running_loop()
        self.realtime = RealTimeDriver(scheduler, loop.clock())
        self.line = SilentLine(self.realtime, self.device)

    async def open(self) -> None:
        self.realtime.start()
        endpoint: Any = self.line
        exchanger, shared = modbus_exchanger(LineAddress(endpoint, framed=True), 100.0, None)
        driver_line: TaskLine[Any, Any] = TaskLine(endpoint, exchanger, shared)
        await driver_line.open()
        mic = AsyncMic488(driver_line, 1, firmware="1.70", config=self.device.config, timeout_s=3.0, observe=True)
        await mic.open()
        self.add(Mic488Part(mic))
        await self.subject.do(Write((("table", "USER_REGISTER[5]", 0.0),)))  # its settings are kept now

    async def close(self) -> None:
        await self.connected.close()
        self.realtime.close()

    async def wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds)
        self.realtime.enter()
        self.realtime.leave()

    @property
    def is_moving(self) -> bool:
        self.realtime.enter()
        return self.device.axes[AXIS - 1].profile.moving(self.realtime.scheduler.now)

    @property
    def is_running(self) -> bool:
        return self.device.program.state is ProgramState.RUNNING

    @property
    def position(self) -> float:
        self.realtime.enter()
        return self.device.axes[AXIS - 1].profile.position(self.realtime.scheduler.now)


class ChipBridgeRig(BridgedDevice):
    """Made in a running virtual loop, too. ``family``: of the M1486, such as E1."""

    def __init__(self, family: str) -> None:
        self.wire = ChipWire(family, (ADDRESS,))

    async def open(self) -> None:
        loop: Any = asyncio.get_running_loop()
        loop.now_ns = max(loop.now_ns, self.wire.now)
        self.line = chip_task_line(self.wire)
        await self.line.open()
        self.chip = AsyncM1486(self.line, ADDRESS)
        await self.chip.open()
        self.add(M1486Part(self.chip))

    async def close(self) -> None:
        await self.connected.close()
        await self.line.close()

    async def wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds)

    async def begin_program(self, text: str) -> None:
        """As another driver does it: a bridge takes no programs of an M1486."""
        await self.chip.download(text)

    @property
    def now(self) -> Nanos:
        return round(asyncio.get_running_loop().time() * SECOND)

    @property
    def begun(self) -> list[Nanos]:
        """When motions have begun."""
        return [event.time for _, event in self.wire.happened if event.code in BEGINS]

    @property
    def is_moving(self) -> bool:
        return self.wire.moving(ADDRESS)
