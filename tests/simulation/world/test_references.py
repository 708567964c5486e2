"""Steps that name what is not there, or what cannot be done with it, are refused before anything is done."""

from __future__ import annotations

import re

import pytest

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import See, SetVariable
from steptwin.simulation.world.references import check_step

WORLD = """
[[line]]
name = "chips"
kind = "m1486"
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "m"
line = "bus"
[[m1486]]
name = "c"
line = "chips"
[[axis]]
name = "x"
drive = "m.M1"
[[button]]
name = "go"
to = "m.IN3"
[[fault]]
kind = "slip"
name = "loose"
machine = "m"
axis = 2
counts = 5
at_s = 3600
"""


@pytest.mark.parametrize(
    ("step", "text"),
    [
        (
            do.Until("m.IN99 == 1"),
            "no signal 'm.IN99' (did you mean 'IN9'?); there are status, program, M1.status, M1.enabled",
        ),
        (do.Expect("nobody.x == 1"), "no signal 'nobody.x': nothing is called 'nobody'; there are m, c, x, go, time, idle"),
        (do.UntilOver("nobody", 1), "no controller is called 'nobody'; there are m, c"),
        (do.UntilOver("m", 5), "m.M5: m has M1, M2, M3, M4"),
        (do.UntilOver("c", 2), "c.M2: c has M1"),
        (do.ExpectReached("m", 0), "m.M0: m has M1, M2, M3, M4"),
        (do.ExpectReached("nobody", 1), "no controller is called 'nobody'; there are m, c"),
        (do.Set((("m", "IN99", 1.0),)), "no input pin 'IN99': inputs are IN1 to IN20 and AIN1 to AIN2"),
        (do.Set((("m", "IN1", 1.0), ("nobody", "IN1", 1.0))), "no controller is called 'nobody'; there are m, c"),
        (do.Set((("m", "OUT1", 1.0),)), "no input pin 'OUT1': inputs are IN1 to IN20 and AIN1 to AIN2"),
        (do.Set((("m", "IN1", 2.0),)), "IN1 = 2: a digital input is 0 or 1"),
        (do.Press("stop"), "no button is called 'stop'; there are go"),
        (do.Release("stop"), "no button is called 'stop'; there are go"),
        (do.Write((("m", "NOPE", 1.0),)), "firmware 1.70 has no register named 'NOPE'"),
        (do.Write((("nobody", "M1_EN", 1.0),)), "no controller is called 'nobody'; there are m, c"),
        (do.Request("chips", 1, b"\3", 5), "line 'chips' carries no Modbus: requests need a line of kind modbus"),
        (do.Request("none", 1, b"\3", 5), "no line is called 'none'; there are chips, bus"),
        (do.Send("none", b"x"), "no line is called 'none'; there are chips, bus"),
        (do.PowerCycle("nobody"), "no controller is called 'nobody'; there are m, c"),
        (do.Turn("nobody", 1, 5), "no controller is called 'nobody'; there are m, c"),
        (do.Turn("m", 5, 5), "no axis M5: axes are M1 to M4"),
        (do.Turn("c", 1, 5), "'c' is an M1486, which has no encoder"),
        (do.Turn("m", 1, 2**31), "M1: 2147483648 encoder counts at once: permitted -2147483648…2147483647"),
        (do.Couple("m", 1, "free"), "m.M1: its encoder is part of the mechanics of axis 'x'"),
        (do.Couple("m", 7, "free"), "no axis M7: axes are M1 to M4"),
        (do.Couple("c", 1, "free"), "'c' is an M1486, which has no encoder"),
        (See("nobody", 1, 2, 3, 4), "no controller is called 'nobody'; there are m, c"),
        (See("c", 1, 2, 3, 4), "'c' is an M1486, which has no vision registers"),
        (SetVariable("nobody", "x", 1.0), "no controller is called 'nobody'; there are m, c"),
        (do.SetFault(read("slip machine=nobody axis=1 counts=5 at_s=1")), "fault slip: machine = 'nobody': there are m, c"),
        (do.SetFault(read("slip machine=m axis=7 counts=5 at_s=1")), "fault slip: axis = 7: permitted are 1 to 4"),
        (do.ClearFault("tight"), "no fault 'tight': set are loose"),
    ],
)
def test_a_step_that_cannot_be_done_is_refused(step: do.Step, text: str) -> None:
    with pytest.raises(Misuse, match=f"^{re.escape(text)}"):
        check_step(World.from_toml(WORLD), step)


@pytest.mark.parametrize(
    "step",
    [
        do.Send("bus", b"x"),
        do.Couple("m", 2, "free"),
        do.Turn("m", 1, -(2**31)),
        do.ClearFault("loose"),
        do.Set((("m", "IN1", 1.0), ("m", "AIN2", 9.5))),
        do.UntilOver("m", 4),
        do.Request("bus", 1, b"\3", 5),
        See("m", 1, 2, 3, 4),
    ],
)
def test_a_step_that_can_be_done_is_not(step: do.Step) -> None:
    check_step(World.from_toml(WORLD), step)


@pytest.mark.parametrize("coupling", ["drive", "free", "blocked"])
def test_what_turns_an_encoder_shaft(coupling: str) -> None:
    assert do.Couple("m", 1, coupling).coupling == coupling
    with pytest.raises(Misuse, match=r"^'glue': an encoder shaft is turned by drive, free, blocked$"):
        do.Couple("m", 1, "glue")
