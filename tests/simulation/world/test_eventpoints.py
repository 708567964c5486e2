"""The points that are read again after an event are those that have changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m1486_programs import permitted_programs

from steptwin.controller import MILLISECOND, Nanos
from steptwin.files.world import World
from steptwin.m1486.syntax import format_program
from steptwin.m1486.variants import variant
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.eventpoints import EventPoints, points_of, stays_between_events

if TYPE_CHECKING:
    from steptwin.simulation.world.inputs import ExternalInput

CHIP = """
[[line]]
name = "chips"
kind = "m1486"
timing = "off"

[[m1486]]
name = "m"
line = "chips"
variant = "{variant}"
statement_time = "1 ms"
"""
MIC488 = '[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\nstatement_time = "1 ms"\n'
STATEMENTS = (
    *("M1 = ON", "M1 = OFF", "M2 = ON", "M3 = ON", "PABS M1 40", "PREL M2 -30", "VABS M1 100", "STOP M1", "BRAKE M2", "WAITPOS"),
    *("HOME M1 20", "LIMRM1 = 20", "LIMLM2 = -5", "LIMRM1 = 0", "DELAY 0.05", "OUT1 = ON", "OUT1 = OFF", "PULSE(OUT2, 0.1)"),
    *("VMAXM1 = 300", "$I4 = 7", "n = n + 1", "WAIT IN1 = ON", "n = 1 / n", "PosM1 = 5", "END"),
)
WRITES = (
    *(("PROGRAM_CTRL", 1.0), ("PROGRAM_CTRL", 0.0), ("PROGRAM_CTRL", 2.0), ("M1_POSLIM_R", 900.0), ("M1_POSLIM_L", -3.0)),
    *(("OUT3", 1.0), ("M1_ACC", 500.0), ("M1_POS_ACT", 40.0), ("M_ENABLE", 12.0), ("M_DISABLE", 4.0), ("M4_VEL_ABS", 30.0)),
    *(("AXIS_VEL_ABS_TRIG", 8.0), ("M_STOP", 8.0), ("M2_POS_ABS", 7.0), ("M4_EN", 1.0), ("M4_JOG_PLUS", 1.0)),
)


class Follows:
    """Compares after each event with all values. As `steptwin.simulation.scheduler.subscribers.SchedulerFollower`."""

    def __init__(self, world: World) -> None:
        points = {path: point for path, point in points_of(world, "m") if point is not None and not point.is_kept}
        self._points = {path: point for path, point in points.items() if stays_between_events(point)}
        self._found = EventPoints(world, "m", self._points)
        self._values = self._all(world.now)
        self.changes = 0
        world.objects.scheduler_of["m"].subscribe(self, ("m",))

    def _all(self, now: Nanos) -> dict[str, float]:
        return {path: point.read(now) for path, point in self._points.items() if point.read is not None}

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        before, self._values = self._values, self._all(now)
        expected = {path: value for path, value in self._values.items() if value != before[path]}
        assert self._found.changed(now) == expected, now
        self.changes += len(expected)


def check_run(world: World, inputs: Sequence[tuple[int, ExternalInput]], end: int) -> int:
    """Run with inputs, each at its moment in ms, until an end, comparing after each event. Returns how many points changed."""
    follows = Follows(world)
    for moment, what in sorted(inputs, key=lambda one: one[0]):
        world.run_to(moment * MILLISECOND)
        world.apply_input(what)
    world.run_to(end * MILLISECOND)
    return follows.changes


@settings(max_examples=40, deadline=None)
@given(data=st.data())
@pytest.mark.parametrize(("name", "end"), [("A", 1_000), ("B2x", 1_000), ("E2", 20_000)])
def test_of_a_chip(name: str, end: int, data: st.DataObject) -> None:
    """An E2 takes half a second for each command that it stores."""
    world = World.from_toml(CHIP.format(variant=name))
    text = format_program(data.draw(permitted_programs(variant(name))), "\r").encode(errors="replace")
    pins = st.tuples(st.sampled_from(["B1", "B5", "LIMIT", "JOG", "RST", "SD"]), st.sampled_from([0.0, 1.0]))
    sets = pins.map(lambda pin: do.Set((("m", *pin),)))
    sends = st.sampled_from([b"k\r", b"c75\r", b"t44\r", b"w300\r>3\r", b"[\r@1\r+1\r>2\rJ1\r]\r"]).map(
        lambda data: do.Send("chips", data)
    )
    inputs = data.draw(st.lists(st.tuples(st.integers(0, end), sets | sends), max_size=6))
    check_run(world, [(0, do.Send("chips", b"t44\r" + text)), *inputs], end)


@settings(max_examples=40, deadline=None)
@given(lines=st.lists(st.sampled_from(STATEMENTS), max_size=20), data=st.data())
def test_of_a_mic488(lines: list[str], data: st.DataObject) -> None:
    program = "\n".join(["n = 0", "MAIN:", *lines, "JUMP MAIN"])
    world = World.from_toml(MIC488, {"m.prg": program.encode()})
    writes = st.sampled_from(WRITES).map(lambda write: do.Write((("m", *write),)))
    pins = st.tuples(st.sampled_from(["IN1", "IN2", "IN9"]), st.sampled_from([0.0, 1.0])).map(lambda pin: do.Set((("m", *pin),)))
    check_run(world, data.draw(st.lists(st.tuples(st.integers(0, 900), writes | pins), max_size=6)), 1000)


def test_what_a_calculating_chip_changes_is_seen() -> None:
    """The comparison above has something to compare."""
    world = World.from_toml(CHIP.format(variant="A"))
    program = b"[\r:7\r@1\r+1\r>2\r/3\rT50\rF6400\rR\rC50\rW9\rJ1\r]\r"
    assert check_run(world, [(0, do.Send("chips", program))], 500) > 20
