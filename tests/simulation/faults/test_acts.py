"""How often each kind of fault acts, and when first: with what it acts on, and where the machine would be the same without it."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from tests.support.fault_rig import FaultRig

from steptwin.files.world import World
from steptwin.simulation.components.registry import fault_kinds
from steptwin.simulation.faults.active import FaultActs

MS = 1_000_000
BASE = """
[world]
name = "w"
[[mic488]]
name = "c"
program = "p.prg"
start = true
"""
AXIS = """
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
travel = [0.0, 100.0]
"""
MOTOR = (
    AXIS
    + """[axis.motor]
torque = [[0, 0.5], [600, 0.4]]
inertia = 0.00004
"""
)
FREE = MOTOR + "when_off = 'free'\n"
OTHER = MOTOR.replace('"x"', '"y"').replace("c.M1", "c.M2")
CUP = """
[[conveyor]]
name = "b"
length = 200
feed = "c.OUT2"
speed = 100
run = "c.OUT3"
"""
PRESS = """
[[button]]
name = "go"
to = "c.IN1"
[[event]]
at = "100 ms"
steps = [{ press = "go" }, { wait = "100 ms" }, { release = "go" }]
"""
ON = "DELAY 0.1\nOUT1 = ON\nDELAY 0.1\nOUT1 = OFF\n"
"""OUT1 is on from 100 to 200 ms, less some statements."""
RUN = "M1 = ON\nDELAY 0.1\nPREL M1 8\nWAITPOS\nDELAY 0.1\nPREL M1 8\nWAITPOS\n"
SLEEP = "DELAY 1\n"


class Acts(NamedTuple):
    """``count``: how often it acts in 500 ms with ``program``, ``first``: in whole ms; with ``idle`` never."""

    fault: str
    tables: str
    program: str
    count: int
    first: int
    idle: str | None = SLEEP


CYLINDER = "[[cylinder]]\nname = 'e'\nextend = 'c.OUT1'\nextend_time = '50 ms'\nretract_time = '50 ms'\n"
RELAY = "[[relay]]\nname = 'e'\ncoil = 'c.OUT1'\n"
TRANSDUCER = AXIS + "[[transducer]]\nname = 'e'\nof = 'x.position'\nto = 'c.AIN1'\npoints = [[0, 1], [10, 10]]\n"
BRAKE = FREE + "[[brake]]\nname = 'e'\naxis = 'x'\ntorque = 0.4\nrelease = 'c.OUT1'\n"
FOLLOWER = AXIS + "[[shaft]]\nname = 's'\naxis = 'x'\nratio = 0.04\n"
FOLLOWER += "[[follower]]\nname = 'f'\nshaft = 's'\npoints = [[0, 0], [90, 9]]\n"
TOOL = MOTOR + OTHER + "[[tool]]\nname = 'e'\naxis = 'x'\nother = 'y'\n"
GANTRY = MOTOR + OTHER + "[[gantry]]\nname = 'e'\naxis = 'x'\nother = 'y'\nlimit = 90\nmass = 1\n"
TABLE = (
    Acts("stuck machine=c pin=IN1 value=0", PRESS, SLEEP, 1, 100, None),
    Acts("stuck machine=c pin=IN1 value=1", PRESS, SLEEP, 2, 0, None),
    Acts("stuck machine=c pin=OUT1 value=0", "", ON, 1, 100),
    Acts("stuck machine=c pin=OUT1 value=1", "", ON, 2, 0, None),
    Acts("bounce machine=c pin=IN1", PRESS, SLEEP, 2, 100, None),
    Acts("stall machine=c axis=1 for_s=9 at_s=0", AXIS, RUN, 2, 100),
    Acts("stall machine=c axis=1 for_s=0.1 at_s=0.15", AXIS, RUN, 1, 150),
    Acts("stall machine=c axis=1 for_s=0.05 at_s=0", AXIS, RUN, 0, 0, RUN),
    Acts("lost-steps machine=c axis=1 at_s=0.2", AXIS, RUN, 1, 200, None),
    Acts("slip machine=c axis=1 at_s=0.2", AXIS, RUN, 1, 200, None),
    Acts("supply-drop machine=c at_s=0.2 for_s=0.1", "", SLEEP, 1, 200, None),
    Acts("master-error machine=c from_s=0.2", "", SLEEP, 1, 200, None),
    Acts("stuck-output element=e output=extended level=0", CYLINDER, ON, 1, 150),
    Acts("stuck-input element=e input=extend level=0", CYLINDER, ON, 1, 100),
    Acts("stuck-input element=e input=extend level=1", CYLINDER, ON, 2, 0, None),
    Acts("jam element=e", CYLINDER, ON, 1, 100),
    Acts("jam element=e from_s=0.17", CYLINDER, ON, 1, 200),
    Acts("no-air element=e", CYLINDER, ON, 1, 100),
    Acts("welded-contact element=e", RELAY, ON, 1, 200),
    Acts("open-coil element=e", RELAY, ON, 1, 100),
    Acts("broken-wire element=e from_s=0.2", TRANSDUCER, SLEEP, 1, 200, None),
    Acts("drift element=e from_s=0.2 volts=-1", TRANSDUCER, SLEEP, 1, 200, None),
    Acts("drift element=e volts=1", TRANSDUCER.replace("[0, 1]", "[0, 10]"), SLEEP, 0, 0),
    Acts("belt-stop element=b", CUP, "DELAY 0.1\nOUT3 = ON\nDELAY 1\n", 1, 100),
    Acts("empty-feeder element=b", CUP, "DELAY 0.1\nOUT2 = ON\nDELAY 0.1\nOUT2 = OFF\nDELAY 0.1\nOUT2 = ON\nDELAY 1\n", 2, 100),
    Acts("worn-brake element=e", BRAKE, ON, 2, 0, None),
    Acts("stuck-brake element=e", BRAKE, ON, 1, 130),
    Acts("slipping-coupling element=e", AXIS + "[[shaft]]\nname = 'e'\naxis = 'x'\nratio = 0.04\n", RUN, 1, 100),
    Acts(
        "stuck-follower element=f",
        FOLLOWER,
        RUN, 1, 100,
    ),
    Acts(
        "worn-cam element=f",
        FOLLOWER,
        RUN, 1, 100,
    ),
    Acts("slack-belt element=e", AXIS + "[[carriage]]\nname = 'e'\naxis = 'x'\nfrequency = 12\n", RUN, 2, 100),
    Acts("slipping-belt element=e", TOOL, RUN, 1, 100),
    Acts("slipping-belt element=e belt=other", TOOL, RUN, 0, 0, RUN),
    Acts("stiff-guides element=e", GANTRY, RUN, 2, 100),
    Acts(
        "leak element=e",
        CUP + "[[vacuum]]\nname = 'e'\nejector = 'c.OUT1'\npick = 'c.OUT1'\nfrom = 'b'\npick_at = 10\n",
        "OUT2 = ON\nOUT3 = ON\nDELAY 0.1\nOUT3 = OFF\nDELAY 0.1\nOUT1 = ON\nDELAY 1\n", 1, 200, "OUT2 = ON\n" + SLEEP,
    ),
    Acts(
        "worn-jaws element=e",
        CUP + "[[gripper]]\nname = 'e'\nclose = 'c.OUT1'\npick = 'c.OUT1'\nfrom = 'b'\npick_at = 10\n",
        "OUT2 = ON\nOUT3 = ON\nDELAY 0.1\nOUT3 = OFF\nDELAY 0.1\nOUT1 = ON\nDELAY 1\n", 1, 200, "OUT2 = ON\n" + SLEEP,
    ),
    Acts("brown-out element=e from_s=0.2", "[[supply]]\nname = 'e'\nfeeds = 'c'\n", SLEEP, 1, 200, None),
    Acts("dead-motor element=e", "[[dcmotor]]\nname = 'e'\nspeed = 60\nrun = 'c.OUT1'\n", ON, 1, 100),
    Acts("other-rate element=e", "[[integrator]]\nname = 'e'\nrate = '2 * c.OUT1'\n", ON, 1, 100),
    Acts("other-load element=e", MOTOR + "[[load]]\nname = 'e'\naxis = 'x'\nmass = 0.1\nwhen = 'c.OUT1'\n", ON, 1, 100),
    Acts("other-load element=e factor=0", MOTOR + "[[load]]\nname = 'e'\naxis = 'x'\nmass = 0.1\nwhen = 'c.OUT1'\n", ON, 1, 100),
)  # fmt: skip
ON_LINES = {
    "flip",
    "drop",
    "insert",
    "gap",
    "split",
    "noise",
    "delay",
    "no-answer",
    "late",
    "wrong-unit",
    "crc",
    "echo",
    "exception",
    "busy",
}
"""They act whenever they happen: `tests/simulation/faults/test_port.py`."""
SAVES = {"power-cut", "wear"}
"""At a save: `test_controller.py`."""


def acts(row: Acts, program: str) -> World:
    world = World.from_toml(BASE + row.tables, {"p.prg": program.encode()})
    world.fault(f"{row.fault} name=f")
    world.run(0.5)
    return world


def test_each_kind_is_in_the_table() -> None:
    assert {row.fault.split()[0] for row in TABLE} | ON_LINES | SAVES == set(fault_kinds())


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.fault)
def test_a_fault_acts_where_it_makes_a_difference(row: Acts) -> None:
    world = acts(row, row.program)
    found = world.objects.faults.acts.get("f", FaultActs(0, 0, 0))
    assert found.count == row.count
    assert row.first <= found.first / MS < row.first + 5
    if row.idle is not None:
        assert not acts(row, row.idle).objects.faults.acts


@pytest.mark.parametrize("kind", ["crc", "exception", "drop"])
def test_a_fault_of_a_line_acts_whenever_it_happens(kind: str) -> None:
    rig = FaultRig(f"{kind} name=f every=2")
    for _ in range(6):
        rig.ask()
    acted = rig.faults.acts["f"]
    assert acted.count == rig.faults.called("f").struck > 1
    rig.faults.remove("f", rig.now)
    assert rig.faults.acts["f"] == acted


def test_acts_are_in_snapshots() -> None:
    row = next(row for row in TABLE if row.fault == "jam element=e")
    world = World.from_toml(BASE + row.tables, {"p.prg": row.program.encode()})
    world.fault("jam element=e name=f")
    world.run(0.05)
    before = world.snapshot()
    world.run(0.2)
    acted = world.objects.faults.acts
    assert acted["f"].count == 1
    world.restore(before)
    assert not world.objects.faults.acts
    world.run(0.2)
    assert world.objects.faults.acts == acted
