"""What stands in a world, and since when; the moments are those of independent hooks, edges and numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Enable, Halt, Home, Move
from steptwin.simulation.world.inputs import Download
from steptwin.subject.standing import StandingKind, StandingState
from steptwin.subject.world import WorldSubject

CELL = """
[world]
name = "cell"
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "cell"
line = "bus"
[mic488.M1]
unit = "mm"
gear = 100.0
vel = 40.0
acc = 400.0
dec = 400.0
[[axis]]
name = "x"
drive = "cell.M1"
unit = "mm"
pulses_per_unit = 100
travel = [-5.0, 10.0]
[[cylinder]]
name = "lift"
extend = "cell.OUT1"
[[vacuum]]
name = "cup"
ejector = "cell.OUT2"
[[gripper]]
name = "jaws"
close = "cell.OUT3"
[[conveyor]]
name = "belt"
length = 100.0
speed = 50.0
workpiece = 20.0
run = "cell.OUT4"
[[relay]]
name = "contactor"
coil = "cell.OUT5"
[[dcmotor]]
name = "fan"
speed = 60.0
run = "cell.OUT6"
[[axis]]
name = "y"
drive = "cell.M2"
pitch = 5.0
motor = { torque = [[0, 2.0], [600, 1.6]], inertia = 3e-5, mass = 5.0, start_speed = 120, when_off = "free" }
[[brake]]
name = "hold"
axis = "y"
torque = 1.2
release = "cell.OUT7"
"""


def standing(subject: WorldSubject, kind: StandingKind) -> list[StandingState]:
    return [one for one in subject.standing() if one.kind is kind]


def of_a_program(tmp_path: Path, text: str, *, until_s: float) -> tuple[WorldSubject, list[tuple[Nanos, int]]]:
    """The world at a moment, and the statements that hooks were called for by then, with their lines."""
    (tmp_path / "p.prg").write_text(text)
    head = '[[mic488]]\nname = "a"\nline = "bus"\nprogram = "p.prg"\nstart = true\n'
    (tmp_path / "w.toml").write_text(f'[[line]]\nname = "bus"\nkind = "modbus"\n{head}[[button]]\nname = "go"\nto = "a.IN1"\n')
    world = World.load(tmp_path / "w.toml")
    executed: list[tuple[Nanos, int]] = []
    programs = world.programs["a"]
    programs.add_hook(lambda now, number: executed.append((now, programs.statements("program 0")[number].line)))
    subject = WorldSubject(world)
    world.run(until_s)
    return subject, executed


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("A:\nDELAY 0.5\nWAIT IN1 = ON\nJUMP A", 3),
        ("WAIT IN1 = OFF\nA:\nWAIT IN1 = OFF\nDELAY 0.2\nWAIT IN1 = ON\nJUMP A", 5),
        ("OUT1 = ON\nDELAY 20\nOUT1 = OFF", 2),
        ("CFGINT_IN2 = RIS\nM1 = ON\nVABS M1 5\nWAITPOS", 4),
    ],
)
def test_a_program_waits_since_its_statement_was_executed(tmp_path: Path, text: str, line: int) -> None:
    subject, executed = of_a_program(tmp_path, text, until_s=4.0)
    (one,) = standing(subject, StandingKind.PROGRAM)
    assert (one.name, one.question, one.line, one.place) == ("a", "a", line, "program 0")
    assert (one.since_ns, line) == executed[-1]


def test_a_program_that_goes_on_or_has_ended_does_not_wait(tmp_path: Path) -> None:
    for text in ("A:\nDELAY 0.1\nN = N + 1\nJUMP A", "OUT1 = ON", "A:\nN = N + 1\nJUMP A"):
        subject, _ = of_a_program(tmp_path, text, until_s=4.0)
        assert standing(subject, StandingKind.PROGRAM) == []


def test_a_wait_says_what_is_there_that_it_reads(tmp_path: Path) -> None:
    for text, said in (
        ("WAIT IN1 = ON", "WAIT IN1 = ON (a.IN1 is 0, driven by go)"),
        ("WAIT $I4 = 1", "WAIT $I4 = 1 ($I4 is 0)"),
        ("WAIT ENC1 > 5", "WAIT ENC1 > 5"),  # where it is changes at any moment: the page shows that beside it
    ):
        subject, _ = of_a_program(tmp_path, text, until_s=2.0)
        assert [one.text for one in subject.standing()] == [f"waits at line 1: {said}"]


def test_a_program_that_is_paused_stands_since_then(tmp_path: Path) -> None:
    subject, _ = of_a_program(tmp_path, "A:\nDELAY 0.7\nJUMP A", until_s=2.0)
    subject.world.apply_input(Halt("a", program="pause"))
    subject.world.run_to(4 * SECOND)
    assert list(subject.standing()) == [
        StandingState(StandingKind.PROGRAM, "a", "is paused at line 2: DELAY 0.7", 2 * SECOND, "a", 2, "program 0")
    ]


def test_an_alarm_of_a_program_says_where_it_is(tmp_path: Path) -> None:
    """Of a program that an error stopped, and of one that an input holds."""
    subject, _ = of_a_program(tmp_path, "n = 0\nx = 1 / n", until_s=2.0)
    (one,) = subject.standing()
    assert (one.kind, one.line, one.place) == (StandingKind.ALARM, 2, "program 0")
    assert one.text.endswith("division by zero, at line 2: x = 1 / n")
    text = '[[m1486]]\nname = "c"\nprogram = "c"\n[[button]]\nname = "limit"\nto = "c.LIMIT"\ncontact = "NC"\n'
    world = World.from_toml(text, {"c": b"[\nC51\nG+\nR\nT1\n]\n"})
    subject = WorldSubject(world)
    world.run(for_=1.0)
    world.press("limit")
    world.run(for_=2.0)
    (one,) = subject.standing()
    assert (one.kind, one.text, one.line) == (StandingKind.ALARM, "stopped by LIMIT, at line 5: T1", 5)


@pytest.mark.parametrize(
    ("fault", "output", "name", "text"),
    [
        ("no-air element=lift", 1, "lift", "is switched to extend, and stands at 0 mm"),
        ("", 2, "cup", "is switched on, and holds nothing"),
        ("", 3, "jaws", "is closed, and holds nothing"),
        ("belt-stop element=belt", 4, "belt", "is switched on, and stands"),
        ("open-coil element=contactor", 5, "contactor", "is switched on, and stays open"),
        ("dead-motor element=fan", 6, "fan", "is switched on, and stands"),
        ("stuck-brake element=hold", 7, "hold", "is to let go, and brakes"),
    ],
)
def test_an_element_that_does_not_do_what_it_is_switched_to_stands_since_then(
    fault: str, output: int, name: str, text: str
) -> None:
    world = World.from_toml(CELL)
    world.keep_states()
    subject = WorldSubject(world)
    assert list(subject.standing()) == []
    if fault:
        subject.do(do.SetFault(read(fault)))
    world.run(for_=2.0)
    subject.do(do.Write((("cell", f"OUT{output}", 1),)))
    switched = world.now
    world.run(for_=0.5)
    assert standing(subject, StandingKind.ELEMENT) == []
    world.run(for_=2.0)
    (one,) = standing(subject, StandingKind.ELEMENT)
    assert (one.name, one.text) == (name, text)
    assert one.since_ns is not None
    assert 0 <= one.since_ns - switched <= 300 * MILLISECOND  # jaws have to close first
    for stands in subject.standing():
        assert stands.question is not None
        answer = world.why(stands.question)
        assert f"OUT{output}" in answer.text()
        assert not fault or stands is not one or f"fault {fault.partition(' ')[0]}:" in answer.text()
    subject.do(do.Write((("cell", f"OUT{output}", 0),)))
    world.run(for_=1.5)
    assert standing(subject, StandingKind.ELEMENT) == []


def test_an_axis_says_how_far_it_is_beside_what_is_counted() -> None:
    world = World.from_toml(CELL)
    subject = WorldSubject(world)
    assert list(subject.standing()) == []
    subject.do(Enable("cell", 1, on=True))
    subject.do(Move("cell", 1, to=12.5))
    world.run(for_=3.0)
    (one,) = standing(subject, StandingKind.ELEMENT)
    beside = 12.5 - world.read("x.position")
    assert 2.4 < beside < 2.6
    assert (one.name, one.text, one.question) == ("x", f"is {beside:g} mm beside what its controller counts", "x.lost")
    _, stops = [record.time for record in world.trace.events() if record.subject == "hard-stop"]
    assert one.since_ns == stops
    subject.do(do.SetFault(read("lost-steps axis=1 pulses=40 at_s=2 period_s=2")))
    world.run(for_=5.5)
    (one,) = standing(subject, StandingKind.ELEMENT)
    assert one.since_ns == 7 * SECOND


def test_an_axis_that_was_homed_is_not_beside_what_is_counted_by_what_it_had_lost_before() -> None:
    switch = '[[axis.switch]]\nbelow = 0.0\nto = "cell.IN1"\n[[cylinder]]'
    text = CELL.replace("[[cylinder]]", switch, 1).replace("dec = 400.0", 'dec = 400.0\nin_kl = "IN1"\nhome_mode = "HOME1"')
    world = World.from_toml(text)
    subject = WorldSubject(world)
    assert list(subject.standing()) == []
    subject.do(Enable("cell", 1, on=True))
    subject.do(Move("cell", 1, to=5.0))
    subject.do(do.SetFault(read("lost-steps axis=1 pulses=40 at_s=0.1 name=f")))
    world.run(for_=3.0)
    subject.do(do.ClearFault("f"))
    assert [one.name for one in standing(subject, StandingKind.ELEMENT)] == ["x"]
    subject.do(Home("cell", 1, -20.0))
    world.run(for_=3.0)
    assert standing(subject, StandingKind.ELEMENT) == []
    subject.do(do.SetFault(read("lost-steps axis=1 pulses=20")))
    world.run(for_=2.0)
    (one,) = standing(subject, StandingKind.ELEMENT)
    assert one.text == "is 0.2 mm beside what its controller counts"


def test_faults_stand_at_what_they_are_set_on_at_once() -> None:
    world = World.from_toml(CELL)
    subject = WorldSubject(world)
    world.run(for_=1.0)
    later = "jam element=lift from_s=1"
    for fault in ("stuck pin=IN3 value=1", "leak element=cup", later, "crc unit=1", "lost-steps axis=1 pulses=5 at_s=9"):
        subject.do(do.SetFault(read(fault)))
    found = {one.name: one.question for one in standing(subject, StandingKind.FAULT) if one.since_ns == SECOND}
    assert found == {"cell.IN3": "cell.IN3", "cup": "cup.held", "": None, "cell.M1": "cell.M1.status"}


def test_a_fault_that_is_over_stands_no_more() -> None:
    world = World.from_toml(CELL)
    subject = WorldSubject(world)
    subject.do(do.SetFault(read("stuck pin=IN3 value=1 until_s=2")))
    world.run(for_=1.5)
    assert [one.name for one in standing(subject, StandingKind.FAULT)] == ["cell.IN3"]
    world.run(for_=1.0)
    assert not [*standing(subject, StandingKind.FAULT)]


def test_what_was_later_than_now_has_not_happened() -> None:
    """After a return the moment of a change that is undone is not known, and not that of what is undone."""
    world = World.from_toml(CELL)
    subject = WorldSubject(world)
    subject.standing()
    subject.do(do.Write((("cell", "OUT2", 1),)))
    world.run(for_=2.0)
    there = world.snapshot()
    subject.do(do.Write((("cell", "OUT2", 0),)))
    world.run(for_=2.0)
    subject.go_back(there, None)
    (one,) = standing(subject, StandingKind.ELEMENT)
    assert one.since_ns is None or one.since_ns <= world.now


POLLS = """
OUT1 = ON
OUT1 = OFF
n = 0
MAIN:
n = n + 1
DELAY 0.1
IF IN1 = ON
OUT2 = ON
ENDIF
JUMP MAIN
"""
CALCULATES = "n = 0\nMAIN:\nn = n + 1\nDELAY 0.05\nJUMP MAIN\n"


def idle(subject: WorldSubject) -> list[tuple[str, Nanos | None]]:
    return [(str(one.text), one.since_ns) for one in standing(subject, StandingKind.PROGRAM)]


def test_a_program_that_only_asks_and_calculates_says_what_it_did_last() -> None:
    world = World.from_toml(
        '[world]\nname = "w"\n[[mic488]]\nname = "c"\nprogram = "p.prg"\nstart = true\n', {"p.prg": POLLS.encode()}
    )
    subject = WorldSubject(world)
    subject.standing()
    world.run(for_=0.5)
    assert not idle(subject)
    world.run(for_=1.5)
    last = "executes statements, and has switched and moved nothing since line 3: OUT1 = OFF"
    assert idle(subject) == [(last, 2 * MILLISECOND)]
    subject.do(do.Set((("c", "IN1", 1.0),)))
    world.run(for_=1.5)
    assert not idle(subject)  # it switches OUT2 on again and again


def test_what_another_program_did_is_not_said_of_this_one() -> None:
    world = World.from_toml(
        '[world]\nname = "w"\n[[mic488]]\nname = "c"\nprogram = "p.prg"\nstart = true\n', {"p.prg": POLLS.encode()}
    )
    subject = WorldSubject(world)
    subject.standing()
    world.run(for_=1.0)
    subject.do(do.Write((("c", "PROGRAM_CTRL", 0),)))
    subject.do(Download("c", "program 0", CALCULATES))
    subject.do(do.Write((("c", "PROGRAM_CTRL", 1),)))
    world.run(for_=2.0)
    assert idle(subject) == [("executes statements, and has switched and moved nothing", None)]
