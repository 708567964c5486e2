"""Jogs of motor records, and motions that SPMG pauses."""

from __future__ import annotations

import asyncio

import pytest
from bridge_rig import PLACE, BridgeRig
from motorrecord_rig import ME, OTHER, MotorRig, check, first_record
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.leases import JogLeases
from steptwin.simulation.script.steps import Request, Write
from steptwin.subject.commands import Command, Enable, StopAll, StopAxes


@pytest.mark.parametrize(("button", "sign"), [("JOGF", 1), ("JOGR", -1)])
def test_a_jog_ends_with_its_button(button: str, sign: int) -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin(button, 1)
        await rig.until(lambda: sign * float(rig.get("RBV")[0]) > 60.0)
        assert rig.get(button, "DMOV") == [1, 0]
        await rig.put(button, 0)
        await rig.over(put)
        await rig.stands()
        val, rbv, pressed = rig.get("VAL", "RBV", button)
        assert (val, pressed) == (rbv, 0)

    check(act)


def test_a_jog_goes_as_the_user_sees_it() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("DIR", 1)
        await rig.begin("JOGF", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
        assert float(rig.get("DRBV")[0]) < 0.0
        await rig.put("STOP", 1)
        await rig.stands()

    check(act)


def test_a_jog_ends_within_the_limits() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("HLM", 100.0)
        await rig.put("JOGF", 1)
        rbv, limit, pressed = rig.get("RBV", "LVIO", "JOGF")
        assert 50.0 < float(rbv) <= 100.0
        assert (limit, pressed) == (1, 0)
        await rig.put("HLM", float(rbv) + 1.0)
        await rig.refused("JOGF", 1, Misuse, "a jog would leave 0 to")

    check(act)


def test_a_jog_ends_with_the_connection_of_its_client() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("JOGF", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
        await rig.controller.leave(OTHER.circuit)
        begin = float(rig.get("RBV")[0])
        await rig.until(lambda: float(rig.get("RBV")[0]) > begin + 100.0)
        await rig.controller.leave(ME.circuit)
        await rig.over(put)
        await rig.stands()
        assert rig.get("JOGF", "DMOV") == [0, 1]

    check(act)


def test_a_move_instead_of_a_jog() -> None:
    async def act(rig: MotorRig) -> None:
        jog = await rig.begin("JOGF", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
        await rig.put("VAL", 200.0)
        await rig.over(jog)
        assert rig.get("RBV", "JOGF", "MISS") == [200.0, 0, 0]

    check(act)


# ---------------------------------------------------------------------- SPMG


def test_stop_of_spmg() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 1000.0)
        await rig.put("SPMG", 0)
        await rig.over(put)
        await rig.stands()
        val, rbv = rig.get("VAL", "RBV")
        assert val == rbv
        for name in ("VAL", "JOGF", "HOMF", "TWF"):
            await rig.refused(name, 1, Refusal, "SPMG is Stop")
        await rig.put("SPMG", 3)
        await rig.tick()
        assert rig.get("DMOV", "MOVN") == [1, 0]
        await rig.put("VAL", 5.0)
        assert rig.get("RBV", "SPMG") == [5.0, 3]

    check(act)


def test_pause_and_go() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 100.0)
        await rig.put("SPMG", 1)
        await rig.until(lambda: rig.get("MOVN") == [0])
        assert rig.get("DMOV", "VAL") == [0, 100.0]
        assert float(rig.get("RBV")[0]) < 100.0
        assert not put.done()
        await rig.refused("JOGF", 1, Refusal, "SPMG is Pause")
        await rig.put("SPMG", 3)
        await rig.over(put)
        assert rig.get("RBV", "DMOV", "SPMG") == [100.0, 1, 3]

    check(act)


def test_a_target_that_is_given_in_a_pause() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("SPMG", 1)
        put = await rig.begin("VAL", 10.0)
        later = await rig.begin("VAL", 12.0)
        assert rig.get("VAL", "RBV", "DMOV", "MOVN") == [12.0, 0.0, 0, 0]
        await rig.put("SPMG", 2)
        await rig.over(put)
        await rig.over(later)
        assert rig.get("RBV", "SPMG") == [12.0, 1]
        again = await rig.begin("VAL", 20.0)
        await rig.put("STOP", 1)
        await rig.over(again)
        assert rig.get("VAL", "RBV", "DMOV") == [12.0, 12.0, 1]

    check(act)


def test_with_move_each_motion_ends_with_a_pause() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("SPMG", 2)
        jog = await rig.begin("JOGF", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
        await rig.put("JOGF", 0)
        await rig.over(jog)
        assert rig.get("SPMG") == [1]

    check(act)


# ---------------------------------------------------------------------- SET, FOFF, DIR


def test_a_jog_that_another_gateway_has_stopped_does_not_go_on() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("JOGF", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
        rig.world.inner.do(StopAxes("table"))
        await rig.tick()
        begin = float(rig.get("RBV")[0])
        await rig.over(put)
        await rig.stands()
        assert rig.get("RBV", "JOGF") == [begin, 0]
        put = await rig.begin("JOGF", 1)  # a new press
        await rig.until(lambda: float(rig.get("RBV")[0]) > begin + 5.0)
        await rig.put("JOGF", 0)
        await rig.over(put)

    check(act)


@pytest.mark.parametrize(
    "stop", [StopAxes("table"), StopAxes("table", 1), StopAll(), Write((("table", "M1_STOP", 1.0),))], ids=str
)
@pytest.mark.parametrize("is_of_gateway", [False, True])
def test_a_move_that_waits_for_go_does_not_outlast_a_stop_by_others(stop: Command, is_of_gateway: bool) -> None:
    async def act(rig: MotorRig) -> None:
        for has_begun in (False, True):
            await rig.put("SPMG", 3 if has_begun else 1)
            put = await rig.begin("VAL", 1000.0)
            if has_begun:
                await rig.until(lambda: float(rig.get("RBV")[0]) > 5.0)
                await rig.put("SPMG", 1)
            await rig.until(lambda: rig.get("MOVN") == [0])
            rig.world.inner.do(StopAxes("table", 2))
            await rig.tick()
            assert not put.done()
            if is_of_gateway:
                await GatewayClient("another", Role.ENGINEER).do(rig.world, stop)
            else:
                rig.world.inner.do(stop)
            there = rig.get("RBV")
            await rig.put("SPMG", 3)
            with pytest.raises(Refusal, match="the motion was stopped while it waited for Go"):
                await rig.over(put)
            await rig.stands()
            assert (rig.get("RBV"), rig.get("VAL")) == (there, there)

    check(act)


@pytest.mark.parametrize(
    "stop",
    [
        StopAxes("table"),
        StopAxes("table", 1),
        StopAll(),
        Write((("table", "M1_STOP", 1.0),)),
        Write((("table", "M_STOP", 3.0),)),
        Request(PLACE, 1, bytes.fromhex("0507d4ff00"), SECOND),
    ],
    ids=str,
)
def test_a_move_of_a_device_that_waits_for_go_does_not_outlast_a_stop_by_others(stop: Command) -> None:
    async def story() -> None:
        bridge = BridgeRig()
        await bridge.open()
        await bridge.subject.do(Enable("table", 1))
        controller, record = first_record(bridge.subject, JogLeases(bridge.subject), Role.ENGINEER)
        await record.refresh()
        await record.put(ME, "SPMG", 1)
        put = asyncio.create_task(record.put(ME, "VAL", 1000.0))
        await asyncio.sleep(0.1)
        await bridge.subject.do(Write((("table", "M2_STOP", 1.0),)))
        await controller.refresh()
        assert not put.done()
        await bridge.subject.do(stop)
        await record.put(ME, "SPMG", 3)
        with pytest.raises(Refusal, match="the motion was stopped while it waited for Go"):
            await put
        await bridge.wait(0.5)
        assert not bridge.is_moving
        await controller.close()
        await bridge.close()

    run_virtually(story())
