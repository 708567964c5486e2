"""Several devices as one subject: which of them a command is for."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from steptwin.devices.composite import CompositeSubject
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.errors import Misuse
from steptwin.m1486.datasheet import datasheet_of
from steptwin.m1486.variants import DEFAULT
from steptwin.simulation.script import steps
from steptwin.subject.contract import ControllerDescription, Description, LineDescription
from steptwin.subject.events import Numbering
from steptwin.subject.subscriptions import Subscriptions

PLACE = "/dev/ttyUSB0"


class Chip:
    lost = None

    def __init__(self, unit: int) -> None:
        name = f"chip{unit}"
        controller = ControllerDescription(name, datasheet_of(DEFAULT), PLACE, unit, (), is_real=True)
        self.description = Description(name, (controller,), lines=(LineDescription(PLACE, "m1486", None),), commands=("send",))
        self.subscribers = Subscriptions()
        self.sent: list[bytes] = []

    def selected(self, data: bytes) -> int | None:
        return M1486Part.selected(cast(Any, None), data)

    async def do(self, wanted: steps.Send) -> None:
        self.sent.append(wanted.data)


def test_characters_go_to_the_chip_that_they_select() -> None:
    """A setting for one of several chips on a line must not reach another."""
    first, other = Chip(0), Chip(0xB)
    subject = CompositeSubject(None, lambda: 0, Numbering({}))
    subject.add(cast(Any, first))
    asyncio.run(subject.do(steps.Send(PLACE, b"V900\r")))
    subject.add(cast(Any, other))
    asyncio.run(subject.do(steps.Send(PLACE, b"xb\rV700\r")))
    for text in (b"V700\r", b"X7\rV700\r", b"XB"):
        with pytest.raises(Misuse, match="it begins with the address of one of them, X0, XB, and CR"):
            asyncio.run(subject.do(steps.Send(PLACE, text)))
    assert (first.sent, other.sent) == ([b"V900\r"], [b"xb\rV700\r"])
