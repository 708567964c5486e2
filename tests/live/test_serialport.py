"""A serial port, played by a pty: we are on the device's end, the other end is the wire."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import LineFailure
from steptwin.live import serialport
from steptwin.live.clock import Clock
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.serialport import SerialLink
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.wire.slave import RtuSlavePort

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]

REQUEST = bytes.fromhex("010213880008FD62")
ANSWER = bytes.fromhex("01020100A188")


class Adapter:
    """A pluggable serial adapter under a stable name, as udev gives them."""

    def __init__(self, device: Path) -> None:
        self.device = device
        self.wire, slave = os.openpty()
        os.set_blocking(self.wire, False)
        device.unlink(missing_ok=True)
        device.symlink_to(os.ttyname(slave))
        self._slave = slave

    def unplug(self) -> None:
        os.close(self._slave)
        os.close(self.wire)
        self.device.unlink(missing_ok=True)

    async def ask(self, request: bytes, count: int) -> bytes:
        os.write(self.wire, request)
        data = b""
        deadline = time.monotonic() + 60.0
        while len(data) < count and time.monotonic() < deadline:
            try:
                data += os.read(self.wire, count - len(data))
            except BlockingIOError:
                await asyncio.sleep(0.001)
        return data


def on_line(device: Path, play: Callable[[SerialLink, list[str]], Awaitable[Any]]) -> Any:
    async def scene() -> Any:
        mic = Mic488Device(ControllerConfig())
        scheduler = Scheduler()
        scheduler.add("1", mic)
        notices: list[str] = []
        link = SerialLink(RealTimeDriver(scheduler, Clock()), str(device), 19200, lambda: RtuSlavePort({1: mic}), notices.append)
        try:
            await link.open()
            return await play(link, notices)
        finally:
            await link.close()
            await asyncio.sleep(0)

    return asyncio.run(scene())


async def told(notices: list[str], count: int) -> None:
    for _ in range(5000):
        if len(notices) >= count:
            break
        await asyncio.sleep(0.001)


def test_requests_are_answered(tmp_path: Path) -> None:
    adapter = Adapter(tmp_path / "ttyUSB0")

    async def play(link: SerialLink, notices: list[str]) -> tuple[bytes, bytes, list[str]]:
        one = await adapter.ask(REQUEST, len(ANSWER))
        many = await adapter.ask(REQUEST * 100, 100 * len(ANSWER))
        return one, many, notices

    assert on_line(adapter.device, play) == (ANSWER, ANSWER * 100, [])
    adapter.unplug()


def test_a_device_that_is_pulled_out_is_served_again_when_it_is_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serialport, "RETRY_S", 0.01)
    device = tmp_path / "ttyUSB0"
    first = Adapter(device)

    async def play(link: SerialLink, notices: list[str]) -> tuple[bytes, list[str]]:
        await first.ask(REQUEST, len(ANSWER))
        first.unplug()
        await told(notices, 1)
        second = Adapter(device)
        await told(notices, 2)
        answer = await second.ask(REQUEST, len(ANSWER))
        await link.close()
        second.unplug()
        return answer, notices

    answer, (gone, back) = on_line(device, play)
    assert answer == ANSWER
    assert gone.startswith(f"serial port {device} was lost (")
    assert back == f"serial port {device} is back"


def test_closing_while_it_is_looked_for(tmp_path: Path) -> None:
    adapter = Adapter(tmp_path / "ttyUSB0")

    async def play(link: SerialLink, notices: list[str]) -> int:
        adapter.unplug()
        await told(notices, 1)
        await link.close()
        return len(asyncio.all_tasks() - {asyncio.current_task()})

    before_it_is_cancelled = 1
    assert on_line(adapter.device, play) <= before_it_is_cancelled


def test_while_the_device_takes_nothing_nothing_is_read_and_what_is_said_unasked_is_lost(run: Run, make_realtime: Make) -> None:
    class Transport:
        def __init__(self) -> None:
            self.reading = True

        def pause_reading(self) -> None:
            self.reading = False

        def resume_reading(self) -> None:
            self.reading = True

    async def scene() -> list[tuple[bool, bool]]:
        realtime, mic = make_realtime()
        transport: Any = Transport()
        line = serialport._SerialProtocol(realtime, RtuSlavePort({1: mic}), print)
        line.connection_made(transport)
        seen = []
        for change in (line.pause_writing, line.resume_writing):
            change()
            seen.append((transport.reading, line._feed.is_read))
        return seen

    assert run(scene()) == [(False, False), (True, True)]


@pytest.mark.parametrize(
    ("name", "reason"), [("nothing", "no such file or directory"), ("file", "inappropriate ioctl for device")]
)
def test_what_is_no_serial_port(tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "file").touch()

    async def play(link: SerialLink, notices: list[str]) -> None: ...

    with pytest.raises(LineFailure, match=f"cannot open serial port {tmp_path / name} at 19200 bit/s: {reason}"):
        on_line(tmp_path / name, play)
