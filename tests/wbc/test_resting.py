"""Loops that rest (WBC-18): at every moment the program stands where it would stand if every statement were executed.

The other of the two controllers executes every statement. Nothing else of what they do is asked here.
"""

from __future__ import annotations

import pytest
from mic488_rig import Rig, programmed

from steptwin.controller import MILLISECOND, SECOND

FROM_THE_SECOND_ROUND = "L:\nn = n + 1\nWHILE n = 2\nENDWHILE\nJUMP L\n"
"""The loop begins behind the place to which the program has jumped back before."""
WITH_A_DELAY = "L:\nn = n + 1\nx = 7\nWHILE n = 2\nDELAY 0.025\nENDWHILE\nJUMP L\n"
SUBROUTINE = "L:\nJUMP S\nIF IN1 = OFF\nJUMP L\nENDIF\nEND\nS:\nx = AIN1\nJUMP T\nRETURN\nT:\ny = 2 * x\nRETURN\n"
NESTED = "WHILE 1 = 1\nx = 1\nWHILE IN1 = OFF\nx = 2\nIF IN2 = ON\nx = 3\nENDIF\nENDWHILE\nOUT1 = ON\nWAIT IN1 = OFF\nENDWHILE\n"
COMPUTED = "L:\nx = TIMB1\ny = x - x\nIF x > 2\nOUT2 = ON\nENDIF\nIF IN1 = ON\nOUT1 = ON\nENDIF\nJUMP L\n"
IN_A_HANDLER = "WAIT 1 = 2\nINT_IN3:\nWHILE IN1 = OFF\nx = 5\nENDWHILE\nOUT1 = ON\nRETURN\n"
INTERRUPTED = "M:\nx = 1\nDELAY 0.02\nx = 2\nDELAY 0.03\nJUMP M\nINT_IN3:\n$I1 = $I1 + 1\n$I0 = x\nRETURN\n"
HELD_UP = "M:\nx = 1\nDELAY 0.02\nx = 2\nDELAY 0.03\nJUMP M\nHARDINT_IN3:\n$I1 = $I1 + 1\n$I0 = x\nRETURN\n"
PROGRAMS = {
    "from the second round": FROM_THE_SECOND_ROUND,
    "with a delay": WITH_A_DELAY,
    "subroutine": SUBROUTINE,
    "nested": NESTED,
    "computed": COMPUTED,
    "in a handler": IN_A_HANDLER,
    "interrupted": INTERRUPTED,
    "held up": HELD_UP,
}
LOOKS = tuple(range(0, 4 * SECOND, 37_300_001)) + tuple(range(SECOND, SECOND + 60 * MILLISECOND, 400_000))
"""Moments at which both are looked at: now and then, and closely."""


def started(text: str, statement_time: int, *, rests: bool = True) -> Rig:
    rig = programmed(f"CFGINT_IN3 = RIS\n{text}" if "INT_IN3" in text else text, statement_time=statement_time)
    rig.device.program.interpreter.rests = rests
    rig.start()
    return rig


def stands(rig: Rig) -> dict[str, object]:
    """Where the program stands, and what it has made of its variables and outputs."""
    control, now = rig.device.program, rig.now
    return {
        "at": now,
        "statement": control.statement(now),
        "variables": list(control.interpreter.cells_at(now)),
        "registers": list(rig.device.user[:4]),
        "outputs": list(rig.device.outputs),
        "state": control.state,
    }


def happen(rig: Rig, number: int) -> None:
    """What happens to a controller from outside, one after another."""
    if number in (0, 2):
        rig.pin("IN3", 1 - number // 2)
    elif number in (1, 3):
        rig.pin("IN1", number // 2)
    elif number == 4:
        rig.pause()
    elif number == 5:
        rig.start()
    elif number == 6:
        rig.pin("IN1", 0)
        rig.pin("IN3", 1)


@pytest.mark.parametrize("statement_time", [MILLISECOND, 700_001, 13 * MILLISECOND])
@pytest.mark.parametrize("name", PROGRAMS)
def test_wbc_18_a_loop_that_rests_is_seen_to_go_round(name: str, statement_time: int) -> None:
    resting, looking = (started(PROGRAMS[name], statement_time, rests=rests) for rests in (True, False))
    events = {500_000_017 * number + 200 * MILLISECOND: number for number in range(7)}
    for moment in sorted({*LOOKS, *events}):
        for rig in (resting, looking):
            rig.wait_ns(moment - rig.now)
            if moment in events:
                happen(rig, events[moment])
        assert stands(resting) == stands(looking)


@pytest.mark.parametrize("name", PROGRAMS)
def test_wbc_18_nothing_is_executed_while_a_loop_rests(name: str) -> None:
    rig = started(PROGRAMS[name], MILLISECOND)
    for moment in (2500, 6300):
        rig.wait_ns(moment * MILLISECOND - rig.now)
        due = rig.device.deadline()
        assert due is None or due > rig.now + 200 * MILLISECOND
        rig.pin("IN3", float(moment == 2500))
        rig.wait(1)


LOOP, WAIT = "WHILE IN1 = OFF\nENDWHILE\n", "WAIT IN1 = ON\n"


@pytest.mark.parametrize(
    ("text", "rests", "in_loops", "due"),
    [(LOOP, True, True, None), (LOOP, True, False, 1), (LOOP, False, True, 1), (WAIT, True, False, None), (WAIT, False, True, 1)],
)
def test_resting_can_be_switched_off_for_loops_and_altogether(text: str, rests: bool, in_loops: bool, due: int | None) -> None:
    rig = started(text, MILLISECOND, rests=rests)
    rig.device.program.interpreter.rests_in_loops = in_loops
    rig.wait(0.1)
    assert rig.device.deadline() == (None if due is None else rig.now + due * MILLISECOND)


@pytest.mark.parametrize(("written_ns", "seconds"), [(50 * MILLISECOND - 1, 0.051), (50 * MILLISECOND, 0.052)])
def test_a_statement_sees_what_has_happened_before_its_moment(written_ns: int, seconds: float) -> None:
    """The program looks at whole milliseconds, and what comes at such a moment comes after it has looked."""
    rig = started("WAIT $I9 = 1\nOUT1 = ON\nWAIT 1 = 2\n", MILLISECOND)
    rig.wait_ns(written_ns)
    rig.i(9, 1)
    rig.wait(0.1)
    assert rig.changes("OUT1") == [(seconds, 1.0)]
