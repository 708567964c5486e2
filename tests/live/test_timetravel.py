"""Time travel while a world goes on, and taking it back, in the virtual time of the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from tests.live.test_pace import READ_POSITION, Rig, feeder

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import result_of
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.live import timetravel as module
from steptwin.live.timetravel import WorldPastView, WorldTimeTravel
from steptwin.live.world import ClientPort
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
        self.time_travel = WorldTimeTravel(self.live, self.realtime, self.pace)

    def shown(self) -> tuple[Any, ...]:
        subject = self.control
        return (subject.do(ReadPoints(POINTS)).value, subject.do(ReadState("table")).value, subject.do(ReadState("drum")).value)

    async def end(self) -> World:
        await self.time_travel.close()
        return self.close()


async def at(view: WorldPastView, moment: Nanos) -> tuple[Any, ...]:
    await result_of(view.go(moment))
    subject = view.subject
    return (subject.do(ReadPoints(POINTS)).value, subject.do(ReadState("table")).value, subject.do(ReadState("drum")).value)


def test_every_moment_is_as_it_was_seen_while_the_world_goes_on(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        bus = ClientPort(rig.live, "bus", "tcp-1", "tcp")
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
        view = rig.time_travel.open()
        for moment in sorted(seen, key=lambda one: one % 1_300_000_007):
            assert await at(view, moment) == seen[moment]
        rig.realtime.enter()
        now = rig.world.now
        assert now >= max(seen)
        await asyncio.sleep(1)
        rig.realtime.enter()
        assert rig.world.now == now + SECOND
        view.close()
        await rig.end()
        assert rig.live.snapshots is None
        assert not rig.world.input_subscribers

    run(scene())


def test_another_moment_that_is_wanted_meanwhile_wins(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PART_S", 0.0)

    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(9.5)
        rig.realtime.enter()
        view = rig.time_travel.open()
        first = view.go(9 * SECOND + SECOND // 2)
        second = view.go(4 * SECOND + SECOND // 2)
        with pytest.raises(Refusal, match="another moment"):
            await result_of(first)
        await result_of(second)
        assert view.now == 4 * SECOND + SECOND // 2
        third = view.go(9 * SECOND + SECOND // 2)
        view.close()
        with pytest.raises(Refusal, match="the view of the past was closed"):
            await result_of(third)
        await rig.end()

    run(scene())


def test_what_is_not_kept_is_refused_and_looks_are_bounded(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(2)
        rig.realtime.enter()
        views = [rig.time_travel.open() for _ in range(module.MOST_VIEWS)]
        with pytest.raises(Refusal, match="too many views of the past: at most 8 viewers"):
            rig.time_travel.open()
        with pytest.raises(Misuse, match="the past is kept from 0 s to 2 s"):
            await result_of(views[0].go(3 * SECOND))
        await result_of(views[0].go(SECOND))
        views[0].close()
        rig.time_travel.open().close()
        await rig.end()

    run(scene())


def test_the_world_goes_back_to_what_is_looked_at_and_its_session_replays(run: Run) -> None:
    async def scene() -> World:
        rig = Back(feeder())
        rig.world.trace.let_go()
        bus = ClientPort(rig.live, "bus", "tcp-1", "tcp")
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
        view = rig.time_travel.open()
        await result_of(view.go(moment))
        view.go_back()
        view.close()
        assert rig.do("time")["paused"]
        assert rig.world.now == moment
        assert rig.shown() == seen
        bus.exchange(read, rig.world.now)
        rig.do("resume")
        await asyncio.sleep(1)
        rig.realtime.enter()
        assert rig.world.now == moment + SECOND
        later = rig.time_travel.open()
        assert await at(later, moment) == seen
        with pytest.raises(Misuse, match="is kept from 0 s to"):
            await result_of(later.go(moment + 2 * SECOND))
        later.close()
        return await rig.end()

    recording = recording_of(run(scene()))
    assert recording.replay().trace.digest() == recording.digest


def test_a_snapshot_that_is_restored_is_the_past_from_then_on(run: Run) -> None:
    async def scene() -> None:
        rig = Back(feeder())
        await asyncio.sleep(2.5)
        rig.control.do(TakeSnapshot("here"))
        rig.do("set", levels={"table.IN9": 1})
        await asyncio.sleep(1)
        rig.do("restore", name="here")
        rig.do("step", for_ns=2 * SECOND)
        view = rig.time_travel.open()
        ((_, _, level, _, _), *_) = await at(view, 3 * SECOND)
        assert level["value"] == 0.0
        view.close()
        await rig.end()

    run(scene())
