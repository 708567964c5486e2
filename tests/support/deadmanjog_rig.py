"""Worlds with dead-man jogs, in virtual time."""

from __future__ import annotations

from textwrap import dedent

from steptwin.controller import MILLISECOND, Nanos
from steptwin.files.world import World
from steptwin.later import start
from steptwin.motion.divisions import profile_of
from steptwin.subject.commands import Enable, Jog
from steptwin.subject.jogs import ExtendableJog, WorldJogs
from steptwin.subject.payloads import FramePayload, PlanPayload
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

MIC = """
    [[line]]
    name = "bus"
    kind = "modbus"
    {timing}
    [[mic488]]
    name = "a"
    line = "bus"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = {acc}
    dec = {acc}
    vel = 40.0
"""
CHIPS = """
    [[line]]
    name = "chips"
    kind = "m1486"
    {timing}
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
    variant = "{variant}"
"""
TIMED = 'timing = "real"'


class Rig:
    """A world in virtual time with dead-man jogs, as a live world keeps them."""

    def __init__(self, text: str) -> None:
        self.world = World.from_toml(dedent(text))
        self.subject = WorldSubject(self.world)
        self.jogs = WorldJogs(self.subject)
        self.followed = self.subject.subscribe(filter_of(["plan", "frame"]), 100_000)

    def begin(self, wanted: Jog) -> ExtendableJog:
        return start(self.jogs.begin_jog(wanted)).result()

    def run(self, for_ms: float) -> None:
        end = self.world.now + round(for_ms * MILLISECOND)
        while (due := self.jogs.deadline()) is not None and due <= end:
            self.world.advance(max(due, self.world.now))
            self.world.sync_all()
            self.jogs.advance(self.world.now)
        self.world.advance(end)
        self.world.sync_all()

    def stands_at(self) -> Nanos:
        """When the last plan ends or ended."""
        end: Nanos = 0
        for event in self.followed.take().events:
            if isinstance(event.payload, PlanPayload):
                end = profile_of(event.payload.plan).end or event.time
        return end

    def sent(self) -> str:
        """What was typed on a line of chips."""
        frames = (event.payload for event in self.followed.take().events)
        return b"".join(one.data for one in frames if isinstance(one, FramePayload) and one.direction == "in").decode("ascii")

    def position(self, point: str) -> float:
        (reading,) = self.subject.read(point)
        assert reading.value is not None
        return reading.value


def mic(acc: float = 1000.0, timing: str = "") -> Rig:
    rig = Rig(MIC.format(acc=acc, timing=timing))
    rig.subject.do(Enable("a", 1))
    rig.run(100)
    return rig


def chip(variant: str = "A", timing: str = "") -> Rig:
    return Rig(CHIPS.format(variant=variant, timing=timing))
