"""What inputs of a world get: over wires, from contacts alone and together, once or every turn, through faults; and its trace."""

from __future__ import annotations

import csv
from itertools import pairwise
from math import floor
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.files.export import write_trace
from steptwin.files.world import World
from steptwin.motion import Profile


def world_of(text: str, **values: object) -> World:
    text = dedent(text)
    for name, value in values.items():
        text = text.replace(f"<{name}>", str(value))
    return World.from_toml(text)


def edges(world: World, channel: str, controller: str = "m") -> list[tuple[int, float]]:
    return [(record.time, float(str(record.value))) for record in world.trace.edges(controller) if record.subject == channel]


# ---------------------------------------------------------------------- levels at the beginning

WIRED = """
    [[mic488]]
    name = "m"
    [[mic488]]
    name = "n"
    [[wire]]
    from = "m.OUT1"
    to = "n.IN6"
    inverted = <inverted>
    delay = "300 ms"
    [[script]]
    name = "s"
    at = "1 s"
    steps = [{ write = { "m.OUT1" = 1 } }]
"""


@pytest.mark.parametrize("inverted", [False, True])
def test_a_delayed_wire_has_carried_the_first_level_long_ago(inverted: bool, tmp_path: Path) -> None:
    world = world_of(WIRED, inverted=str(inverted).lower())
    world.run(for_=2)
    first = float(inverted)
    assert edges(world, "IN6", "n") == [(0, first), (1_300_000_000, 1.0 - first)]
    write_trace(world.trace, tmp_path / "t.csv", period=100 * MILLISECOND)
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    column = next(name for name in rows[0] if "IN6" in name)
    assert [float(row[column]) for row in rows[:13]] == [first] * 13, "a level that never was"


def test_an_input_that_is_set_to_what_it_has_gives_no_edge() -> None:
    world = world_of(WIRED, inverted="false")
    world.mic488["n"].set_pin("IN3", 0)
    world.run(for_=1)
    world.mic488["n"].set_pin("IN3", 0)
    world.mic488["n"].set_pin("IN3", 1)
    world.mic488["n"].set_pin("IN3", 1)
    assert edges(world, "IN3", "n") == [(SECOND, 1.0)]


# ---------------------------------------------------------------------- an input that a fault holds

HELD = """
    [[mic488]]
    name = "m"
    [[axis]]
    name = "x"
    drive = "m.M1"
    pulses_per_unit = 100
    [[axis.switch]]
    above = 2.0
    to = "m.IN1"
    [[fault]]
    kind = "stuck"
    machine = "m"
    pin = "IN1"
    value = 0
    until_s = <until>
    [[script]]
    name = "s"
    steps = [{ write = { "m.M1_EN" = 1, "m.M1_POS_ABS" = 500 } }]
"""


def test_the_trace_has_what_a_stuck_input_has_and_what_its_switch_gives() -> None:
    world = world_of(HELD, until=60)
    world.run(for_=5)
    (_, closed) = edges(world, "x.switch1")
    assert (world.axis["x"].position, closed[1]) == (5.0, 1.0)
    assert world.mic488["m"].pins["IN1"] == 0.0
    assert edges(world, "IN1") == [(0, 0.0)]
    world.run(until=61)
    assert edges(world, "IN1") == [(0, 0.0), (60 * SECOND, 1.0)]


# ---------------------------------------------------------------------- marks that come again

TURNTABLE = """
    [[mic488]]
    name = "m"
    [mic488.M1]
    unit = "degree"
    gear = <gear>
    acc = 2000.0
    dec = 2000.0
    vel = 720.0
    in_kl = "IN1"
    home_mode = "HOME1"
    [[axis]]
    name = "x"
    drive = "m.M1"
    kind = "rotary"
    unit = "<unit>"
    pulses_per_unit = <scale>
    start = <start>
    [[axis.switch]]
    position = 0.0
    width = 4.0
    <period>
    to = "m.IN1"
"""


def turntable(start: float, period: str = "", *, gear: float = 40.0, unit: str = "degree") -> World:
    world = world_of(TURNTABLE, gear=gear, scale=gear, start=start, period=period, unit=unit)
    world.mic488["m"].axis[1].enable()
    return world


def test_a_cam_on_a_rotary_axis_is_seen_in_every_turn() -> None:
    world = turntable(722.0)
    assert world.mic488["m"].pins["IN1"] == 1.0
    world.mic488["m"].axis[1].move_by(360.0 * 3)
    world.run(until="idle")
    places = [2.0, 358.0] * 3
    assert len(edges(world, "IN1")) == 1 + len(places)
    assert world.mic488["m"].pins["IN1"] == 1.0


def test_homing_goes_to_the_next_cam_not_to_that_of_the_first_turn() -> None:
    world = turntable(800.0)
    axis = world.mic488["m"].axis[1]
    axis.home(-100.0)
    world.run(until="m.M1.status == 4", for_=30)
    assert world.axis["x"].position == pytest.approx(722.0, abs=0.2)


@pytest.mark.parametrize(
    ("period", "unit", "seen"),
    [("", "degree", True), ("period = 1000.0", "degree", False), ("period = 90.0", "degree", True), ("", "tooth", False)],
)
def test_what_comes_again_is_a_turn_or_what_is_said(period: str, unit: str, seen: bool) -> None:
    """A unit that is neither degree nor rev does not say what a turn is."""
    assert turntable(360.0, period, unit=unit).mic488["m"].pins["IN1"] == float(seen)


@settings(max_examples=25, deadline=None)
@given(
    gear=st.sampled_from([40.0, 17.7, 3.333]),
    start=st.integers(-2000, 2000),
    distance=st.integers(-1500, 1500).filter(bool),
    cut=st.integers(0, 3 * SECOND),
)
def test_marks_are_crossed_at_the_nanosecond_of_their_pulse_whatever_is_looked_at(
    gear: float, start: int, distance: int, cut: int
) -> None:
    """Turns of a whole number of pulses or not: against the pulses of the move, and from a snapshot in the middle."""
    assume(abs(distance / 10) * gear >= 1)  # less than a pulse is no move
    world = turntable(start / 10, "period = 30.0", gear=gear)
    world.mic488["m"].axis[1].move_by(distance / 10)
    branch = None
    if cut:
        world.run(until=cut / SECOND)
        branch = world.branch()
        branch.run(for_=10)
    world.run(for_=10)
    plans = [record.value for record in world.trace.plans("m") if record.subject == "1"]
    profile = next(plan for plan in reversed(plans) if isinstance(plan, Profile) and plan.segments)
    zero, scale = world.axes["x"].mechanism.build.zero, world.axes["x"].scale
    low, high, turn = scale.nearest(-2.0), scale.nearest(2.0), scale.pulses(30.0)

    def on(place: int) -> bool:
        near = round(place / turn)
        return any(low <= place - floor(k * turn + 1 / 2) <= high for k in range(near - 2, near + 3))

    step = 1 if distance > 0 else -1
    places = range(zero, zero + profile.count(10 * SECOND) + step, step)
    wanted = [
        (profile.pulse_time(after - zero, 0), float(on(after)))
        for before, after in pairwise(places)
        if on(before) is not on(after)
    ]
    assert edges(world, "IN1")[1:] == wanted
    if branch is not None:
        branch.run(until=world.time)
        assert branch.trace.digest() == world.trace.digest()


def test_a_mark_that_never_goes_off_is_refused() -> None:
    with pytest.raises(Misuse, match="a zone of 161 imp, hysteresis included, repeats every 120 imp: it must be shorter"):
        turntable(0.0, "period = 3.0")
    with pytest.raises(Misuse, match="period means nothing without position"):
        world_of(
            TURNTABLE.replace("position = 0.0\n    width = 4.0", "below = 0.0"),
            gear=40,
            scale=40,
            start=0,
            unit="degree",
            period="period = 3.0",
        )


# ---------------------------------------------------------------------- several contacts on one input

SHARED = """
    [[mic488]]
    name = "m"
    [[axis]]
    name = "x"
    drive = "m.M1"
    pulses_per_unit = 100
    start = 5.0
    [[axis.switch]]
    below = 0.0
    to = "m.IN1"
    contact = "<contact>"
    <first>
    [[axis.switch]]
    above = 10.0
    to = "m.IN1"
    contact = "<contact>"
    <second>
    [[button]]
    name = "hand"
    to = "m.<pin>"
    contact = "<contact>"
    <third>
    [[script]]
    name = "s"
    steps = [
      { write = { "m.M1_EN" = 1, "m.M1_POS_ABS" = 600 } },
      { wait = "3 s" },
      { write = { "m.M1_POS_ABS" = -600 } },
      { wait = "3 s" },
      { write = { "m.M1_POS_ABS" = 0 } },
      { wait = "3 s" },
      { press = "hand", for = "1 s" },
    ]
"""


def shared(contact: str, joins: tuple[str, str, str], pin: str = "IN1") -> World:
    first, second, third = (f'join = "{join}"' if join else "" for join in joins)
    return world_of(SHARED, contact=contact, pin=pin, first=first, second=second, third=third)


@pytest.mark.parametrize(
    ("contact", "join", "rest"),
    [("NO", "parallel", 0.0), ("NC", "series", 1.0)],
)
def test_end_switches_and_a_button_share_an_input(contact: str, join: str, rest: float) -> None:
    """NO contacts in parallel, NC contacts in series: the input changes with each of them."""
    world = shared(contact, (join,) * 3)
    world.run(for_=15)
    levels = [level for _, level in edges(world, "IN1")]
    assert levels == [rest] + [1.0 - rest, rest] * 3
    moments = sorted(time for channel in ("x.switch1", "x.switch2", "hand") for time, _ in edges(world, channel) if time > 0)
    assert [time for time, _ in edges(world, "IN1")][1:] == moments


def test_what_never_closes_together_is_never_on() -> None:
    world = shared("NO", ("series",) * 3)
    world.run(for_=15)
    assert edges(world, "IN1") == [(0, 0.0)]
    assert len(edges(world, "hand")) == 3


@pytest.mark.parametrize("joins", [("", "", ""), ("parallel", "", ""), ("parallel", "series", ""), ("", "parallel", "")])
def test_contacts_that_share_an_input_say_how(joins: tuple[str, str, str]) -> None:
    with pytest.raises(
        Misuse, match=r"m\.IN1 is driven already, from line 11: contacts that share an input all have join = 'parallel'"
    ):
        shared("NO", joins, pin="IN7")


@pytest.mark.parametrize("moment", [0.0, 0.5, 2.999, 3.7, 9.5])
def test_a_branch_with_shared_inputs_does_the_same(moment: float) -> None:
    whole, cut = shared("NC", ("series",) * 3), shared("NC", ("series",) * 3)
    whole.run(for_=15)
    cut.run(for_=moment)
    branch = cut.branch()
    branch.run(until=15)
    assert branch.trace.digest() == whole.trace.digest()


@pytest.mark.parametrize(("own", "other", "at_once"), [("off", "real", True), ("real", "off", False)])
def test_characters_of_a_chip_take_the_time_of_its_own_line(own: str, other: str, at_once: bool) -> None:
    world = world_of(
        f"""
        [[line]]
        name = "one"
        kind = "m1486"
        timing = "{own}"
        [[line]]
        name = "two"
        kind = "m1486"
        timing = "{other}"
        [[m1486]]
        name = "a"
        line = "one"
        [[m1486]]
        name = "b"
        line = "two"
        """
    )
    world.line["one"].send(b"u20\r")
    early = world.line["one"].received()
    assert (early == b"B") is at_once
    world.run(for_=1)
    assert early + world.line["one"].received() == b"B"


def test_another_seed_is_of_the_same_description() -> None:
    world = World.from_toml('[world]\nseed = 3\n[[mic488]]\nname = "a"\n')
    other = world.blueprint.with_seed(5)
    assert (world.blueprint.spec.seed, other.spec.seed) == (3, 5)
    assert other.makers is world.blueprint.makers
