"""Fields as Channel Access has them: within its bounds, with units and limits; nothing is published twice."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from caproto import ChannelType
from gateway_rig import GatewayWorld
from motorrecord_rig import CHIP, ME, PLAIN, MotorRig, check
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.errors import Misuse
from steptwin.gateways.epics.channels import PvDatabase
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.motorfields import ProgressBit
from steptwin.gateways.epics.pointrecord import PointRecord
from steptwin.gateways.epics.records import FieldValue
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.points import points_of
from steptwin.gateways.sampling import Sampler
from steptwin.subject.commands import Command, Enable, Move, ReadState
from steptwin.subject.contract import Result


async def ends(rig: MotorRig, name: str) -> list[object]:
    """Unit and limits of display and control."""
    metadata: Any = (await PvDatabase({"x": rig.record})[name].read(ChannelType.CTRL_DOUBLE))[0]
    limits = (metadata.lower_disp_limit, metadata.upper_disp_limit, metadata.lower_ctrl_limit, metadata.upper_ctrl_limit)
    return [metadata.units, *limits]


def test_the_highest_bit_of_mip_is_no_sign() -> None:
    async def act(rig: MotorRig) -> None:
        rig.world.inner.do(Move("table", 1, to=20.0))
        await rig.tick()
        read: Any = await PvDatabase({"x": rig.record})["x.MIP"].read(ChannelType.LONG)
        assert [*read[1]] == [ProgressBit.EXTERNAL]
        await rig.stands()

    check(act)


def test_units_are_as_long_as_there_is_room() -> None:
    """EPICS has 8 bytes for them, an M1486 counts in min. microsteps."""

    async def act(rig: MotorRig) -> None:
        assert (await ends(rig, "x"))[0] == b"min. mi"

    check(act, CHIP)


def test_limits_and_units_are_those_of_each_field() -> None:
    async def act(rig: MotorRig) -> None:
        whole = 21474836.47
        assert await ends(rig, "x") == [b"mm", -21474836.48, whole, -21474836.48, whole]
        assert await ends(rig, "x.VELO") == [b"mm/s", 0.0, 640.0, 0.0, 640.0]
        assert await ends(rig, "x.ACCL") == [b"s", 0.0, 0.0, 0.0, 0.0]
        await rig.put("HLM", 50.0)
        await rig.put("OFF", 5.0)
        assert await ends(rig, "x") == [b"mm", 5.0, 55.0, 5.0, 55.0]
        assert await ends(rig, "x.DRBV") == [b"mm", 0.0, 50.0, 0.0, 50.0]

    check(act, PLAIN)


class _Counted:
    """How often a channel publishes."""

    def __init__(self, channel: Any) -> None:
        self.times = 0
        self._publish = channel.publish
        channel.publish = self

    async def __call__(self, *arguments: Any) -> None:
        self.times += 1
        await self._publish(*arguments)


@pytest.mark.parametrize(("name", "value"), [("MRES", float("nan")), ("HLM", 10.0)])
def test_what_has_not_changed_is_not_published_again(name: str, value: FieldValue) -> None:
    """Not even what is not a number: MRES where pulses per unit are not known."""

    async def act(rig: MotorRig) -> None:
        rig.record.values[name] = value
        counted = _Counted(PvDatabase({"x": rig.record})[f"x.{name}"])
        await rig.tick()
        await rig.tick()
        assert counted.times == 0
        rig.record.values[name] = 2.0
        await rig.tick()
        assert counted.times == 1

    check(act)


def test_texts_are_as_long_as_there_is_room_in_letters_that_there_are() -> None:
    async def act(rig: MotorRig) -> None:
        rig.record.values["DESC"] = "położenie °" + "x" * 60
        found = (await PvDatabase({"x": rig.record})["x.DESC"].read(ChannelType.STRING))[1]
        assert found == ["po?o?enie °".encode("latin-1") + b"x" * 28]

    check(act)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 0.0, -1.0])
def test_a_point_refuses_what_is_no_value_of_it(value: float) -> None:
    async def act() -> None:
        world = GatewayWorld(PLAIN)
        part = world.description.controllers[0]
        controller = EpicsController("table", world, Sampler(world.samples, {}), JogLeases(world), Role.ENGINEER)
        points = points_of(part, world.description, ["M1_VMAX"])
        record = PointRecord("ST:velocity", points[-1], controller)
        with pytest.raises(Misuse, match=r"ST:velocity: .*(expected a number|permitted are numbers above 0)$"):
            await record.put(ME, "VAL", value)
        assert world.done == []

    run_virtually(act())


def test_a_controller_that_does_not_answer_holds_up_no_other() -> None:
    async def act() -> None:
        world = GatewayWorld('[[mic488]]\nname = "table"\n[[mic488]]\nname = "other"\n')
        answers, do = asyncio.Event(), world.do

        async def slow(wanted: Command) -> Result:
            if isinstance(wanted, ReadState) and wanted.controller == "other":
                await answers.wait()
            return await do(wanted)

        world.do = slow  # type: ignore[method-assign]
        sampler = Sampler(world.samples, {})
        table, other = (EpicsController(name, world, sampler, JogLeases(world), Role.ENGINEER) for name in ("table", "other"))
        looking = other.look()
        await table.refresh()
        assert not looking.done()
        answers.set()
        await other.refresh()
        assert looking.done()
        other.look()
        await other.close()

    run_virtually(act())


def test_who_asks_while_only_news_are_read_gets_a_whole_sample() -> None:
    async def act() -> None:
        world = GatewayWorld(PLAIN)
        answers, reads, do = asyncio.Event(), asyncio.Queue[tuple[str, ...] | None](), world.do

        async def slow(wanted: Command) -> Result:
            if isinstance(wanted, ReadState):
                reads.put_nowait(wanted.parts)
                if wanted.parts is not None:
                    await answers.wait()
            return await do(wanted)

        sampler = Sampler(world.samples, {})
        table = EpicsController("table", world, sampler, JogLeases(world), Role.ENGINEER)
        await table.refresh()
        world.do = slow  # type: ignore[method-assign]
        await do(Enable("table", 1))
        table.look()
        assert await reads.get()
        asking = asyncio.create_task(table.refresh())
        await asyncio.sleep(0)
        answers.set()
        await asking
        assert reads.get_nowait() is None
        await table.close()

    run_virtually(act())
