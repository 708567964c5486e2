"""Tests of the panel: against a twin, or with ``pytest --device /dev/ttyUSB0`` against the feeder itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from panel import Panel

from steptwin.testing import Mic488Rig

virtual = pytest.mark.mic488(time="virtual")
"""Homing takes seconds; in virtual time nobody waits for it."""


@virtual
def test_the_axis_is_homed_before_it_goes_anywhere(mic488: Mic488Rig) -> None:
    panel = Panel(mic488.driver)
    assert panel.do("go cut") == "home first"
    assert panel.do("home") == "homed"
    assert panel.do("go cut") == "at cut"
    assert panel.do("show") == "at 120.00 mm"


@virtual
def test_the_load_is_where_the_display_says(mic488: Mic488Rig) -> None:
    panel = Panel(mic488.driver)
    panel.do("home")
    panel.do("go unload")
    assert mic488.axis(1).position == 200.0  # the machine itself, not a register: on a device this test is skipped here


@virtual
def test_somebody_runs_into_the_end_switch(mic488: Mic488Rig) -> None:
    panel = Panel(mic488.driver)
    panel.do("home")
    mic488.later(2.0, lambda: mic488.set_pin("IN5", 1))  # KR, two seconds into the move
    assert panel.do("go unload") == "STOPPED: stopped at limit R"
    assert panel.do("go load") == "home first"


@virtual
def test_an_answer_that_is_lost_now_and_then_does_no_harm(mic488: Mic488Rig) -> None:
    panel = Panel(mic488.driver)
    mic488.fault("no-answer lost=answer function=3 every=4")
    assert panel.do("home") == "homed"
    assert panel.do("go cut") == "at cut"
    assert mic488.faults[0].happened > 0


@virtual
def test_a_cable_that_comes_off_is_told_plainly(mic488: Mic488Rig) -> None:
    panel = Panel(mic488.driver)
    panel.do("home")
    mic488.fault("no-answer lost=request name=cable")
    assert panel.do("go cut") == "NO CONNECTION. Check the cable, then home."
    mic488.clear_faults("cable")
    assert panel.do("go cut") == "home first"


@pytest.mark.mic488(speed=20.0)
def test_the_program_as_an_operator_starts_it(mic488: Mic488Rig) -> None:
    program = [sys.executable, Path(__file__).with_name("panel.py"), mic488.address]
    typed = "home\ngo load\nshow\nquit\n"
    shown = subprocess.run(program, input=typed, capture_output=True, text=True, check=True, timeout=60)
    assert shown.stdout.splitlines() == ["ready", "homed", "at load", "at 0.00 mm"]
