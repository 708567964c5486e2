"""Devices at serial ports of a browser: what a page may send to them, and how ports are opened and lost."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from virtual_loop import run_virtually

from steptwin.drivers.exchange import LineLost
from steptwin.drivers.subject import RawEffect
from steptwin.errors import Misuse, Refusal
from steptwin.inpage.devices import refuse_without_end
from steptwin.inpage.serialports import SerialPorts
from steptwin.mic488.datasheet import datasheet_of
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.commands import Command

ENDS: tuple[Command, ...] = (
    command.Move("table", 1, to=20.0),
    command.Enable("table", 1),
    command.ReadState("table"),
    steps.Request("bus", 1, b"\x03\x27\x24\x00\x02"),
    steps.Write((("table", "M1_VMAX", 20.0), ("table", "m1_en", 1.0))),
)
NEED_NOT_END: tuple[Command, ...] = (
    command.Home("table", 1, -20.0),
    command.Jog("table", 1, 20.0),
    command.ControlProgram("table", "start"),
    steps.Send("bus", b"G+\r"),
    steps.Request("bus", 1, b"\x05\x07\xd0\xff\x00"),
    steps.Write((("table", "M1_VMAX", 20.0), ("table", "M1_JOG_PLUS", 1.0))),
    steps.Write((("table", "PROGRAM_CTRL", 1.0),)),
    steps.Write((("table", "unknown", 1.0),)),
)


class Part:
    datasheet = datasheet_of("1.70")

    def effect_of(self, wanted: steps.Request) -> RawEffect:
        return RawEffect.LOOK if wanted.pdu[0] == 3 else RawEffect.WRITE


def test_a_device_is_sent_only_what_ends_by_itself() -> None:
    part: Any = Part()
    for wanted in ENDS:
        refuse_without_end(part, wanted)
    for wanted in NEED_NOT_END:
        with pytest.raises(Refusal, match="need not end by itself"):
            refuse_without_end(part, wanted)


class Page:
    def __init__(self) -> None:
        self.asked: list[tuple[object, ...]] = []

    def openPort(self, number: int, baud: int) -> None:  # noqa: N802
        self.asked.append(("open", number, baud))

    def writePort(self, number: int, data: bytes) -> None:  # noqa: N802
        self.asked.append(("write", number, data))

    def closePort(self, number: int) -> None:  # noqa: N802
        self.asked.append(("close", number))


class Heard(asyncio.Protocol):
    def __init__(self) -> None:
        self.heard: list[object] = []

    def data_received(self, data: bytes) -> None:
        self.heard.append(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self.heard.append(str(exc))


def test_a_port_is_opened_lost_and_opened_again() -> None:
    async def visit() -> None:
        page, first, second = Page(), Heard(), Heard()
        ports = SerialPorts(page)
        with pytest.raises(Misuse, match="ttyUSB0"):
            ports.endpoint("/dev/ttyUSB0", 9600)
        endpoint = ports.endpoint(ports.add(1, "USB"), 9600)

        failing = asyncio.ensure_future(endpoint.connect(Heard))
        await asyncio.sleep(0)
        ports.failed(1, "it is in use")
        with pytest.raises(LineLost, match="webserial1 at 9600 bit/s: it is in use"):
            await failing

        opening = asyncio.ensure_future(endpoint.connect(lambda: first))
        await asyncio.sleep(0)
        ports.opened(1)
        transport = await opening
        transport.write(b"\x01")
        ports.received(1, b"\x02")
        ports.lost(1, "it was pulled out")
        ports.received(1, b"\x03")  # on its way already
        assert first.heard == [b"\x02", "it was pulled out"]

        given_up = asyncio.ensure_future(endpoint.connect(lambda: second))
        await asyncio.sleep(0)
        given_up.cancel()
        await asyncio.sleep(0)
        ports.opened(1)  # nobody waits for it
        assert page.asked == [("open", 1, 9600)] * 2 + [("write", 1, b"\x01"), ("open", 1, 9600), ("close", 1)]

    run_virtually(visit())
