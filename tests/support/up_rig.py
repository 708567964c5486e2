"""A twin of `steptwin up` in virtual time: its live world, the subject of its gateways, that of the studio."""

from __future__ import annotations

import asyncio
from typing import Any

from steptwin.controller import Nanos
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.worldmember import WorldMember
from steptwin.files.world import World
from steptwin.live.gateways import LiveWorldSubject
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.motion.profile import Profile
from steptwin.simulation.world.inputs import Download
from steptwin.subject.jogs import WorldJogs
from steptwin.subject.payloads import PlanPayload, StatusPayload
from steptwin.subject.subscriptions import filter_of

LOOPING = "M1 = ON\nA:\nPREL M1 40\nWAITPOS\nPREL M1 -40\nWAITPOS\nJUMP A\n"
MIC488 = """
[[line]]
name = "bus"
{timing}
[[mic488]]
name = "table"
line = "bus"
program = "p.prg"
[mic488.M1]
unit = "mm"
gear = 100.0
acc = 200.0
dec = 200.0
vel = 50.0
"""
M1486 = """
[[line]]
name = "bus"
kind = "m1486"
{timing}
[[m1486]]
name = "table"
line = "bus"
address = 7
variant = "{kind}"
"""
BEGINS = ("moves", "seeks")
"""Codes of events of an M1486, whose plans begin anew for other reasons, too."""
SLOW = {"MIC488": 'timing = "real"', "M1486": 'timing = "real"\nbaud = 300'}


class UpRig:
    """Made in a running virtual loop. ``kind``: MIC488, or the family of an M1486; ``is_slow``: its line takes its time."""

    def __init__(self, kind: str, *, is_slow: bool) -> None:
        self.kind = kind
        text = MIC488 if kind == "MIC488" else M1486
        timing = SLOW["MIC488" if kind == "MIC488" else "M1486"] if is_slow else ""
        self.world = World.from_toml(text.format(timing=timing, kind=kind), {"p.prg": LOOPING.encode()})
        loop: Any = asyncio.get_running_loop()
        self.live = LiveWorld(self.world)
        self.realtime = RealTimeDriver(self.live, loop.clock())
        pace = Pace(self.live, self.realtime, lambda _: None, has_clients=True)
        self.control = WorldControl(self.realtime, self.live, pace, list)
        self.subject = LiveWorldSubject(self.control, self.live)
        jogs = WorldJogs(self.live.subject, self.control.at_present)
        self.live.external_actor = jogs
        world = WorldMember(self.control, self.live.subject.subscribers, jogs)
        self.composite = CompositeSubject(world, lambda: self.live.now, self.live.subject.numbering)

    async def open(self) -> None:
        self.realtime.start()
        self.realtime.clock.run(1.0)
        self._followed = self.subject.subscribe(filter_of(["plan", "status"]), 100_000)
        self._begun: list[Nanos] = []

    async def close(self) -> None:
        self.realtime.close()

    async def wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds)
        self.realtime.enter()
        self.realtime.leave()

    async def begin_program(self, text: str) -> None:
        await self.subject.do(Download("table", "program", text))

    @property
    def now(self) -> Nanos:
        self.realtime.enter()
        return self.live.now

    @property
    def begun(self) -> list[Nanos]:
        """When an axis was given another motion."""
        for event in self._followed.take().events:
            match event.payload:
                case StatusPayload(code=code) if code in BEGINS:
                    self._begun.append(event.time)
                case PlanPayload(plan=Profile() as plan) if plan.moving(event.time):
                    self._begun.append(event.time)
        return self._begun

    @property
    def is_moving(self) -> bool:
        self.realtime.enter()
        (reading,) = self.subject.read("table.M1.moving" if self.kind == "MIC488" else "table.moving")
        return reading.value == 1.0
