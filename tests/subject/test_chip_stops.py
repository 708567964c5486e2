"""Stops of M1486 twins: without a line, on a disturbed one, behind a text that is being typed."""

from __future__ import annotations

from textwrap import dedent

import pytest

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script.control import ControlProgram
from steptwin.simulation.script.steps import SetFault
from steptwin.simulation.world.inputs import Download
from steptwin.subject import commands as command
from steptwin.subject.world import WorldSubject

LOOPING = "[\n@5\nF12800\nR\nW100\nB12800\nR\nW100\nJ5\n]"
CHIP = """
    {line}
    [[m1486]]
    name = "chip"
    address = 7
    variant = "{variant}"
    {keys}
"""
LINE = '[[line]]\nname = "chips"\nkind = "m1486"'


def chip(keys: str, *, variant: str = "B", line: str = "") -> WorldSubject:
    text = dedent(CHIP).format(line=dedent(line), keys=keys, variant=variant)
    return WorldSubject(World.from_toml(text, {"loop.m1486": LOOPING.encode()}))


def settle(subject: WorldSubject, seconds: float) -> float:
    world = subject.world
    world.advance(world.now + round(seconds * SECOND))
    world.sync_all()
    return world.read("chip.position")


@pytest.mark.parametrize("line", ["", LINE])
@pytest.mark.parametrize("stop", [command.StopAll(), command.StopAxes("chip"), ControlProgram("chip", "stop")])
def test_a_program_that_loops_ends_also_on_no_line(stop: command.Command, line: str) -> None:
    subject = chip('program = "loop.m1486"' + ('\nline = "chips"' if line else ""), line=line)
    assert settle(subject, 0.5) > 0.0
    value = subject.do(stop).value
    if isinstance(stop, command.StopAxes):
        assert value == {"program": "stopped"}
    stood = settle(subject, 1.0)
    assert settle(subject, 3.0) == stood


@pytest.mark.parametrize("fault", ["gap for_ms=300 direction=in line=chips", "drop nth=5 direction=in line=chips"])
@pytest.mark.parametrize("variant", ["B", "E1"])
def test_a_disturbed_line_does_not_keep_a_chip_from_stopping(variant: str, fault: str) -> None:
    subject = chip('line = "chips"', variant=variant, line=LINE)
    subject.world.apply_input(SetFault(read_fault(fault)))
    subject.do(command.Jog("chip", 1, 64_000.0))
    settle(subject, 0.1)
    subject.do(command.StopAxes("chip"))
    assert settle(subject, 1.0) == settle(subject, 5.0)


@pytest.mark.parametrize("stop", [command.StopAll(), command.StopAxes("chip")])
@pytest.mark.parametrize("seconds", [0.0, 0.7, 2.2])
@pytest.mark.parametrize("variant", ["B", "E1"])
def test_a_text_that_is_being_typed_is_given_up(variant: str, seconds: float, stop: command.Command) -> None:
    """Also while the EEPROM is erased. What is commanded behind it is done."""
    subject = chip('line = "chips"', variant=variant, line=LINE)
    subject.do(Download("chip", "program", LOOPING))
    settle(subject, seconds)
    subject.do(stop)
    stood = settle(subject, 1.0)
    assert settle(subject, 9.0) == stood
    subject.do(command.Move("chip", 1, by=6400.0))
    assert settle(subject, 4.0) == stood + 6400.0
