"""Programs that calculate are executed ahead, up to what they change next; nothing outside can tell."""

from __future__ import annotations

from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.controller import MICROSECOND, MILLISECOND, Nanos
from steptwin.files.world import World
from steptwin.mic488.core import ControllerCore
from steptwin.subject.time import next_due

WBC_LINES = st.sampled_from([
    "n = n + 1", "m = n * 3", "$D0 = n", "OUT1 = ON", "OUT1 = OFF", "OUT2 = ON", "PULSE(OUT3, 0.004)", "DELAY 0.003", "M1 = ON",
    "M1 = OFF", "PREL M1 5", "VABS M1 20", "STOP M1", "WAITPOS", "WAIT PosM1 > 2", "JUMP BELOW", "IF IN1 = ON\nn = 0\nENDIF",
    "IF IN2 = ON\nOUT2 = ON\nENDIF", "CFGINT_IN1 = 3",
])  # fmt: skip
WBC = "n = 0\nM1 = ON\nMAIN:\n{}\nn = n + 1\nJUMP MAIN\nBELOW:\nm = m + 1\nRETURN\nINT_IN1:\nOUT2 = OFF\nRETURN\n"
CHIP_LINES = st.sampled_from(["+1", "-1", "L3\n+1\nE", "T5", "C5", "T6", "W2", "F64", "B64", "R", "V400", "'2", "I1H1"])
CHIP = "[\n@1\n{}\n+1\nJ1\n@2\n+2\n.\n]\n"
AXIS = "[mic488.M1]\ngear = 1.0\nacc = 1000.0\ndec = 1000.0\nvel = 500.0\n"
ALONE = '[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\nstatement_time = "100 us"\n' + AXIS
TOGETHER = (
    ALONE
    + '[[mic488]]\nname = "other"\nprogram = "other.prg"\nstart = true\n'
    + '[[line]]\nname = "chips"\nkind = "m1486"\n[[m1486]]\nname = "c"\nline = "chips"\nprogram = "c.m1486"\n'
    + '[[wire]]\nfrom = "m.OUT1"\nto = "other.IN1"\n'
    + '[[wire]]\nfrom = "m.OUT3"\nto = "other.IN2"\n[[wire]]\nfrom = "other.OUT1"\nto = "m.IN1"\ndelay = "2 ms"\n'
)
CONDITIONS = st.sampled_from(
    ["", "m.OUT1", "m.OUT3 == 1", "m.M1.status > 1", "m.M1.position > 3", "m.USER_REGISTER[0] > 2", "m.program == 0", "idle"]
)
SCRIPT = (
    '[[script]]\nname = "s"\nrepeat = 1000\n'
    'steps = [{ until = "CONDITION" }, { set = { "m.IN2" = 1 } }, { wait = "1500 us" }, { set = { "m.IN2" = 0 } }]\n'
)
END: Nanos = 60 * MILLISECOND


def made(text: str, wbc: str, other: str = "", chip: str = "") -> World:
    files = {"m.prg": wbc.encode(), "other.prg": other.encode(), "c.m1486": chip.encode()}
    return World.from_toml(text, files)


@settings(deadline=None, max_examples=20)
@given(st.lists(WBC_LINES, max_size=8), st.lists(WBC_LINES, max_size=8), st.lists(CHIP_LINES, max_size=8), CONDITIONS)
def test_a_run_is_the_same_event_by_event(first: list[str], second: list[str], chip: list[str], condition: str) -> None:
    programs = WBC.format("\n".join(first)), WBC.format("\n".join(second)), CHIP.format("\n".join(chip))
    waits = SCRIPT.replace("CONDITION", condition) if condition else ""
    for text in (ALONE, TOGETHER):
        at_once, by_events = made(text + waits, *programs), made(text + waits, *programs)
        at_once.run_to(END)
        for scheduler in by_events.schedulers:
            scheduler.is_step_exact = True
        while (due := next_due(by_events)) is not None and due <= END:
            by_events.run_to(due)
        by_events.run_to(END)
        assert list(by_events.trace) == list(at_once.trace)
        assert by_events.trace.digest() == at_once.trace.digest()


def test_what_happens_meanwhile_is_told_at_its_moment() -> None:
    """The pulse and the move end while the program calculates, which goes on to switch OUT1 on 2 ms later."""
    program = "M1 = ON\nPREL M1 5\nPULSE(OUT3, 0.004)\nMAIN:\n" + "n = n + 1\n" * 20 + "OUT1 = ON\nOUT1 = OFF\nJUMP MAIN\n"
    world = made(ALONE, program)
    (scheduler,) = world.schedulers
    told: dict[str, list[Nanos]] = {}
    scheduler.edge_subscribers.append(lambda name, edge: told.setdefault(edge.pin, []).append(scheduler.now - edge.time))
    world.run_to(END)
    assert set(told) >= {"OUT1", "OUT3", "M1_EN"}
    assert {late for lates in told.values() for late in lates} == {0}


@pytest.mark.parametrize("waits", ["", SCRIPT.replace("CONDITION", "m.OUT1")])
def test_statements_that_only_calculate_cost_no_look_at_the_signals(waits: str) -> None:
    program = "n = 0\nMAIN:\n" + "n = n + 1\n" * 20 + "JUMP MAIN\n"
    world = made(ALONE.replace("100 us", "1 us") + waits, program)
    with patch.object(ControllerCore, "take_edges", autospec=True, side_effect=ControllerCore.take_edges) as looks:
        world.run_to(1000 * MICROSECOND)
    assert looks.call_count < 10
