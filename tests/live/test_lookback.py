"""Looking back while a world goes on, and taking it back, in the virtual time of the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from tests.live.test_pace import READ_POSITION, Rig, feeder

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import result_of
from steptwin.files.session import session_of
from steptwin.files.world import World
from steptwin.live import lookback as module
from steptwin.live.lookback import Look, Lookback
from steptwin.live.world import PlacePort
from steptwin.subject.commands import ReadPoints, ReadState, TakeSnapshot

Run = Callable[..., Any]
POINTS = ("x.position", "table.M1.position", "table.IN9", "drum.counter", "time")


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow this machine is now."""
    monkeypatch.setattr(module, "PART_S", 3600.0)


class Back(Rig):
    """A live world with its past."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.lookback = Lookback(self.live, self.realtime, self.pace)

    def shown(self) -> tuple[Any, ...]:
        subject = self.control
        return (subject.do(ReadPoints(POINTS)).value, subject.do(ReadState("table")).value, subject.do(ReadState("drum")).value)

    async def end(self) -> World:
        await self.lookback.close()
        return self.close()


async def at(look: Look, moment: Nanos) -> tuple[Any, ...]:
    await result_of(look.go(moment))
    subject = look.subject
    return (subject.do(ReadPoints(POINTS)).value, subject.do(ReadState("table")).value, subject.do(ReadState("drum")).value)


def test_every_moment_is_as_it_was_seen_while_the_world_goes_on(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        bus = PlacePort(rig.live, "bus", "tcp-1", "tcp")
        read = bytes.fromhex("0001 0000 0006") + READ_POSITION[:-2]
        seen: dict[Nanos, tuple[Any, ...]] = {}
        for step in range(12):
            await asyncio.sleep(0.7)
            rig.realtime.enter()
            bus.exchange(read, rig.world.now)
            rig.do("set", levels={"table.IN9": step % 2})
            if step == 3:
                rig.do("press", button="start")
            seen[rig.world.now] = rig.shown()
        look = rig.lookback.open()
        for moment in sorted(seen, key=lambda one: one % 1_300_000_007):
            assert await at(look, moment) == seen[moment]
        rig.realtime.enter()
        now = rig.world.now
        assert now >= max(seen)
        await asyncio.sleep(1)
        rig.realtime.enter()
        assert rig.world.now == now + SECOND
        look.close()
        await rig.end()
        assert rig.live.history is None
        assert not rig.world.input_watchers

    run(scene())


def test_another_moment_that_is_wanted_meanwhile_wins(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PART_S", 0.0)

    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(9.5)
        rig.realtime.enter()
        look = rig.lookback.open()
        first = look.go(9 * SECOND + SECOND // 2)
        second = look.go(4 * SECOND + SECOND // 2)
        with pytest.raises(Refusal, match="another moment"):
            await result_of(first)
        await result_of(second)
        assert look.now == 4 * SECOND + SECOND // 2
        third = look.go(9 * SECOND + SECOND // 2)
        look.close()
        with pytest.raises(Refusal, match="the view of the past was closed"):
            await result_of(third)
        await rig.end()

    run(scene())


def test_what_is_not_kept_is_refused_and_looks_are_bounded(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(2)
        rig.realtime.enter()
        looks = [rig.lookback.open() for _ in range(module.MOST_LOOKS)]
        with pytest.raises(Refusal, match="8 viewers look back already"):
            rig.lookback.open()
        with pytest.raises(Misuse, match="the past is kept from 0 s to 2 s"):
            await result_of(looks[0].go(3 * SECOND))
        await result_of(looks[0].go(SECOND))
        looks[0].close()
        rig.lookback.open().close()
        await rig.end()

    run(scene())


def test_the_world_goes_back_to_what_is_looked_at_and_its_session_replays(run: Run) -> None:
    async def scene() -> World:
        rig = Back(feeder())
        rig.world.trace.let_go()
        bus = PlacePort(rig.live, "bus", "tcp-1", "tcp")
        read = bytes.fromhex("0001 0000 0006") + READ_POSITION[:-2]
        await asyncio.sleep(3.3)
        rig.do("set", levels={"table.IN9": 1})
        rig.do("press", button="start")
        await asyncio.sleep(1.2)
        rig.realtime.enter()
        seen, moment = rig.shown(), rig.world.now
        await asyncio.sleep(0.1)
        rig.do("set", levels={"table.IN9": 0})
        await asyncio.sleep(2)
        rig.realtime.enter()
        look = rig.lookback.open()
        await result_of(look.go(moment))
        look.go_back()
        look.close()
        assert rig.do("time")["paused"]
        assert rig.world.now == moment
        assert rig.shown() == seen
        bus.exchange(read, rig.world.now)
        rig.do("resume")
        await asyncio.sleep(1)
        rig.realtime.enter()
        assert rig.world.now == moment + SECOND
        later = rig.lookback.open()
        assert await at(later, moment) == seen
        with pytest.raises(Misuse, match="is kept from 0 s to"):
            await result_of(later.go(moment + 2 * SECOND))
        later.close()
        return await rig.end()

    session = session_of(run(scene()))
    assert session.replay().trace.digest() == session.digest


def test_a_snapshot_that_is_restored_is_the_past_from_then_on(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(2.5)
        rig.control.do(TakeSnapshot("here"))
        rig.do("set", levels={"table.IN9": 1})
        await asyncio.sleep(1)
        rig.do("restore", name="here")
        rig.do("step", for_ns=2 * SECOND)
        look = rig.lookback.open()
        ((_, _, level, _, _), *_) = await at(look, 3 * SECOND)
        assert level["value"] == 0.0
        look.close()
        await rig.end()

    run(scene())
