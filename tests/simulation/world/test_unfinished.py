"""What stands still at the end of a run."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from steptwin.files.world import World
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.unfinished import changes_of_pins, unchanged_inputs, unfinished, without_program

TEXT = """
[[mic488]]
name = "a"
program = "a.prg"
start = true
[[m1486]]
name = "c"
program = "c.m1486"
[[button]]
name = "start"
to = "a.IN5"
[[button]]
name = "stop"
to = "a.IN6"
[[wire]]
from = "a.OUT1"
to = "c.B3"
[[event]]
when = "a.OUT2"
steps = [{ note = "never" }]
[[script]]
name = "late"
steps = [{ wait = "100 s" }]
[[script]]
name = "operator"
steps = [{ press = "stop", for = "100 ms" }, { until = "a.OUT2" }]
"""
FILES = {"a.prg": b"DELAY 0.5\nWAIT IN5 = ON\nOUT1 = ON\nWAIT OUT2 = ON\nDELAY 9\n", "c.m1486": b"[\rw100\ro3\rt1\r]\r"}


def test_waits_of_programs_and_scripts() -> None:
    world = World.from_toml(TEXT, FILES)
    world.run(for_=0.2)
    assert [one.who for one in unfinished(world)] == ["c", "operator"], "a delay is no wait"
    world.run(for_=1)
    assert list(map(str, unfinished(world))) == [
        "a waits for a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by start",
        "c waits for c.m1486:3 o3: c.B3 is 0, driven by a.OUT1",
        "operator waits for a.OUT2",
    ]
    world.press("start", "100 ms")
    world.run(for_=1)
    assert next(iter(unfinished(world))) == ("a", "waits", "a.prg:4 WAIT OUT2 = ON: a.OUT2 is 0")


def test_a_fault_that_holds_an_input_or_what_drives_it() -> None:
    world = World.from_toml(
        """
        [[mic488]]
        name = "a"
        program = "a.prg"
        start = true
        [[gate]]
        name = "both"
        kind = "and"
        inputs = ["a.OUT1", "a.OUT2"]
        [[wire]]
        from = "both.out"
        to = "a.IN5"
        """,
        FILES,
    )
    world.fault("stuck-output element=both output=out level=0 name=weld")
    world.run(for_=1)
    (one,) = unfinished(world)
    assert one.what == "a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by both.out (held at 0 by fault weld)"
    world.fault("stuck pin=IN5 value=0")
    world.run(for_=1)
    assert [one.what for one in unfinished(world)] == ["a.prg:2 WAIT IN5 = ON: a.IN5 is held at 0 by fault stuck"]
    world.clear_fault("stuck")
    world.clear_fault("weld")
    world.run(for_=1)
    assert [one.what for one in unfinished(world)] == ["a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by both.out"]


def test_inputs_that_never_changed() -> None:
    world = World.from_toml(TEXT, FILES)
    before = changes_of_pins(world)
    world.run(for_=1)
    assert unchanged_inputs(world, before) == ["c.B3", "a.IN5"]
    world.press("start", "100 ms")
    world.run(for_=1)
    assert unchanged_inputs(world, before) == []
    assert "a.IN6" in unchanged_inputs(world, changes_of_pins(world))


def test_an_input_that_changed_at_the_beginning_has_changed() -> None:
    """A level at power-on is no change; what a script does at 0 s is."""
    world = World.from_toml(TEXT.replace('{ press = "stop", for = "100 ms" }', '{ press = "start" }'), FILES)
    before = changes_of_pins(world)
    world.run(for_=0.1)
    assert unchanged_inputs(world, before) == ["c.B3", "a.IN6"]


def test_an_input_that_a_program_reads_and_whose_changes_its_filter_takes_away_has_not_changed_for_it() -> None:
    world = World.from_toml(TEXT, FILES)
    before = changes_of_pins(world)
    world.run(for_=0.1)
    world.press("start", "5 ms")
    world.run(for_=1)
    assert "a.IN5 (for less than its filter of 10 ms)" in unchanged_inputs(world, before)
    world.press("start", "15 ms")
    world.run(for_=1)
    assert unchanged_inputs(world, before) == []


def test_a_variable_is_no_pin_whatever_it_is_called() -> None:
    """`program` is a point of the controller, too, which has nothing to do with the variable of the program."""
    text = '[[mic488]]\nname = "a"\nprogram = "p"\nstart = true\n'
    world = World.from_toml(text, {"p": b"program = 0\nWAIT program = 1\n"})
    world.run(for_=1)
    assert [tuple(one) for one in unfinished(world)] == [("a", "waits", "p:2 WAIT program = 1: program is 0")]


def wbc(text: str, *, start: bool = True) -> World:
    begin = "start = true\n" if start else ""
    drive = '[mic488.M1]\nunit = "mm"\ngear = 100.0\nvel = 50.0\nacc = 500.0\ndec = 500.0\n'
    described = f'[[mic488]]\nname = "a"\nprogram = "a.prg"\n{begin}{drive}[[button]]\nname = "go"\nto = "a.IN1"\n'
    return World.from_toml(described, {"a.prg": text.encode()})


def chip(text: str) -> World:
    described = '[[line]]\nname = "rs"\nkind = "m1486"\n[[m1486]]\nname = "a"\nline = "rs"\nprogram = "a.m1486"\n'
    pins = "".join(
        f'[[button]]\nname = "{name}"\nto = "a.{pin}"\n' for name, pin in (("go", "B3"), ("sd", "SD"), ("lim", "LIMIT"))
    )
    contacts = pins.replace('to = "a.SD"', 'to = "a.SD"\ncontact = "NC"').replace(
        'to = "a.LIMIT"', 'to = "a.LIMIT"\ncontact = "NC"'
    )
    return World.from_toml(described + contacts, {"a.m1486": f"[\n{text}]\n".encode()})


def nothing(world: World) -> None:
    """Nothing comes from outside."""


MOTION = "M1 = ON\nPREL M1 100\nWAITPOS\n"
STATES: list[tuple[Callable[[], World], Callable[[World], object], list[str], str, int | None]] = [
    (lambda: wbc("A:\nOUT1 = ON\nOUT1 = OFF\nJUMP A\n"), nothing, ["a goes on at a.prg:4 JUMP A"], "running", 0),
    (
        lambda: wbc("WHILE IN1 = 0\nENDWHILE\n"),
        nothing,
        ["a goes on at a.prg:1 WHILE IN1 = 0: a.IN1 is 0, driven by go"],
        "running",
        0,
    ),
    (lambda: wbc("DELAY 9\n"), nothing, [], "running", 1),
    (lambda: wbc("WAIT IN1 = ON\n"), nothing, ["a waits for a.prg:1 WAIT IN1 = ON: a.IN1 is 0, driven by go"], "running", 1),
    (lambda: wbc("n = 3\nWAIT n = $I2\n"), nothing, ["a waits for a.prg:2 WAIT n = $I2: n is 3; $I2 is 0"], "running", 2),
    (
        lambda: wbc("WAIT ENC1 > 2000\n"),
        nothing,
        ["a waits for a.prg:1 WAIT ENC1 > 2000: the encoder of a.M1 is at 0"],
        "running",
        1,
    ),
    (lambda: wbc(MOTION), nothing, ["a waits for a.prg:3 WAITPOS: a.M1 moves at 97.4 mm"], "running", 3),
    (
        lambda: wbc("M1 = ON\nWAIT STATM1 = 4\n"),
        nothing,
        ["a waits for a.prg:2 WAIT STATM1 = 4: a.M1 stands at 0 mm, on at rest"],
        "running",
        2,
    ),
    (lambda: wbc(MOTION), lambda w: w.apply_input(Halt("a", program="pause")), ["a is paused at a.prg:3 WAITPOS"], "paused", 3),
    (lambda: wbc(MOTION), lambda w: w.apply_input(Halt("a", program="stop")), ["a runs no program"], "stopped", None),
    (lambda: wbc("OUT1 = ON\n"), nothing, ["a runs no program"], "stopped", None),
    (lambda: wbc("OUT1 = ON\n", start=False), nothing, ["a runs no program"], "stopped", None),
    (
        lambda: wbc("x = 0\ny = 1 / x\n"),
        nothing,
        ["a was stopped by an error: a.prg:2 y = 1 / x: division by zero"],
        "stopped",
        None,
    ),
    (lambda: chip("@1\nV100\nV200\nJ1\n"), nothing, ["a goes on at a.m1486:3 V100"], "running", 0),
    (lambda: chip("W9000\nV100\n"), nothing, [], "waiting", 2),
    (lambda: chip("O3\nV100\n"), nothing, ["a waits for a.m1486:2 O3: a.B3 is 0, driven by go"], "waiting", 2),
    (
        lambda: chip("@1\nF6400000\nR\nT1\n"),
        nothing,
        ["a waits for a.m1486:4 R: a.M1 moves at 123840 min. microsteps"],
        "waiting",
        4,
    ),
    (lambda: chip("C51\nF64000\nR\nT1\n"), lambda w: w.press("lim"), ["a is stopped by LIMIT at a.m1486:5 T1"], "paused", 5),
    (
        lambda: chip("C51\nF6400000\nR\nT1\n"),
        lambda w: w.line["rs"].send(b"K\r"),
        ["a is stopped by Kill at a.m1486:5 T1"],
        "paused",
        5,
    ),
    (lambda: chip("O3\nV100\n"), lambda w: w.press("sd"), ["a is shut down"], "stopped", None),
    (lambda: chip("V100\n"), nothing, ["a runs no program"], "stopped", None),
]


@pytest.mark.parametrize(("make", "act", "said", "state", "line"), STATES)
def test_what_is_said_of_a_program_in_each_state(
    make: Callable[[], World], act: Callable[[World], object], said: list[str], state: str, line: int | None
) -> None:
    """The list at the end of a run, and the state of the controller: they name the same statement. 0: any line."""
    world = make()
    world.run(for_=1)
    act(world)
    world.run(for_=1)
    assert [str(one) for one in (*unfinished(world), *without_program(world))] == said
    program = world.state_of("a").program
    assert program.state is not None
    assert program.state.value == state
    assert (program.line, program.file is None) == (line or program.line, line is None)
    if said and line is not None:
        assert f"{program.file}:{program.line} {program.statement}" in said[0]
