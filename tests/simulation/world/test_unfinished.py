"""What stands still at the end of a run."""

from __future__ import annotations

from steptwin.files.world import World
from steptwin.simulation.world.unfinished import unchanged_inputs, waiting

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
    assert [one.who for one in waiting(world)] == ["c", "operator"], "a delay is no wait"
    world.run(for_=1)
    assert [tuple(one) for one in waiting(world)] == [
        ("a", "a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by start"),
        ("c", "c.m1486:3 o3: c.B3 is 0, driven by a.OUT1"),
        ("operator", "a.OUT2"),
    ]
    world.press("start", "100 ms")
    world.run(for_=1)
    assert next(iter(waiting(world))) == ("a", "a.prg:4 WAIT OUT2 = ON: a.OUT2 is 0")


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
    (one,) = waiting(world)
    assert one.what == "a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by both.out (held at 0 by fault weld)"
    world.fault("stuck pin=IN5 value=0")
    world.run(for_=1)
    assert [one.what for one in waiting(world)] == ["a.prg:2 WAIT IN5 = ON: a.IN5 is held at 0 by fault stuck"]
    world.clear_fault("stuck")
    world.clear_fault("weld")
    world.run(for_=1)
    assert [one.what for one in waiting(world)] == ["a.prg:2 WAIT IN5 = ON: a.IN5 is 0, driven by both.out"]


def test_inputs_that_never_changed() -> None:
    world = World.from_toml(TEXT, FILES)
    world.run(for_=1)
    assert unchanged_inputs(world, 0) == ["c.B3", "a.IN5"]
    world.press("start", "100 ms")
    world.run(for_=1)
    assert unchanged_inputs(world, 0) == []


def test_an_input_that_a_program_reads_and_whose_changes_its_filter_takes_away_has_not_changed_for_it() -> None:
    world = World.from_toml(TEXT, FILES)
    world.run(for_=0.1)
    world.press("start", "5 ms")
    world.run(for_=1)
    assert "a.IN5 (for less than its filter of 10 ms)" in unchanged_inputs(world, 0)
    world.press("start", "15 ms")
    world.run(for_=1)
    assert unchanged_inputs(world, 0) == []


def test_a_variable_is_no_pin_whatever_it_is_called() -> None:
    """`program` is a point of the controller, too, which has nothing to do with the variable of the program."""
    text = '[[mic488]]\nname = "a"\nprogram = "p"\nstart = true\n'
    world = World.from_toml(text, {"p": b"program = 0\nWAIT program = 1\n"})
    world.run(for_=1)
    assert [tuple(one) for one in waiting(world)] == [("a", "p:2 WAIT program = 1")]
