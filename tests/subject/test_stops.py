"""After a stop of a world nothing begins that was asked for before it; stopping holds the load; everything means everything."""

from __future__ import annotations

from pathlib import Path

import pytest
from world_rig import small

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.blocking import finish
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import encoded, named
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script.steps import Request, SetFault
from steptwin.simulation.world.inputs import Bytes
from steptwin.subject import commands as command
from steptwin.subject.jogs import WorldJogs
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject
from steptwin.wire.pdu import encode_request

HOIST = """
    [world]
    [[mic488]]
    name = "cell"
    program = "up.prg"
    start = true
    [mic488.M1]
    unit = "mm"
    gear = 640.0
    acc = 200.0
    dec = 200.0
    vel = 100.0
    mot_resol = 3200
    [[axis]]
    name = "z"
    drive = "cell.M1"
    pitch = 5.0
    travel = [-3.0, 600.0]
    start = 80.0
    [axis.motor]
    torque = [[0, 2.0], [600, 1.6], [1500, 0.6]]
    inertia = 0.00003
    mass = 60.0
    force = 590.0
    friction = 0.1
    when_off = "free"
"""
UP = "M1 = ON\nPABS M1 300\nWAITPOS\nPABS M1 0\nWAITPOS\nEND\n"
TIMED = """
    [world]
    [[mic488]]
    name = "a"
    line = "bus"
    [[line]]
    name = "bus"
    kind = "modbus"
    timing = "real"
    [[button]]
    name = "go"
    to = "a.IN4"
    [[script]]
    name = "walk"
    repeat = 100
    steps = [{ write = { "a.M2_POS_REL" = 200 } }, { wait = "500 ms" }]
    [[script]]
    name = "operator"
    steps = [{ at = "1 s" }, { press = "go", for = "3 s" }, { wait = "20 s" }]
"""


def hoist(tmp_path: Path) -> World:
    (tmp_path / "up.prg").write_text(UP)
    (tmp_path / "w.toml").write_text(HOIST)
    return World.load(tmp_path / "w.toml")


def moving(subject: WorldSubject, *points: str) -> list[float | None]:
    return [reading.value for reading in subject.read(*points)]


def test_a_hanging_load_is_held_and_the_program_goes_on_from_there(tmp_path: Path) -> None:
    world = hoist(tmp_path)
    subject = WorldSubject(world)
    world.run(until=1.0)
    before = world.read("z.position")
    assert subject.do(command.StopAll()).value == {"controllers": ["cell"], "scripts": []}
    world.run(until=3.0)
    assert world.read("z.position") == pytest.approx(before, abs=5.0)
    assert moving(subject, "cell.M1.enabled", "z.lost", "z.stalled") == [1.0, 0.0, 0.0]
    assert subject.do(command.StopAxes("cell")).value == {"program": "paused"}
    # WBC-9: the axis is at rest, so the WAITPOS that was interrupted has ended, and the next statement follows.
    subject.do(command.ControlProgram("cell", "start"))
    world.run(until=3.1)
    assert world.read("cell.M1.velocity") < 0.0


def test_a_program_that_goes_on_is_told_in_the_answer(tmp_path: Path) -> None:
    subject = WorldSubject(hoist(tmp_path))
    assert subject.do(command.StopAxes("cell", 1)).value == {"program": "running"}


@pytest.mark.parametrize("delay", [0, 2 * MILLISECOND, 8 * MILLISECOND, 20 * MILLISECOND])
@pytest.mark.parametrize("stop", [command.StopAxes("a"), command.StopAxes("a", 1), command.StopAll()])
@pytest.mark.parametrize("asked", [command.Move("a", 1, to=5000), command.Home("a", 1, -100.0), command.Jog("a", 1, 300.0)])
def test_what_waits_for_a_slow_line_is_dropped_by_a_stop(asked: command.Command, stop: command.Command, delay: Nanos) -> None:
    world = World.from_toml(TIMED.partition("[[script]]")[0])
    subject = WorldSubject(world)
    subject.do(command.Enable("a", 1))
    world.advance(100 * MILLISECOND)
    for _ in range(3):  # 10 ms each
        subject.do(asked)
    world.advance(world.now + delay)
    subject.do(stop)
    there = world.read("a.M1.position")
    world.advance(world.now + SECOND)
    assert world.read("a.M1.position") == pytest.approx(there, abs=0.5)
    subject.do(command.Move("a", 1, to=there + 10))  # what comes behind it is done
    world.advance(world.now + 5 * SECOND)
    assert world.read("a.M1.position") == pytest.approx(there + 10)


@pytest.mark.parametrize("stop", [command.StopAxes("a"), command.StopAxes("a", 1), command.StopAll()])
def test_a_jog_that_somebody_holds_is_not_begun_again_after_a_stop_by_somebody_else(stop: command.Command) -> None:
    """Its first motion is still on the line."""
    world = World.from_toml(TIMED.partition("[[script]]")[0])
    subject = WorldSubject(world)
    jogs = WorldJogs(subject)
    subject.do(command.Enable("a", 1))
    world.advance(100 * MILLISECOND)
    held = finish(jogs.begin_jog(command.Jog("a", 1, 10.0)))
    world.advance(world.now + 2 * MILLISECOND)
    subject.do(stop)
    for _ in range(10):
        with pytest.raises(Refusal, match="the jog has ended: stopped"):
            held.extend()
        world.advance(world.now + 80 * MILLISECOND)
        jogs.advance(world.now)
    assert world.read("a.M1.position") == 0.0


def test_requests_for_another_controller_and_other_masters_are_left_alone() -> None:
    world = World.from_toml(TIMED.partition("[[script]]")[0] + '[[mic488]]\nname = "b"\nline = "bus"\nunit = 2\n')
    subject = WorldSubject(world)
    subject.do(command.Enable("a", 1))
    subject.do(command.Enable("b", 1))
    subject.do(command.Enable("a", 2))
    subject.do(command.StopAxes("a"))
    subject.do(command.StopAxes("a"))
    world.advance(SECOND)
    # The first was recalled on its way, the last waited; that for b is done.
    assert moving(subject, "a.M1.enabled", "a.M2.enabled", "b.M1.enabled") == [0.0, 0.0, 1.0]
    raw = bytes.fromhex("01 05 07 d0 ff 00 8c b7")  # M1_EN, as another master sends it
    world.apply_input(Bytes("bus", "hmi", "rtu", raw))
    subject.do(command.StopAxes("a"))
    world.advance(2 * SECOND)
    assert moving(subject, "a.M1.enabled") == [1.0]


def test_a_line_that_carries_nothing_does_not_keep_a_controller_from_stopping() -> None:
    world = World.from_toml(TIMED.partition("[[script]]")[0])
    subject = WorldSubject(world)
    subject.do(command.Enable("a", 1))
    subject.do(command.Jog("a", 1, 300.0))
    world.advance(SECOND)
    assert world.read("a.M1.velocity") > 0.0
    world.apply_input(SetFault(read_fault("no-answer line=bus lost=request")))
    subject.do(command.StopAxes("a"))
    assert world.read("a.M1.velocity") == 0.0


def test_scripts_end_and_held_buttons_are_released(tmp_path: Path) -> None:
    world = World.from_toml(TIMED)
    subject = WorldSubject(world)
    subscription = subject.subscribe(filter_of(["status", "input", "button"]), 99)
    subject.do(command.Enable("a", 2))
    world.run(until=1.2)
    assert subject.do(command.StopAll()).value == {"controllers": ["a"], "scripts": ["operator", "walk"]}
    there = world.read("a.M2.position")
    assert there > 0.0
    world.run(until=5.0)
    assert world.read("a.M2.position") == pytest.approx(there, abs=0.5)
    assert world.read("a.IN4") == 0.0
    said = [event.text for event in subscription.take().events]
    assert "script walk was ended" in said
    assert "go: released" in said or "released" in said[-1]
    # A recording replays the stop.
    save(recording_of(world), tmp_path / "s.json")
    assert load(tmp_path / "s.json").replay().trace.digest() == world.trace.digest()


def test_a_raw_stop_is_an_input_of_each_controller_that_has_its_address() -> None:
    cells = "".join(f'[[mic488]]\nname = "{name}"\nline = "bus"\nunit = {unit}\n' for name, unit in (("a", 1), ("b", 2)))
    apart = '[[mic488]]\nname = "c"\n'
    subject = WorldSubject(World.from_toml(f'{cells}{apart}[[line]]\nname = "bus"\nkind = "modbus"\ntiming = "off"\n'))
    subscription = subject.subscribe(filter_of(["input"]), 99)
    stop = encode_request(encoded(named(register_map("1.70"), "M1_STOP"), 1.0, DataType.REAL))
    for unit, stopped in ((1, ["a"]), (0, ["a", "b"]), (3, [])):
        subject.do(Request("bus", unit, stop, SECOND))
        assert [event.controller for event in subscription.take().events if event.payload.text.startswith("stop")] == stopped


def test_a_snapshot_before_a_stop_is_whole() -> None:
    world = World.from_toml(TIMED)
    world.run(until=0.3)
    snapshot = world.snapshot()
    WorldSubject(world).do(command.StopAll())
    world.run(until=2.0)
    assert world.read("a.M2.position") == 0.0 or not world.scripts
    world.restore(snapshot)
    assert [script.name for script in world.scripts] == ["walk", "operator"]


def test_an_axis_that_is_not_there_is_refused() -> None:
    with pytest.raises(Misuse, match="axis = 9: 'a' is a MIC488, which has axes 1 to 4"):
        WorldSubject(small()).do(command.StopAxes("a", 9))


def test_a_write_that_waits_is_given_up_and_the_script_goes_on() -> None:
    world = World.from_toml(TIMED.partition("[[script]]")[0] + '[[script]]\nname = "s"\nsteps = [{ write = { "a.OUT1" = 1 } }, '
                            '{ note = "on" }]\n')  # fmt: skip
    subject = WorldSubject(world)
    world.advance(MILLISECOND)
    subject.do(command.StopAxes("a"))
    world.advance(SECOND)
    assert world.read("a.OUT1") == 0.0
    assert [late.value for late in world.overdue] == ["s waited in vain for an answer on bus"]
