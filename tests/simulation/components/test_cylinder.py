"""Cylinders against an integration of their own: the piston moves by speed times step, its ends hold it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from world_rig import check_it_can_be_restored

from steptwin.controller import MILLISECOND
from steptwin.files.world import World
from steptwin.simulation.components.cylinder import CYLINDER
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[[cylinder]]
name = "clamp"
extend = "a.OUT1"
stroke = 50.0
extend_time = "200 ms"
retract_time = "300 ms"
switching = "12 ms"
[[cylinder.switch]]
above = 45.0
hysteresis = 1.0
to = "a.IN3"
[[wire]]
from = "clamp.extended"
to = "a.IN1"
[[wire]]
from = "clamp.retracted"
to = "a.IN2"
"""
DOUBLE = TEXT.replace('extend = "a.OUT1"', 'extend = "a.OUT1"\nretract = "a.OUT2"\nvalve = "double"')


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel]


def test_it_extends_and_retracts_in_its_times() -> None:
    world = World.from_toml(TEXT)
    out = world.mic488["a"]
    world.at(0.1, lambda: out.write("OUT1", 1))
    world.at(0.5, lambda: out.write("OUT1", 0))
    world.run(until=1.0)
    ns = 1e-6
    assert edges(world, "clamp.retracted") == [(0, 1), (112 + ns, 0), (812, 1)]
    assert edges(world, "clamp.extended") == [(0, 0), (312, 1), (512 + ns, 0)]
    # 45 of 50 mm after 180 ms; 44 mm, less than which it is off, after 36 ms of the way back.
    assert edges(world, "clamp.switch1") == [(0, 0), (292, 1), (548 + ns, 0)]
    assert (world.read("a.IN1"), world.read("a.IN2"), world.read("a.IN3")) == (0, 1, 0)


@pytest.mark.parametrize("coil", ["pulse.out", "a.OUT1"])
def test_a_pulse_as_long_as_the_switching_time_moves_the_valve_whatever_gives_it(coil: str) -> None:
    timer = '[[timer]]\nname = "pulse"\nkind = "pulse"\ntime = "12 ms"\ninput = "a.OUT1"\n'
    world = World.from_toml(TEXT.replace('extend = "a.OUT1"', f'extend = "{coil}"') + timer)
    out = world.mic488["a"]
    world.at(0.1, lambda: out.write("OUT1", 1))
    world.at(0.112, lambda: out.write("OUT1", 0))
    world.run(until=0.2)
    # Forth for 12 ms of 200, back over the same way in 12 ms of 200 · 300.
    assert edges(world, "clamp.retracted") == [(0, 1), (112 + 1e-6, 0), (142, 1)]


def test_conditions_see_its_position() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.run(until="clamp.position >= 20")
    assert world.now == 92 * MILLISECOND
    assert world.read("clamp.position") == 20.0
    world.mic488["a"].write("OUT1", 0)
    world.run(until="clamp.retracted")
    # 12 ms on, as far as 23 mm, and back.
    assert world.now == pytest.approx((92 + 12 + 23 / 50 * 300) * MILLISECOND, abs=1)


def test_a_valve_with_two_coils_keeps_its_last_position() -> None:
    world = World.from_toml(DOUBLE)
    device = world.mic488["a"]
    for at, pin, level in (
        (0.0, 1, 1),
        (0.02, 1, 0),
        (0.5, 2, 1),
        (0.505, 2, 0),
        (0.6, 2, 1),
        (0.7, 1, 1),
        (0.9, 2, 0),
        (0.95, 1, 0),
    ):
        world.at(at, lambda pin=pin, level=level: device.write(f"OUT{pin}", level))  # type: ignore[misc]
    world.run(until=2.0)
    # A pulse moves the spool; both coils leave it where it is; at 0.9 s the other coil is the only one.
    assert [time for time, level in edges(world, "clamp.extended") if level] == [212, 1112]


def test_the_coils_of_a_valve_can_be_wired_instead() -> None:
    wires = "".join(f'[[wire]]\nfrom = "a.OUT{n}"\nto = "clamp.{coil}"\n' for n, coil in ((1, "EXTEND"), (2, "RETRACT")))
    wired = DOUBLE.replace('extend = "a.OUT1"\nretract = "a.OUT2"\n', "")
    assert wired != DOUBLE
    found = [World.from_toml(text) for text in (DOUBLE, wired + wires)]
    for world in found:
        for at, pin, level in ((0.0, 1, 1), (0.02, 1, 0), (0.5, 2, 1)):
            world.run(until=at)
            world.mic488["a"].write(f"OUT{pin}", level)
        world.run(until=1.0)
    assert edges(found[0], "clamp.extended") == edges(found[1], "clamp.extended") != []


def test_it_can_begin_extended() -> None:
    world = World.from_toml(DOUBLE.replace("stroke", 'start = "extended"\nstroke'))
    world.run(for_=0.1)
    assert (world.read("clamp.position"), world.read("a.IN1")) == (50.0, 1)


def integrated(commands: list[tuple[int, bool]], end: int) -> list[tuple[int, bool]]:
    """Edges of the upper end in steps of 0.1 ms."""
    place, spool, edges = 0.0, False, []
    due: int | None = None
    wanted, before = False, False
    for step in range(end):
        if due == step:
            spool, due = wanted, None
        for at, level in commands:
            if at == step and level is not wanted:
                wanted = level
                due = None if wanted is spool else step + 120
        is_out = place >= 50.0 - 1e-9
        if is_out is not before:
            edges.append((step, is_out))
            before = is_out
        place = min(50.0, place + 50.0 / 2000) if spool else max(0.0, place - 50.0 / 3000)
    return edges


@given(st.lists(st.tuples(st.integers(0, 8000), st.booleans()), max_size=8, unique_by=lambda one: one[0]))
def test_it_is_where_an_integration_has_it(commands: list[tuple[int, bool]]) -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    for at, level in sorted(commands):
        world.at(at / 10_000, lambda level=level: device.write("OUT1", int(level)))  # type: ignore[misc]
    world.run(until=1.0)
    found = [(time * 10, bool(level)) for time, level in edges(world, "clamp.extended") if time * 10 < 9999][1:]
    expected = [edge for edge in integrated(sorted(commands), 10_000) if edge[0] < 9999]
    assert [level for _, level in found] == [level for _, level in expected]
    assert [time for time, _ in found] == pytest.approx([time for time, _ in expected], abs=1.1)


def test_its_faults() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.run(until=0.1)
    world.fault("jam element=clamp name=jam")
    world.run(until=0.2)
    assert world.read("clamp.position") == pytest.approx(22.0)
    world.clear_fault("jam")
    world.run(until=1.0)
    assert world.read("clamp.extended") == 1
    world.fault("no-air element=clamp")
    world.run(until=2.0)
    assert world.read("clamp.retracted") == 1


@pytest.mark.parametrize("moment_s", [0.0, 0.05, 0.15, 0.35, 0.512, 0.7])
def test_snapshots_and_sessions_have_it(moment_s: float, tmp_path: Path) -> None:
    text = TEXT + (
        '[[fault]]\nkind = "jam"\nelement = "clamp"\nfrom_s = 0.14\nuntil_s = 0.16\n'
        '[[script]]\nname = "s"\nsteps = [{ write = { "a.OUT1" = 1 } }, { until = "clamp.position > 30" }, { wait = "200 ms" },'
        '{ write = { "a.OUT1" = 0 } }, { until = "clamp.retracted" }, { note = "back" }]\n'
    )
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 1.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("stroke = 50.0", "stroke = 0", "permitted are numbers above 0"),
        ("stroke = 50.0", "strok = 50.0", r"\[cylinder\] has no 'strok' \(did you mean 'stroke'\?\)"),
        ("stroke = 50.0", 'start = "extended"', "a valve with a single coil keeps its cylinder retracted"),
        ("stroke = 50.0", 'retract = "a.OUT2"', "a valve with a single coil has no input RETRACT"),
        ('to = "a.IN3"', 'to = "a.IN1"', "a.IN1 is driven already"),
        ("above = 45.0", "above = 45.0\nbelow = 1.0", "a switch needs one of below, above and position"),
        ('to = "a.IN3"', 'to = "c.IN3"', "nothing is called 'c'"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(TEXT.replace(old, new, 1))


@pytest.mark.parametrize("stroke", [3.0, 7.0, 50.0])
def test_places_are_the_nearest(stroke: float) -> None:
    world = World.from_toml(TEXT.replace("stroke = 50.0", f"stroke = {stroke}").replace("above = 45.0", "above = 2.5"))
    cylinder = world.objects.built(CYLINDER)["clamp"]
    for n in range(1, 40):
        units = stroke * n / 41
        assert abs(cylinder.to_grid(units) - Fraction(str(units)) / Fraction(str(stroke)) * cylinder.travel.full) <= Fraction(
            1, 2
        )
    assert cylinder.to_grid(stroke) == cylinder.travel.full == 200 * 300 * MILLISECOND**2
