"""Jogs with a lease: a client that goes on calling does not begin again what was stopped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from bridge_rig import BridgeRig
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.errors import Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.leases import JogLeases
from steptwin.subject.commands import Advance, Enable, Jog, StopAxes

ME = GatewayClient("me", Role.ENGINEER)
LEASE_S = 0.5
FORWARDS, BACKWARDS = Jog("table", 1, 10.0), Jog("table", 1, -10.0)


class Rig:
    def __init__(self) -> None:
        self.world = GatewayWorld('[[mic488]]\nname = "table"\n[mic488.M1]\nunit = "mm"\nvel = 40.0\n')
        self.world.inner.do(Enable("table", 1))
        self.leases = JogLeases(self.world)

    async def call(self, wanted: Jog = FORWARDS) -> None:
        await self.leases.jog("session", ME, wanted, LEASE_S)

    async def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.world.inner.do(Advance(duration=20_000_000))
            self.world.jogs.advance(self.world.world.now)
            await asyncio.sleep(0.02)

    def stop(self) -> None:
        """By another client, of another gateway."""
        self.world.inner.do(StopAxes("table"))

    @property
    def position(self) -> Any:
        return self.world.read("table.M1.position")[0].value


def test_a_client_that_goes_on_calling_does_not_begin_a_stopped_jog_again() -> None:
    async def story() -> None:
        rig = Rig()
        await rig.call()
        await rig.wait(0.2)
        rig.stop()
        there = rig.position
        assert there > 0.5
        logged: list[str] = []
        rig.world.audit = lambda who, do, fields, outcome: logged.append(do)
        for _ in range(5):
            await rig.wait(0.2)
            with pytest.raises(Refusal, match=r"the jog has ended: .*; it can be begun again 0\.5 s after its last"):
                await rig.call()
        assert (rig.position, logged) == (there, []), "these calls are of a press that is in the audit log already"
        await rig.wait(LEASE_S + 0.1)
        await rig.call()
        await rig.wait(0.4)
        assert rig.position > there
        assert logged == ["jog"]
        rig.leases.close()

    run_virtually(story())


def test_the_other_direction_and_other_clients_need_not_wait() -> None:
    async def story() -> None:
        rig = Rig()
        for wanted, owner in ((FORWARDS, "session"), (BACKWARDS, "session"), (BACKWARDS, "another")):
            before = rig.position
            await rig.leases.jog(owner, ME, wanted, LEASE_S)
            await rig.wait(0.2)
            assert rig.position != before
            rig.stop()
            await rig.wait(0.2)
        rig.leases.close()

    run_virtually(story())


ENDS: dict[str, tuple[Callable[[JogLeases], object], str]] = {
    "drop": (lambda leases: leases.drop("session"), "its client has let go"),
    "close": (lambda leases: leases.close(), "the connection of its client has ended"),
    "stop": (lambda leases: leases.stopped(StopAxes("table")), "it was stopped"),
    "replaced": (lambda leases: leases.replaced("table", 1), "another command has taken the axis"),
    "time": (lambda leases: None, "its time was over before it began"),
}


@pytest.mark.parametrize("name", ENDS)
def test_what_ends_a_jog_ends_one_that_is_still_beginning(name: str) -> None:
    async def story() -> None:
        rig = BridgeRig()
        await rig.open()
        await rig.subject.do(Enable("table", 1))
        leases = JogLeases(rig.subject)
        end, why = ENDS[name]
        rig.line.fall_silent()
        call = asyncio.create_task(leases.jog("session", ME, FORWARDS, LEASE_S))
        await rig.wait(0.1)
        for owner in ("session", "another"):
            with pytest.raises(Refusal, match=r"a jog is being begun|is jogged by another client"):
                await leases.jog(owner, ME, FORWARDS, LEASE_S)
        end(leases)
        await rig.wait(LEASE_S if name == "time" else 0.0)
        rig.line.answer_again()
        with pytest.raises(Refusal, match=why):
            await call
        await rig.wait(1.0)
        assert not rig.is_moving
        await leases.jog("another", ME, BACKWARDS, LEASE_S)
        await rig.wait(0.2)
        assert rig.is_moving
        leases.close()
        await rig.close()

    run_virtually(story())
