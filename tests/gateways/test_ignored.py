"""A command that the controller ignores is not done, and the audit log has why."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from bridge_rig import PLACE, BridgeRig
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.controller import SECOND
from steptwin.errors import Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.modbus.gateway import MasterGateway
from steptwin.gateways.modbus.options import ModbusSpec
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import encoded, named
from steptwin.simulation.script.steps import Request, Write
from steptwin.subject import commands as command
from steptwin.subject.commands import Command
from steptwin.wire.pdu import encode_request

ME = GatewayClient("me", Role.ENGINEER)
MOTIONS: tuple[Command, ...] = (
    command.Move("table", 1, to=5.0),
    command.Move("table", 1, by=5.0),
    command.Home("table", 1, 5.0),
    Write((("table", "M1_POS_ABS", 5.0),)),
)


async def outcomes(subject: GatewaySubject) -> list[str]:
    """Of each motion, in the audit log and for the client."""
    logged: list[str] = []
    known: Any = subject
    known.audit = lambda who, do, fields, outcome: logged.append(outcome)
    for wanted in MOTIONS:
        with pytest.raises(Refusal, match=r"M1.* is (not enabled: switch its drive on|switched off: enable it) first"):
            await ME.do(subject, wanted)
    await ME.do(subject, command.Enable("table", 1))
    for wanted in MOTIONS:
        await ME.do(subject, wanted)
    return logged


def test_a_twin_without_its_drive() -> None:
    found = asyncio.run(outcomes(GatewayWorld('[[mic488]]\nname = "table"\n')))
    assert found == ["ignored: not enabled"] * 4 + ["done"] * 5


def test_a_twin_whose_answers_take_their_time() -> None:
    line = '[[line]]\nname = "bus"\nkind = "modbus"\ntiming = "real"\nbaud = 9600\n'
    world = GatewayWorld(f'{line}[[mic488]]\nname = "table"\nline = "bus"\n[[mic488]]\nname = "other"\nline = "bus"\nunit = 2\n')
    logged: list[str] = []
    world.audit = lambda who, do, fields, outcome: logged.append(outcome)

    async def switch_on(*, is_stopped: bool) -> None:
        """The world goes on while the command is on its way."""
        await asyncio.sleep(0.07)
        if is_stopped:
            world.inner.do(command.StopAxes("table"))
            world.inner.do(command.Enable("table", 1))
        world.inner.do(command.Advance(duration=SECOND))

    async def story() -> None:
        await ME.do(world, command.Enable("other", 1))
        for wanted in MOTIONS[:3]:
            with pytest.raises(Refusal, match="M1 is not enabled: switch its drive on first"):
                await ME.do(world, wanted)
        with pytest.raises(Refusal, match="a stop was requested meanwhile"):
            await asyncio.gather(switch_on(is_stopped=True), ME.do(world, MOTIONS[0]))
        world.inner.do(command.Enable("table", 1, on=False))
        world.inner.do(command.Advance(duration=SECOND))

        async def go_on() -> None:
            await asyncio.sleep(0.3)
            world.inner.do(command.Advance(duration=SECOND))

        for _ in "register", "register again":
            with pytest.raises(Refusal, match="M1 is not enabled: switch its drive on first"):
                await asyncio.gather(go_on(), ME.do(world, MOTIONS[3]))
        await ME.do(world, Write((("table", "M1_JOG_PLUS", 0.0), ("table", "M1_VMAX", 5.0))))
        world.inner.do(command.Enable("table", 1, on=False))
        world.inner.do(command.Advance(duration=SECOND))
        await ME.do(world, command.Enable("table", 1))
        await asyncio.gather(switch_on(is_stopped=False), ME.do(world, MOTIONS[0]))

    run_virtually(story())
    assert logged == ["done", *["ignored: not enabled"] * 3, "refusal", *["ignored: not enabled"] * 2, "done", "done", "done"]


def test_a_device_without_its_drive_is_sent_nothing() -> None:
    async def story() -> list[str]:
        rig = BridgeRig()
        await rig.open()
        found = await outcomes(rig.subject)
        await rig.close()
        return found

    assert run_virtually(story()) == ["refusal"] * 4 + ["done"] * 5


async def raw(rig: BridgeRig, asked: str) -> tuple[str, list[str]]:
    """What a Modbus master is answered, and the outcomes in the audit log."""
    logged: list[str] = []
    known: Any = rig.subject
    known.audit = lambda who, do, fields, outcome: logged.append(outcome)
    gateway = MasterGateway(ModbusSpec(listen="127.0.0.1:0", units={}, role=None), rig.subject, Path())
    (part,) = rig.subject.description.controllers
    return (await gateway.ask(ME, part, bytes.fromhex(asked))).hex(), logged


POSITION = encode_request(encoded(named(register_map("1.70"), "M1_POS_ABS"), 5.0, DataType.REAL)).hex()


@pytest.mark.parametrize("motion", [POSITION, "0507d8ff00"], ids=["M1_POS_ABS", "M1_JOG_PLUS"])
def test_a_raw_motion_that_a_device_ignores_is_answered_by_it_and_logged_as_ignored(motion: str) -> None:
    async def story() -> None:
        rig = BridgeRig()
        await rig.open()
        for is_on in (False, True):
            await rig.subject.do(command.Enable("table", 1, on=is_on))
            expected = rig.device.execute(bytes.fromhex(motion), rig.realtime.enter()).hex()
            assert await raw(rig, motion) == (expected, ["done" if is_on else "ignored: not enabled"])
            request = Request(PLACE, 1, bytes.fromhex(motion), SECOND)
            assert (await ME.do(rig.subject, request)).value == {"pdu": expected}
        for other in ("0507d80000", "0507d4ff00", "10271400010200ff"):  # a jog that is let go of, a stop, an output
            await rig.subject.do(command.Enable("table", 1, on=False))
            assert (await raw(rig, other))[1] == ["done"]
        await rig.close()

    run_virtually(story())
