"""What is held of twins by their events is what a fresh read of their whole states gives, whatever happens in a world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_worlds import END_S, SCENES, Chance, described, do_from_outside
from tests.subject.test_world import DEEDS

from steptwin import World
from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.gateways.heldstate import HeldState, parts_only
from steptwin.gateways.sampling import KINDS
from steptwin.motion import at_rest
from steptwin.simulation.script.steps import PowerCycle, Send, Write
from steptwin.simulation.world.inputs import Bytes
from steptwin.subject.commands import Advance, Enable, Move, ReadState
from steptwin.subject.events import Event
from steptwin.subject.payloads import (
    CoordinatePayload,
    EdgePayload,
    InputPayload,
    NotePayload,
    Payload,
    PlanPayload,
    RestoredPayload,
    StatusPayload,
    WritePayload,
)
from steptwin.subject.subscriptions import Filter
from steptwin.subject.world import WorldSubject

FEEDER = Path(__file__).parents[2] / "examples/worlds/feeder.toml"
UNTOLD = {"details": ("listens", "input_waiting")}
"""What a chip receives is told at the end of a line of characters."""


MIC488 = World.from_toml('[[mic488]]\nname = "table"\n')
PLAN = PlanPayload("2", at_rest(0, 7))
AXES = ("M1", "M2", "M3", "M4")
FOLLOWS = """
[[mic488]]
name = "table"

[[axis]]
name = "belt"
drive = "table.M1"
pulses_per_unit = 10

[[axis]]
name = "wheel"
drive = "table.M2"
pulses_per_unit = 10
[axis.encoder]
follows = "belt"
"""
FALLS = """
[[mic488]]
name = "hoist"
[mic488.M1]
enc_resol = 4000

[[axis]]
name = "z"
drive = "hoist.M1"
pitch = 5.0
[axis.encoder]
counts_per_rev = 4000
[axis.motor]
torque = [[0, 3.0], [1500, 0.2]]
inertia = 0.00003
mass = 25.0
force = 245.0
friction = 0.05
when_off = "free"
"""
OVERRUNS = """
[[mic488]]
name = "table"
[mic488.M1]
enc_resol = 4000
vel = 20000.0
acc = 20000.0
dec = 2000.0

[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0
[axis.encoder]
counts_per_rev = 4000
[axis.motor]
torque = [[0, 1.0], [1500, 0.8]]
inertia = 0.005
friction = 0.05
overruns = true
"""
CURRENTS = """
[[line]]
name = "chips"
kind = "m1486"
timing = "off"

[[m1486]]
name = "chip"
line = "chips"
interface = "{interface}"
"""


@pytest.mark.parametrize(
    ("payload", "wanted"),
    [
        (EdgePayload("AIN1", 3.5), set()),
        (EdgePayload("M3_EN", 1.0), {"M3"}),
        (EdgePayload("cup.held", 1.0), set()),
        (PLAN, {*AXES, "status"}),
        (CoordinatePayload("4", 100), {*AXES, "status"}),
        (StatusPayload("homed", "homed", (("axis", 1),)), {*AXES, "status", "program", "details"}),
        (StatusPayload("power-on", "power-on"), {*AXES, "status", "program", "details"}),
        (InputPayload("request", b"1"), {*AXES, "status", "program", "details"}),
        (NotePayload("nothing"), set()),
    ],
)
def test_an_event_names_what_is_read_again(payload: Payload, wanted: set[str]) -> None:
    """An edge brings its level; a new plan may end an error of the controller, and may turn encoders of other axes."""
    holder = Holder(MIC488)
    held = holder.held["table"]
    held.take(Event(1, 0, "table", payload))
    assert set(held.wanted(is_due=False)) == wanted


@pytest.mark.parametrize(
    ("payload", "wanted"),
    [
        (EdgePayload("B3", 1.0), set()),
        (EdgePayload("N", 7.0), {"pins"}),
        (EdgePayload("LIMIT", 0.0), {"status", "program"}),
        (PlanPayload("1", at_rest(0, 7)), {"M1", "status", "program", "pins", "details"}),
        (StatusPayload("wait", "waits 5 ms"), {"M1", "status", "program", "pins", "details"}),
    ],
)
def test_levels_of_a_driver_interface_have_no_edges(payload: Payload, wanted: set[str]) -> None:
    """They are read again with a plan, another waveform, and what the chip tells of itself."""
    held = Holder(World.from_toml(CURRENTS.format(interface="dual"))).held["chip"]
    held.take(Event(1, 0, "chip", payload))
    assert set(held.wanted(is_due=False)) == wanted


def test_what_was_sent_may_have_effects_for_a_second_after_the_last_one() -> None:
    held = Holder(World.from_toml(CURRENTS.format(interface="dual"))).held["chip"]
    assert held.state is not None
    held.take(Event(1, 0, "chip", WritePayload("tcp-1", "host", "t1", "")))
    held.put({"status": {**held.state["status"], "new": 1}}, SECOND // 2)
    held.put({}, SECOND)
    assert held.is_active
    held.put({}, SECOND + SECOND // 2)
    assert not held.is_active


class Holder:
    """Holds the states of the twins of a world, and compares them with what is read."""

    def __init__(self, world: World) -> None:
        self.subject = WorldSubject(world)
        self.subscription = self.subject.subscribe(Filter(KINDS), 1 << 20)
        self.held = {part.name: HeldState(part) for part in self.subject.description.controllers}
        self.parts = self.subject.description.controllers
        for name, held in self.held.items():
            held.put_all(*self._whole(name))

    def _whole(self, name: str) -> tuple[Any, int]:
        found = self.subject.do(ReadState(name))
        return parts_only(found.value, {}), found.time

    def check_moving(self, name: str, axis: int) -> None:
        """While the encoder of an axis (from 0) turns."""
        seen = set()
        for _ in range(20):
            self.subject.do(Advance(duration=20 * MILLISECOND))
            self.check()
            state = self.held[name].state
            assert state is not None
            seen.add(state["axes"][axis]["encoder"])
        assert len(seen) > 5

    def check(self) -> None:
        for name in self.held:
            self.subject.world.sync(name)  # as the timer of a running world does
        for event in self.subscription.take().events:
            for part in self.parts:
                if isinstance(event.payload, RestoredPayload):
                    self.held[part.name].put_all(*self._whole(part.name))
                elif event.controller in (part.name, part.line):
                    self.held[part.name].take(event)
        for name, held in self.held.items():
            before = held.state
            wanted = held.wanted(is_due=True)
            found = self.subject.do(ReadState(name, wanted)) if wanted else None
            state = held.put({} if found is None else found.value, None if found is None else found.time)
            fresh = _told(self._whole(name)[0])
            assert _told(state) == fresh, (name, wanted, _difference(_told(state), fresh))
            assert before is not None
            assert state is before or state != before


def _told(state: Any) -> dict[str, Any]:
    """Without what no event tells."""
    details = {name: value for name, value in state["details"].items() if name not in UNTOLD["details"]}
    return {**state, "details": details}


def _difference(held: dict[str, Any], fresh: dict[str, Any]) -> object:
    return {name: (held[name], fresh[name]) for name in held if held[name] != fresh[name]}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", SCENES)
def test_the_state_that_is_held_is_the_one_that_is_read(name: str, seed: int) -> None:
    chance, scene = Chance(name, seed), SCENES[name]
    text, steps = described(chance, scene)
    files = {file: chance.filled(content).encode() for file, content in scene.files.items()}
    world = World.from_toml(text, files)
    holder = Holder(world)
    while world.now < END_S * SECOND:
        holder.subject.do(Advance(duration=(1 + chance.below(40)) * MILLISECOND))
        holder.check()
        if steps and chance.below(5) == 0:
            do_from_outside(world, steps.pop(), files)
            holder.check()


def test_an_encoder_that_another_axis_turns_goes_with_it() -> None:
    """The axis of the encoder is switched off."""
    world = World.from_toml(FOLLOWS)
    holder = Holder(world)
    holder.subject.do(Enable("table", 1))
    holder.subject.do(Move("table", 1, by=400.0))
    holder.check_moving("table", axis=1)


def test_an_encoder_that_an_axis_of_another_controller_turns_goes_with_it() -> None:
    world = World.from_toml(FOLLOWS.replace('"table.M2"', '"other.M1"') + '[[mic488]]\nname = "other"\n')
    holder = Holder(world)
    assert [part.is_moved for part in holder.parts] == [False, True]
    holder.subject.do(Enable("table", 1))
    holder.subject.do(Move("table", 1, by=400.0))
    holder.check_moving("other", axis=0)


def test_an_encoder_on_a_load_without_current_goes_with_it_also_for_who_comes_later() -> None:
    """The event of its fall came before."""
    world = World.from_toml(FALLS)
    world.run(0.3)
    holder = Holder(world)
    assert [part.is_moved for part in holder.parts] == [True]
    holder.check_moving("hoist", axis=0)


def test_an_encoder_on_a_load_that_overruns_goes_with_it() -> None:
    """Its controller has stopped without a ramp, and tells nothing more."""
    holder = Holder(World.from_toml(OVERRUNS))
    assert [part.is_moved for part in holder.parts] == [True]
    holder.subject.do(Enable("table", 1))
    holder.subject.do(Move("table", 1, by=100000.0))
    holder.subject.do(Advance(duration=2100 * MILLISECOND))
    holder.subject.do(Write((("table", "M1_STOP", 1.0),)))
    holder.check_moving("table", axis=0)


@pytest.mark.parametrize("interface", ["dual", "two"])
def test_levels_of_a_driver_interface_change_at_rest(interface: str) -> None:
    """With another waveform, with the default one after a power cycle."""
    world = World.from_toml(CURRENTS.format(interface=interface))
    holder = Holder(world)
    seen = []
    for what in (b"S\r>3\r", b"N2\r", b"N3\r", b"N7\r"):
        world.apply_input(Send("chips", what))
        holder.subject.do(Advance(duration=500 * MILLISECOND))
        holder.check()
        seen.append(_pins(holder))
    world.apply_input(PowerCycle("chip"))
    holder.check()
    seen.append(_pins(holder))
    assert len(set(seen)) > 2


def _pins(holder: Holder) -> tuple[tuple[str, float], ...]:
    state = holder.held["chip"].state
    assert state is not None
    return tuple(state["pins"].items())


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(deeds=st.lists(st.tuples(DEEDS, st.integers(0, 60)), max_size=16))
def test_the_state_that_is_held_of_a_cell_is_the_one_that_is_read(deeds: list[tuple[Any, int]]) -> None:
    world = World.load(FEEDER)
    holder = Holder(world)
    for deed, pause_ms in deeds:
        try:
            if isinstance(deed, tuple) and len(deed) == 2 and deed[0] in ("bus", "chips"):
                world.apply_input(Bytes(deed[0], "tcp-1", world.lines[deed[0]].kinds[0], deed[1]))
            else:
                holder.subject.do(deed)
        except (Misuse, Refusal):
            continue
        holder.check()
        holder.subject.do(Advance(duration=pause_ms * MILLISECOND))
        holder.check()
