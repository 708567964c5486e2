"""A connected device: what becomes of a write that had to wait for the settings to be kept."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest
from bridge_rig import BridgeRig
from virtual_loop import run_virtually

from steptwin.controller import SECOND
from steptwin.devices.device import MOST_WAITING, ConnectedDevice, DeviceSurroundings
from steptwin.drivers.subject import RawEffect
from steptwin.errors import LineFailure, Refusal, SteptwinError
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.subscriptions import Subscriptions


class Device:
    """Its settings are read once `is_read` is set."""

    answers_in_motion = True

    def __init__(self) -> None:
        self.is_read = asyncio.Event()
        self.is_asked = asyncio.Event()

    def effect_of(self, request: steps.Request | steps.Write) -> RawEffect:
        if isinstance(request, steps.Write):
            return RawEffect.WRITE
        return {3: RawEffect.LOOK, 5: RawEffect.STOP}.get(request.pdu[0], RawEffect.WRITE)

    def ended_by(self, request: steps.Request | steps.Write) -> frozenset[int]:
        return frozenset({1})

    async def ignoring(self, request: steps.Request) -> frozenset[int]:
        return frozenset()

    async def settings_text(self) -> str:
        self.is_asked.set()
        await self.is_read.wait()
        return "{}"


class Subject:
    name = "mic488"
    subscribers = Subscriptions()

    def __init__(self) -> None:
        self.done: list[object] = []
        self.published: list[str] = []

    async def do(self, wanted: object) -> str:
        self.done.append(wanted)
        return "done"

    async def poll(self) -> None:
        """Nothing happens."""

    async def read(self, *points: str) -> tuple[object, ...]:
        return ()

    def publish(self, payload: Any) -> None:
        self.published.append(payload.text)

    def forget(self) -> None:
        """Nothing is known."""


class Rig:
    def __init__(self) -> None:
        self.now = 0
        self.subject = cast("Any", Subject())
        self.device = cast("Any", Device())
        around = DeviceSurroundings(clock=lambda: self.now, keep=lambda name, text: "a file", on_internal=lambda error: None)
        self.shown = ConnectedDevice(self.subject, self.device, around)

    async def write(self) -> tuple[asyncio.Task[Any], steps.Write]:
        """A write that may begin a motion, while the settings are being read."""
        wanted = steps.Write((("mic488", "M1_POS_ABS", 100.0),))
        task = asyncio.create_task(self.shown._do(wanted))
        await self.device.is_asked.wait()
        return task, wanted


def test_a_write_goes_after_the_settings_are_kept() -> None:
    async def story() -> None:
        rig = Rig()
        task, wanted = await rig.write()
        assert rig.subject.done == []
        rig.device.is_read.set()
        await task
        assert rig.subject.done == [wanted]
        await rig.shown.close()

    asyncio.run(story())


def test_a_stop_meanwhile_overtakes_it() -> None:
    async def story() -> None:
        rig = Rig()
        task, wanted = await rig.write()
        stop = command.StopAxes("mic488", None)
        await rig.shown._do(stop)
        rig.device.is_read.set()
        with pytest.raises(Refusal, match="write was not sent: a stop was requested meanwhile"):
            await task
        assert rig.subject.done == [stop]
        # The settings are kept now: the next one goes at once.
        await rig.shown._do(wanted)
        assert rig.subject.done == [stop, wanted]
        await rig.shown.close()

    asyncio.run(story())


def test_settings_that_took_long_do_not_begin_a_motion() -> None:
    async def story() -> None:
        rig = Rig()
        task, _ = await rig.write()
        rig.now = 6 * SECOND
        rig.device.is_read.set()
        with pytest.raises(Refusal, match="it has waited more than 5 s; repeat it"):
            await task
        assert rig.subject.done == []
        await rig.shown.close()

    asyncio.run(story())


def request(function: int) -> steps.Request:
    return steps.Request("line", 1, bytes((function, 0, 0, 0, 1)), SECOND)


def test_raw_requests_wait_in_order_reads_do_not_and_a_stop_overtakes_them() -> None:
    async def story() -> None:
        rig = Rig()
        task, _ = await rig.write()
        waiting = [asyncio.create_task(rig.shown._do(request(6))) for _ in range(MOST_WAITING)]
        await asyncio.sleep(0)
        with pytest.raises(Refusal, match="request was not sent: 16 commands wait already"):
            await rig.shown._do(request(6))
        await rig.shown._do(request(3))
        await rig.shown._do(request(5))
        assert rig.subject.done == [request(3), request(5)]
        rig.device.is_read.set()
        ended = await asyncio.gather(task, *waiting, return_exceptions=True)
        assert {str(one).partition(": ")[2] for one in ended} == {"a stop was requested meanwhile"}
        await rig.shown._do(request(6))
        assert rig.subject.done == [request(3), request(5), request(6)]
        await rig.shown.close()

    asyncio.run(story())


class Twin:
    """What a shadow is for its device."""

    points = registers = ()

    def __init__(self) -> None:
        self.seen: list[tuple[object, int, int]] = []

    def did(self, wanted: object, begun: int, ended: int) -> None:
        self.seen.append((wanted, begun, ended))

    def compare(self, *_: object) -> bool:
        return False


def test_a_twin_beside_it_has_a_raw_motion_whatever_becomes_of_the_look_at_its_drive() -> None:
    async def story() -> None:
        rig = Rig()
        rig.device.is_read.set()
        is_looking = asyncio.Event()

        async def ignoring(_: steps.Request) -> frozenset[int]:
            if rig.subject.done:
                rig.now += SECOND
                is_looking.set()
                await asyncio.Event().wait()
            return frozenset({1})

        rig.device.ignoring = ignoring
        twin = Twin()
        rig.shown._shadow = cast("Any", twin)
        task = asyncio.create_task(rig.shown._do(request(6)))
        await is_looking.wait()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        assert twin.seen == [(request(6), 0, 0)]
        await rig.shown.close()

    asyncio.run(story())


@pytest.mark.parametrize(
    ("before", "after", "ignored"),
    [({1, 2}, {1, 2}, {1, 2}), (set(), {1}, set()), ({1}, set(), set()), ({1}, None, set())],
    ids=["off", "switched off by another one", "switched on by another one", "line lost"],
)
def test_a_raw_motion_is_ignored_where_the_drive_is_off_before_and_after_it(before: Any, after: Any, ignored: set[int]) -> None:
    async def story() -> None:
        rig = Rig()
        rig.device.is_read.set()

        async def ignoring(_: steps.Request) -> frozenset[int]:
            found = after if rig.subject.done else before
            if found is None:
                raise LineFailure("silence")
            return frozenset(found)

        rig.device.ignoring = ignoring
        assert await rig.shown._do(request(6)) == "done"
        said = [text for text in rig.subject.published if "ignored" in text]
        assert said == [f"motion ignored: M{axis} is not enabled" for axis in sorted(ignored)]
        await rig.shown.close()

    asyncio.run(story())


@pytest.mark.parametrize(("is_silent", "why"), [(False, "a stop was requested meanwhile"), (True, "silence")])
def test_a_raw_motion_is_not_sent_late_behind_the_look_at_its_drive(is_silent: bool, why: str) -> None:
    async def story() -> None:
        rig = Rig()
        rig.device.is_read.set()

        async def ignoring(_: steps.Request) -> frozenset[int]:
            if is_silent:
                raise LineFailure("silence")
            await rig.shown._do(request(5))
            return frozenset()

        rig.device.ignoring = ignoring
        with pytest.raises(SteptwinError, match=why):
            await rig.shown._do(request(6))
        assert request(6) not in rig.subject.done
        await rig.shown.close()

    asyncio.run(story())


PAUSE = command.ControlProgram("table", "pause")
STOP_PROGRAM = command.ControlProgram("table", "stop")


@pytest.mark.parametrize(
    ("stop", "is_ended"),
    [
        (command.StopAxes("table", 1), True),
        (command.StopAxes("table", 2), False),
        (command.StopAxes("table", None), True),
        (command.StopAll(), True),
        (PAUSE, False),
        (STOP_PROGRAM, True),  # its drive is switched off
        (steps.Write((("table", "M1_STOP", 1.0),)), True),
        (steps.Write((("table", "M2_STOP", 1.0),)), False),
        (steps.Write((("table", "M_STOP", 14.0),)), False),
        (steps.Write((("table", "PROGRAM_CTRL", 2.0),)), False),
        (steps.Write((("table", "PROGRAM_CTRL", 0.0),)), True),
    ],
    ids=str,
)
def test_a_stop_ends_dead_man_jogs_of_its_axes_only(stop: Any, is_ended: bool) -> None:
    async def story() -> None:
        rig = BridgeRig()
        await rig.open()
        await rig.subject.do(command.Enable("table", 1, on=True))
        await rig.subject.do(command.ControlProgram("table", "start"))
        held: Any = await rig.connected._begin_jog(command.Jog("table", 1, 5.0))
        held.lasts_ns = 5 * SECOND
        held.extend()
        await rig.wait(0.3)
        assert rig.is_moving
        await rig.connected._do(stop)
        if is_ended:
            assert not rig.is_moving
        await rig.wait(0.3)
        assert (held.over is not None, rig.is_moving) == (is_ended, not is_ended), held.over
        held.release()
        await rig.wait(1.0)
        await rig.close()

    run_virtually(story())
