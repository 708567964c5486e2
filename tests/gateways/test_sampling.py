"""When samples of controllers are taken."""

from __future__ import annotations

import asyncio

import pytest
from gateway_rig import GatewayWorld

from steptwin.errors import LineFailure, Refusal, SteptwinError
from steptwin.gateways.points import CLOCK, CLOCK_POINTS
from steptwin.gateways.sampling import MOST_EVENTS, RESTING_SAMPLES, Sampler
from steptwin.machine import SECOND
from steptwin.subject import commands as command
from steptwin.world.script import Note, Set

TEXT = '[[mic488]]\nname = "table"\n[[mic488]]\nname = "other"\n'
MACHINES = ("table", "other")


@pytest.fixture
def world() -> GatewayWorld:
    return GatewayWorld(TEXT)


def changed(sampler: Sampler) -> list[str]:
    return [sample.machine for sample in asyncio.run(sampler.changed(MACHINES))]


def settle(sampler: Sampler) -> None:
    """Until what happens at the beginning has been seen."""
    while changed(sampler):
        pass


def test_controllers_at_rest_are_looked_at_now_and_then(world: GatewayWorld) -> None:
    sampler = Sampler(world, {})
    assert changed(sampler) == ["table", "other"]
    settle(sampler)
    assert [changed(sampler) for _ in range(RESTING_SAMPLES - 1)] == [[]] * (RESTING_SAMPLES - 1)
    assert changed(sampler) == ["table", "other"]


def test_an_event_is_a_reason(world: GatewayWorld) -> None:
    sampler = Sampler(world, {})
    settle(sampler)
    world.inner.do(Set((("table", "IN3", 1.0),)))
    assert changed(sampler) == ["table"]
    assert changed(sampler) == []


def test_a_controller_in_motion_is_always_looked_at(world: GatewayWorld) -> None:
    sampler = Sampler(world, {})
    settle(sampler)
    world.inner.do(command.Enable("other", 1))
    world.inner.do(command.Move("other", 1, by=1000.0))
    assert [changed(sampler) for _ in range(3)] == [["other"]] * 3
    world.inner.do(command.Advance(duration=600 * SECOND))
    assert changed(sampler) == ["other"]
    assert changed(sampler) == []


def test_named_registers_are_a_reason_too(world: GatewayWorld) -> None:
    sampler = Sampler(world, {"other": ["M1_VMAX"]})
    assert changed(sampler) == ["table", "other"]
    assert [changed(sampler)[-1:] for _ in range(3)] == [["other"]] * 3


def test_after_lost_events_everything_is_looked_at(world: GatewayWorld) -> None:
    sampler = Sampler(world, {})
    settle(sampler)
    for number in range(MOST_EVENTS + 1):
        world.inner.do(Note(str(number)))
    assert changed(sampler) == ["table", "other"]


@pytest.mark.parametrize("silence", [LineFailure("no answer"), Refusal("illegal data address")])
def test_a_silent_controller_has_no_state(world: GatewayWorld, silence: SteptwinError) -> None:
    """Or one that refuses what it is asked: who asks goes on."""
    sampler = Sampler(world, {})
    world.silence = silence
    world.silent.add("table")
    assert [asyncio.run(sampler.take(name)).state is None for name in MACHINES] == [True, False]
    world.silent.clear()
    assert asyncio.run(sampler.take("table")).state is not None


def test_the_clock(world: GatewayWorld) -> None:
    world.inner.do(command.Advance(duration=3 * SECOND))
    sample = asyncio.run(Sampler(world, {}).take(CLOCK))
    assert sample.state is not None
    assert [point.read(sample.state) for point in CLOCK_POINTS] == [3.0, True, None]


def test_nothing_is_followed_after_the_end(world: GatewayWorld) -> None:
    sampler = Sampler(world, {})
    sampler.close()
    assert not world.inner.followers
