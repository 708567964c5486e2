"""A command that the controller ignores is not done, and the audit log has why."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from bridge_rig import BridgeRig
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.errors import Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.subject import commands as command
from steptwin.subject.commands import Command
from steptwin.world.script import Write

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


def test_a_device_without_its_drive_is_sent_nothing() -> None:
    async def story() -> list[str]:
        rig = BridgeRig()
        await rig.open()
        found = await outcomes(rig.subject)
        await rig.close()
        return found

    assert run_virtually(story()) == ["refusal"] * 4 + ["done"] * 5
