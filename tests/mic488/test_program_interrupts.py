"""Programs interrupted and paused in every kind of statement; inputs pass a filter of 10 ms."""

from __future__ import annotations

import pytest
from mic488_rig import PAUSED, RUNNING, STOPPED, Rig, controller, programmed, started

from steptwin.mic488.config import InputConfig
from steptwin.wbc.events import BY_REGISTER, EVENTS

FILTER_S = 0.01
STATEMENT_S = 0.001


# ---------------------------------------------------------------------- interrupts

#: What may be going on when the interrupt comes; OUT8 tells that it is over.
IN_PROGRESS = {
    "WAIT": "WAIT IN2 = ON\nOUT8 = ON\nWAIT IN9 = ON\n",
    "DELAY": "DELAY 1\nOUT8 = ON\nWAIT IN9 = ON\n",
    "WAITPOS": "M1 = ON\nPABS M1 40\nWAITPOS\nOUT8 = ON\nWAIT IN9 = ON\n",
    "WHILE": "WHILE IN2 = OFF\n    n = n + 1\nENDWHILE\nOUT8 = ON\nWAIT IN9 = ON\n",
    "polling": "WHILE PosM1 < 1000\nENDWHILE\nOUT8 = ON\n",
}
HANDLER = "{label}:\nOUT1 = ON\nDELAY 0.2\nOUT1 = OFF\nRETURN\n"


@pytest.mark.parametrize("statement", IN_PROGRESS)
def test_an_interrupt_breaks_into_every_statement(statement: str) -> None:
    rig = started("CFGINT_IN1 = RIS\n" + IN_PROGRESS[statement] + HANDLER.format(label="INT_IN1"))
    rig.wait(0.3)
    at = rig.now / 1e9
    rig.pin("IN1", 1.0)
    rig.wait(0.3)
    (on, _), (off, _) = rig.changes("OUT1")
    # The entry is a statement, and OUT1 = ON the next.
    assert at + FILTER_S <= on <= at + FILTER_S + 2 * STATEMENT_S
    assert off - on == pytest.approx(0.2 + STATEMENT_S, abs=1e-9)
    assert not rig.changes("OUT8")
    rig.wait(0.2)
    rig.pin("IN2", 1.0)
    rig.wait(2.0)
    ended = [time for time, _ in rig.changes("OUT8")]
    if statement == "DELAY":
        assert ended == [0.002 + 1.0]  # its original end
    elif statement == "WAITPOS":
        assert ended[0] - 1.054 < 0.002 + 1e-9  # 40 mm at 50 mm/s with ramps of 0.25 s: the motion went on
        assert ended[0] >= 1.053
    elif statement != "polling":
        assert ended[0] == pytest.approx(rig.now / 1e9 - 2.0 + FILTER_S, abs=0.0031)


def test_wbc_19_a_delay_that_is_over_when_the_interrupt_returns() -> None:
    rig = started("CFGINT_IN1 = RIS\nDELAY 0.4\nOUT8 = ON\nWAIT IN9 = ON\n" + HANDLER.format(label="INT_IN1"))
    rig.wait(0.35)
    rig.pin("IN1", 1.0)
    rig.wait(1.0)
    ((_, _), (off, _)), ((over, _),) = rig.changes("OUT1"), rig.changes("OUT8")
    assert off < over <= off + 3 * STATEMENT_S


def test_hardint_waits_for_the_end_of_the_statement() -> None:
    rig = started(
        "CFGINT_IN1 = RIS\nDELAY 1\nOUT8 = ON\nWAIT IN2 = ON\nOUT7 = ON\nWAIT IN9 = ON\n" + HANDLER.format(label="HARDINT_IN1")
    )
    rig.wait(0.3)
    rig.pin("IN1", 1.0)
    rig.wait(0.5)
    assert not rig.changes("OUT1")
    rig.wait(0.5)
    (on, _) = rig.changes("OUT1")[0]
    assert 1.002 <= on <= 1.006
    assert next(edge for edge in rig.edges if edge.pin in ("OUT1", "OUT8")).pin == "OUT1"
    rig.pin("IN1", 0.0)
    rig.wait(0.1)
    rig.pin("IN1", 1.0)
    rig.wait(3.0)
    assert len(rig.changes("OUT1")) == 2
    rig.pin("IN2", 1.0)
    rig.wait(0.5)
    assert [pin for pin in (edge.pin for edge in rig.edges) if pin != "OUT8"] == ["OUT1", "OUT1", "OUT1", "OUT1", "OUT7"]


@pytest.mark.parametrize("wait", ["DELAY 0.1", "WAIT IN2 = ON", "M1 = ON\nPABS M1 1\nWAITPOS", "PULSE(OUT3, 0.1)"])
def test_hardint_during_a_wait_is_not_left_behind_by_a_program_that_runs_ahead(wait: str) -> None:
    text = f"CFGINT_IN1 = RIS\n{wait}\nWHILE 1 = 1\n$I1 = $I1 + 1\nENDWHILE\n{HANDLER.format(label='HARDINT_IN1')}"
    ahead, slow = rigs = [started(text) for _ in range(2)]
    for rig in rigs:
        rig.wait(0.0203)
        rig.pin("IN1", 1.0)
        rig.wait(0.0504)
        rig.pin("IN2", 1.0)
    ahead.wait(0.8)  # the scheduler advances it to its next change
    for _ in range(800):
        slow.wait(0.001)
    assert ahead.changes("OUT1") == slow.changes("OUT1")
    assert len(ahead.changes("OUT1")) >= 2


@pytest.mark.parametrize(
    ("mode", "expected"), [("RIS", [1, 1, 2, 2]), ("FALL", [0, 1, 1, 2]), ("RIS_FALL", [1, 2, 3, 4]), ("INT_OFF", [0] * 4)]
)
def test_edges_that_interrupt(mode: str, expected: list[int]) -> None:
    rig = started(f"CFGINT_IN3 = {mode}\nWAIT IN9 = ON\nINT_IN3:\n$I0 = $I0 + 1\nRETURN\n")
    counted = []
    for level in (1.0, 0.0, 1.0, 0.0):
        rig.wait(0.05)
        rig.pin("IN3", level)
        rig.wait(0.05)
        counted.append(rig.i(0))
    assert counted == expected


def test_a_pulse_shorter_than_the_filter_does_not_interrupt() -> None:
    rig = started("CFGINT_IN3 = RIS\nWAIT IN9 = ON\nINT_IN3:\n$I0 = $I0 + 1\nRETURN\n")
    rig.wait(0.05)
    rig.pin("IN3", 1.0)
    rig.wait(0.009)
    rig.pin("IN3", 0.0)
    rig.wait(0.1)
    assert rig.i(0) == 0


def test_interrupts_preset_by_the_configuration() -> None:
    inputs = (InputConfig(),) * 11 + (InputConfig(interrupt=2),) + (InputConfig(),) * 8
    rig = programmed("WAIT IN9 = ON\nINT_IN12:\n$I0 = $I0 + 1\nRETURN\n", config=controller(inputs=inputs))
    rig.start()
    for level in (1.0, 0.0):
        rig.pin("IN12", level)
        rig.wait(0.05)
    assert rig.i(0) == 1


def test_a_delay_lasts_where_the_interrupt_that_waited_for_the_handler_is_dropped_from_outside() -> None:
    """As a debugger does that writes CFGINT_IN2, between RETURN and the statement time after it."""
    rig = started(
        "CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nDELAY 1\nOUT8 = ON\nWAIT IN9 = ON\n"
        "INT_IN1:\nDELAY 0.2\nRETURN\nINT_IN2:\n$I1 = $I1 + 1\nRETURN\n"
    )
    rig.wait(0.1)
    rig.pin("IN1", 1.0)
    rig.wait(0.1)
    rig.pin("IN2", 1.0)
    rig.wait(0.05)
    program = rig.device.program
    while program.interpreter.handling:
        rig.wait(0.0001)
    program.set_switch(EVENTS.index(BY_REGISTER["CFGINT_IN2"]), 0, rig.now)
    rig.wait(2.0)
    assert rig.i(1) == 0
    assert [time for time, _ in rig.changes("OUT8")] == [0.003 + 1.0]


def test_wbc_2_interrupts_do_not_nest_and_one_of_each_source_waits() -> None:
    text = (
        "CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nWAIT IN9 = ON\n"
        "INT_IN1:\n$I0 = $I0 + 1\n$I2 = 1\nDELAY 1\n$I2 = 0\nRETURN\n"
        "INT_IN2:\n$I1 = $I1 + 1\n$I3 = $I3 + $I2\nRETURN\n"
    )
    rig = started(text)
    rig.wait(0.01)
    rig.pin("IN1", 1.0)
    rig.wait(0.05)
    for _ in range(3):
        for level in (1.0, 0.0):
            rig.pin("IN2", level)
            rig.pin("IN1", 1.0 - level)
            rig.wait(0.05)
    assert (rig.i(0), rig.i(1)) == (1, 0)
    rig.wait(5.0)
    # One of each waited; IN2's did not come in the middle of IN1's.
    assert (rig.i(0), rig.i(1), rig.i(3)) == (2, 1, 0)


def test_wbc_3_a_jump_in_an_interrupt_lets_others_in_and_may_return_or_leave() -> None:
    text = (
        "CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nMAIN:\nWAIT IN9 = ON\n$I4 = $I4 + 1\nWAIT IN9 = OFF\nJUMP MAIN\n"
        "INT_IN1:\nJUMP SUB\n$I0 = $I0 + 1\nIF IN3 = ON\n    JUMP MAIN\nENDIF\nRETURN\n"
        "INT_IN2:\n$I1 = $I1 + 1\nRETURN\n"
        "SUB:\nDELAY 1\nRETURN\n"
    )
    rig = started(text)
    rig.wait(0.05)
    rig.pin("IN1", 1.0)
    rig.wait(0.5)
    rig.pin("IN2", 1.0)
    rig.wait(0.05)
    assert (rig.i(0), rig.i(1)) == (0, 1)  # in the middle of the subroutine
    rig.wait(1.0)
    assert rig.i(0) == 1
    for n in range(30):  # leaving for good, again and again
        rig.pin("IN3", 1.0)
        rig.pin("IN1", 0.0)
        rig.wait(0.05)
        rig.pin("IN1", 1.0)
        rig.wait(1.1)
        assert rig.i(0) == n + 2
    rig.pin("IN9", 1.0)
    rig.wait(0.1)
    assert (rig.i(4), rig.state) == (1, RUNNING)


def test_ticks_and_modbus_writes_and_drive_states_interrupt() -> None:
    text = (
        "CFGINT_TICK = HIGH\nCFGINT_TICK100 = HIGH\nCFGINT_TICK1000 = HIGH\nCFGINT_MODBUS = HIGH\nCFGINT_M2 = HIGH\n"
        "WAIT IN9 = ON\n"
        "INT_TICK:\n$I0 = $I0 + 1\nRETURN\nINT_TICK100:\n$I1 = $I1 + 1\nRETURN\nINT_TICK1000:\n$I2 = $I2 + 1\nRETURN\n"
        "INT_MODBUS:\n$I3 = $I3 + 1\nRETURN\nINT_M2:\n$I4 = $I4 * 10\n$I4 = $I4 + StatM2\nRETURN\n"
    )
    rig = started(text)
    rig.wait(0.5)
    rig.i(50, 7)
    rig.set("POS_ABS", 5.0, 1)  # no user register
    rig.enable(2)
    rig.wait(0.1)
    rig.set("POS_ABS", 3.0, 2)
    rig.wait(2.445)
    assert [rig.i(n) for n in range(5)] == [304, 30, 3, 1, 134]


# ---------------------------------------------------------------------- pause


@pytest.mark.parametrize("statement", IN_PROGRESS)
@pytest.mark.parametrize("seconds", [0.0, 0.0005, 0.3, 40.0])
def test_wbc_9_a_pause_shifts_every_statement_by_its_length(statement: str, seconds: float) -> None:
    def play(pause_s: float | None) -> Rig:
        rig = started(IN_PROGRESS[statement])
        rig.wait(0.4)
        if pause_s is not None:
            rig.pause()
            assert rig.state == PAUSED
            rig.wait(pause_s)
            assert not rig.changes("OUT8")
            rig.start()
            assert rig.state == RUNNING
        rig.wait(0.3)
        rig.pin("IN2", 1.0)
        rig.wait(3.0)
        return rig

    plain, paused = play(None).changes("OUT8"), play(seconds).changes("OUT8")
    assert len(plain) == len(paused) == (0 if statement == "polling" else 1)
    if statement == "WAITPOS":
        # The drive finishes its move meanwhile.
        assert paused[0][0] == pytest.approx(max(plain[0][0], 0.4 + seconds), abs=0.003)
    elif plain:
        assert paused[0][0] - plain[0][0] == pytest.approx(seconds, abs=0.0011)


def test_wbc_9_drives_finish_their_move_and_outputs_stay() -> None:
    rig = started("M1 = ON\nOUT3 = ON\nPABS M1 40\nDELAY 1\nOUT4 = ON\nWAIT IN9 = ON\n")
    rig.wait(0.2)
    rig.pause()
    assert rig.velocity() > 0.0
    rig.wait(100.0)
    assert (rig.position(), rig.status(), rig.out(3), rig.out(4), rig.state) == (40.0, 4, True, False, PAUSED)
    rig.start()
    rig.wait(0.81)
    assert rig.out(4)


def test_pause_in_an_interrupt_and_interrupts_in_a_pause() -> None:
    rig = started("CFGINT_IN1 = RIS\nWAIT IN9 = ON\nINT_IN1:\n$I0 = $I0 + 1\nDELAY 0.5\n$I1 = $I1 + 1\nRETURN\n")
    rig.wait(0.05)
    rig.pin("IN1", 1.0)
    rig.wait(0.2)
    rig.pause()
    rig.wait(10.0)
    assert (rig.i(0), rig.i(1)) == (1, 0)
    rig.start()
    rig.wait(0.4)
    assert (rig.i(0), rig.i(1)) == (1, 1)
    rig.pause()
    rig.pin("IN1", 0.0)
    rig.wait(0.1)
    rig.pin("IN1", 1.0)
    rig.wait(1.0)
    assert rig.i(0) == 1
    rig.start()
    rig.wait(0.1)
    assert rig.i(0) == 2


def test_pause_without_a_program_and_stop_of_a_pause() -> None:
    rig = programmed("OUT1 = ON\nWAIT IN9 = ON\n")
    rig.pause()
    assert rig.state == STOPPED
    rig.start()
    rig.wait(0.1)
    rig.pause()
    rig.halt()
    assert (rig.state, rig.out(1)) == (STOPPED, False)
    rig.start()
    rig.wait(0.1)
    assert (rig.state, rig.out(1)) == (RUNNING, True)
