"""A MIC488 behind a bridge in virtual time: a twin in memory whose line can fall silent, its driver, the subject of gateways."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from mic488_rig import MM, controller, loaded

from steptwin.commands.bridge import _Devices, connections_of
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.device import ConnectedDevice, DeviceSurroundings
from steptwin.drivers.mic488.driver import AsyncMic488
from steptwin.drivers.mic488.lines import modbus_exchanger
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.place import LineAddress
from steptwin.drivers.subject import AsyncDeviceSubject
from steptwin.drivers.tasks import TaskLine
from steptwin.live.cell import Cell
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program import ProgramState
from steptwin.subject.events import Numbering
from steptwin.wire.slave import TcpSlavePort
from steptwin.world.kernel import Kernel
from steptwin.world.script import Write

AXIS = 1
PROGRAM = "MAIN:\nDELAY 0.1\nJUMP MAIN\n"
PLACE = "memory"


class SilentLine:
    """A Modbus TCP line to a twin. While it is silent, what is sent waits, in its order."""

    def __init__(self, cell: Cell, device: Mic488Device) -> None:
        self._cell = cell
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
        now = self._cell.enter()
        answer = self._port.exchange(data, now)
        self._cell.leave()
        if answer and self._protocol is not None:
            asyncio.get_running_loop().call_soon(self._protocol.data_received, answer)

    def close(self) -> None:
        if self._protocol is not None:
            self._protocol.connection_lost(None)

    abort = close


class BridgeRig:
    """Made in a running virtual loop. ``subject`` is that of gateways, ``composite`` that of the studio."""

    def __init__(self) -> None:
        program, _ = loaded(PROGRAM)
        self.device = Mic488Device(controller(MM), "1.70", programs={0: program})
        kernel = Kernel()
        kernel.add("table", self.device)
        loop: Any = asyncio.get_running_loop()
        self.cell = Cell(kernel, loop.clock())
        self.line = SilentLine(self.cell, self.device)

    async def open(self) -> None:
        self.cell.start()
        loop = asyncio.get_running_loop()
        endpoint: Any = self.line
        exchanger, notes = modbus_exchanger(LineAddress(endpoint, framed=True), 100.0, None)
        driver_line: TaskLine[Any, Any] = TaskLine(endpoint, exchanger, notes)
        await driver_line.open()
        mic = AsyncMic488(driver_line, 1, firmware="1.70", config=self.device.config, timeout_s=3.0, observe=True)
        await mic.open()
        numbering = Numbering({})

        def now() -> int:
            return round(loop.time() * 1e9)

        self.composite = CompositeSubject(None, now, numbering)
        part = Mic488Part(mic)
        subject = AsyncDeviceSubject("table", part, clock=now, numbering=numbering)
        around = DeviceSurroundings(clock=now, keep=lambda name, text: "a file", on_internal=self._fail)
        self.connected = ConnectedDevice(subject, part, around)
        self.composite.add(self.connected)
        self.subject = _Devices("cell", self.composite, connections_of(self.composite, self._fail))
        await self.subject.do(Write((("table", "USER_REGISTER[5]", 0.0),)))  # its settings are kept now

    def _fail(self, error: Exception) -> None:
        raise error

    async def close(self) -> None:
        await self.connected.close()
        self.cell.close()

    async def wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds)
        self.cell.enter()
        self.cell.leave()

    @property
    def is_moving(self) -> bool:
        self.cell.enter()
        return self.device.axes[AXIS - 1].profile.moving(self.cell.kernel.now)

    @property
    def is_running(self) -> bool:
        return self.device.program.state is ProgramState.RUNNING

    @property
    def position(self) -> float:
        self.cell.enter()
        return self.device.axes[AXIS - 1].profile.position(self.cell.kernel.now)
