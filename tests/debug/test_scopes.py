"""What the debugger shows of controllers and worlds, with units, and what can be set."""

from __future__ import annotations

import pytest
from debug_rig import BOTH, ENTRY, started

from steptwin.controller import SECOND
from steptwin.debug.debugger import Debugger
from steptwin.files.world import World


def test_values_are_read_and_set_with_their_units() -> None:
    debugger = started()
    debugger.step_over("m")
    assert debugger.set_value("m", "n", "6 * 7").number == 42.0
    debugger.step_over("m")
    (variable,) = debugger.scope("m", "Variables").values
    assert (variable.name, variable.text, variable.is_settable) == ("n", "43", True)
    assert debugger.set_value("m", "IN3", "1").text == "1"
    assert debugger.set_value("m", "M1_ACC", "55").number == 55.0
    names = {value.name for value in debugger.scope("m", "Axes").values}
    assert {"M1.position", "M1.velocity", "M1.status"} <= names
    pins = {value.name: value for value in debugger.scope("m", "Pins").values}
    assert (pins["IN3"].text, pins["IN3"].is_settable, pins["OUT1"].is_settable) == ("1", True, False)


def test_whether_an_axis_moves_is_said_once() -> None:
    debugger = started(world=BOTH)

    def status(controller: str) -> str:
        return next(value.text for value in debugger.scope(controller, "Axes").values if value.name == "M1.status")

    assert (status("c"), status("m")) == ("at rest", "off, at rest")


def test_pins_of_a_driver_interface_are_those_of_the_moment() -> None:
    """They follow the pulses, between which a chip has nothing to do."""
    text = '[[m1486]]\nname = "k"\ninterface = "dual"\nprogram = "k.m1486"\n'
    world = World.from_toml(text, {"k.m1486": b"[\nV200\nF64000\nR\n]\n"})
    debugger = Debugger(world)
    world.run(0.5)
    seen = set()
    for _ in range(5):
        world.run(for_=0.0031)
        pins = {one.name: one.number for one in debugger.scope("k", "Pins").values}
        assert pins == world.m1486["k"].pins
        seen.add(tuple(pins.values()))
    assert len(seen) > 1


@pytest.mark.parametrize("scope", ["Variables", "Axes", "Pins", "Registers", "World"])
@pytest.mark.parametrize("controller", ["m", "c"])
def test_what_is_shown_can_be_evaluated(controller: str, scope: str) -> None:
    debugger = started(world=BOTH)
    shown = debugger.scope(controller, scope).values
    lacking = {("c", "Pins"): ["S&D"], ("c", "Axes"): ["M1.status"]}.get((controller, scope), [])
    assert [value.name for value in shown if not value.expression] == lacking
    for value in shown:
        found = debugger.evaluate(controller, value.expression or "0").number
        assert value.number is None or found == (value.number if value.expression else 0.0)
    if controller == "c" and scope == "Axes":
        assert [value.expression for value in shown][:2] == ["position", "velocity"]


def test_names_of_registers_in_the_program_can_be_set() -> None:
    debugger = started()
    for name, register in (("$R10", "USER_REGISTER[10]:real"), ("$i3", "USER_REGISTER[3]:int"), ("VMAXM1", "M1_VMAX")):
        assert debugger.set_value("m", name, "33").number == 33.0
        assert debugger.evaluate("m", name).number == 33.0
        assert debugger.view.read(f"m.{register}") == 33.0
    assert debugger.evaluate("m", "time").number == ENTRY / SECOND
