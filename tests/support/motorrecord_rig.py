"""A motor record of the EPICS gateway with a world in virtual time, without a server."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine

import pytest
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.controller import MILLISECOND
from steptwin.errors import SteptwinError
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.motorrecord import MotorRecord
from steptwin.gateways.epics.records import FieldValue, Putter
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.sampling import Sampler
from steptwin.subject.commands import Advance

ME = Putter("me", "here", ("127.0.0.1", 1))
OTHER = Putter("other", "there", ("127.0.0.1", 2))
TABLE = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 100.0
vel = 50.0
acc = 100.0
dec = 100.0
in_kl = "IN1"
in_kr = "IN2"
home_mode = "HOME1"
limit_mode = "KL+KR"
[[axis]]
name = "x"
drive = "table.M1"
pitch = 32.0
travel = [-60.0, 60.0]
start = 20.0
[[axis.switch]]
below = 0.0
to = "table.IN1"
[[axis.switch]]
above = 55.0
to = "table.IN2"
"""
"""x stands 20 mm above the switch KL; its position begins with 0."""
PLAIN = '[[mic488]]\nname = "table"\n[mic488.M1]\nunit = "mm"\ngear = 100.0\nvel = 50.0\nacc = 100.0\ndec = 100.0\n'
CHIP = '[[m1486]]\nname = "feed"\nline = "bus"\n[[line]]\nname = "bus"\nkind = "m1486"\n'
STEP_NS = 20 * MILLISECOND
LONGEST_S = 60.0


def first_record(subject: GatewaySubject, leases: JogLeases, role: Role) -> tuple[EpicsController, MotorRecord]:
    """Of the first axis of the first controller."""
    part = subject.description.controllers[0]
    controller = EpicsController(part.name, subject, Sampler(subject.samples, {}), leases, role)
    record = MotorRecord("ST:x", part, part.datasheet.axes[0], controller)
    controller.records.append(record)
    return controller, record


class MotorRig:
    """The record of the first axis; its world goes on while somebody waits."""

    def __init__(self, text: str, role: Role) -> None:
        self.world = GatewayWorld(text)
        self.leases = JogLeases(self.world)
        self.controller, self.record = first_record(self.world, self.leases, role)

    def get(self, *names: str) -> list[FieldValue]:
        return [self.record.value(name) for name in names]

    async def tick(self) -> None:
        await asyncio.sleep(STEP_NS / 1e9)
        self.world.inner.do(Advance(duration=STEP_NS))
        self.world.jogs.advance(self.world.world.now)
        await self.controller.refresh()

    async def until(self, is_there: Callable[[], bool]) -> None:
        for _ in range(round(LONGEST_S * 1e9 / STEP_NS)):
            if is_there():
                return
            await self.tick()
        raise AssertionError(self.record.values)

    async def begin(self, name: str, value: FieldValue, who: Putter = ME) -> asyncio.Task[None]:
        """A put that is waited for elsewhere."""
        put = asyncio.create_task(self.record.put(who, name, value))
        await self.tick()
        return put

    async def over(self, put: asyncio.Task[None]) -> None:
        await self.until(put.done)
        await put

    async def put(self, name: str, value: FieldValue, who: Putter = ME) -> None:
        await self.over(await self.begin(name, value, who))

    async def refused(self, name: str, value: FieldValue, kind: type[SteptwinError], text: str, who: Putter = ME) -> None:
        with pytest.raises(kind, match=text):
            await self.put(name, value, who)

    async def stands(self) -> None:
        await self.until(lambda: self.get("DMOV", "MOVN") == [1, 0])


def check(act: Callable[[MotorRig], Coroutine[None, None, None]], text: str = PLAIN, role: Role = Role.ENGINEER) -> None:
    async def run() -> None:
        rig = MotorRig(text, role)
        await rig.record.refresh()
        if role is Role.ENGINEER and "mic488" in text:
            await rig.put("CNEN", 1)
        await act(rig)
        rig.leases.close()

    run_virtually(run())
