"""Interrupts: what can interrupt a program, when, and how it goes on."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mic488_rig import RUNNING, Rig, programmed

from steptwin.controller import MILLISECOND
from steptwin.mic488.config import ControllerConfig, InputConfig

FILTER = 0.010
"""Default filter of inputs."""


def started(text: str, config: ControllerConfig | None = None, firmware: str = "1.70") -> Rig:
    rig = programmed(text, "P;100;0;x;x\n", config, firmware)
    rig.start()
    return rig


def pulse(rig: Rig, pin: str, seconds: float = 0.05) -> None:
    rig.pin(pin, 1)
    rig.wait(seconds)
    rig.pin(pin, 0)
    rig.wait(seconds)


COUNTING = "n = n + 1\n$I0 = n\nRETURN\n"


@pytest.mark.parametrize(("mode", "counts"), [("OFF", 0), ("RIS", 3), ("FALL", 3), ("RIS_FALL", 6)])
def test_edges_of_an_input(mode: str, counts: int) -> None:
    rig = started(f"CFGINT_IN2 = {mode}\nWAIT 1 = 2\nINT_IN2:\n{COUNTING}")
    rig.wait(0.1)
    for _ in range(3):
        pulse(rig, "IN2")
    pulse(rig, "IN3")
    assert rig.i(0) == counts


def test_inputs_can_be_preset_by_the_configuration_also_those_without_a_register() -> None:
    inputs = tuple(InputConfig(interrupt=3 if n == 14 else 0) for n in range(20))
    rig = started(f"WAIT 1 = 2\nINT_IN15:\n{COUNTING}", replace(ControllerConfig(), inputs=inputs))
    rig.wait(0.1)
    pulse(rig, "IN15")
    assert rig.i(0) == 2


def test_a_handler_begins_with_the_edge_and_takes_its_statements() -> None:
    rig = started("CFGINT_IN1 = RIS\nWAIT 1 = 2\nINT_IN1:\nOUT1 = ON\nRETURN\n")
    rig.wait(0.1003)
    rig.pin("IN1", 1)
    rig.wait(0.1)
    # The label is executed when the filter lets the edge through, and a statement time later the line after it.
    assert rig.changes("OUT1") == [(0.1003 + FILTER + 0.001, 1.0)]


def test_wbc_2_interrupts_do_not_nest_and_one_of_each_source_waits() -> None:
    rig = started(
        f"CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nWAIT 1 = 2\nINT_IN1:\nOUT1 = ON\nDELAY 1\nOUT1 = OFF\nRETURN\nINT_IN2:\n{COUNTING}"
    )
    rig.wait(0.1)
    for _ in range(4):
        pulse(rig, "IN2") if rig.out(1) else pulse(rig, "IN1")
    assert rig.i(0) == 0
    rig.wait(2)
    assert rig.i(0) == 1


def test_a_handler_that_follows_itself_is_no_further_round_of_a_loop() -> None:
    """It comes to the same statement in the same state, but nothing waits any more."""
    rig = started(
        "CFGINT_IN1 = RIS_FALL\nDELAY 1\nOUT1 = ON\nWAIT 1 = 2\n"
        "INT_IN1:\nDELAY 0.2\nx = 0\nWHILE x < 1\nx = 1\nENDWHILE\nRETURN\n"
    )
    rig.wait(0.1)
    pulse(rig, "IN1")
    rig.wait(1)
    assert rig.out(1)


@pytest.mark.parametrize("order", [("IN5", "IN2", "IN4"), ("IN2", "IN4", "IN5"), ("IN4", "IN5", "IN2")])
def test_wbc_41_interrupts_that_wait_are_served_by_number(order: tuple[str, ...]) -> None:
    handlers = "".join(f"INT_IN{n}:\nn = n * 10\nn = n + {n}\n$I0 = n\nRETURN\n" for n in (4, 5, 2))
    enabled = "".join(f"CFGINT_IN{n} = RIS\n" for n in (2, 3, 4, 5))
    rig = started(f"{enabled}WAIT 1 = 2\nINT_IN3:\nDELAY 1\nRETURN\n{handlers}")
    rig.wait(0.1)
    for pin in ("IN3", *order):
        pulse(rig, pin)
    rig.wait(2)
    assert rig.i(0) == 245


def test_wbc_9_a_pause_in_a_handler_keeps_the_rest_of_the_delay_it_interrupted() -> None:
    rig = started("CFGINT_IN1 = RIS\nDELAY 3\nOUT1 = ON\nWAIT 1 = 2\nINT_IN1:\nDELAY 1\nRETURN\n")
    rig.wait(0.5)
    pulse(rig, "IN1")
    rig.pause()
    rig.wait(10)
    rig.start()
    rig.wait(5)
    # The DELAY is executed at 2 ms, and the pause takes ten seconds.
    assert rig.changes("OUT1") == [(13.002, 1.0)]


def test_wbc_3_a_jump_in_a_handler_lets_interrupts_in_and_returns_come_back() -> None:
    rig = started(
        f"CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nDELAY 3\nOUT3 = ON\nWAIT 1 = 2\n"
        f"INT_IN1:\nJUMP SUB\nOUT2 = ON\nRETURN\nSUB:\nOUT1 = ON\nDELAY 1\nRETURN\nINT_IN2:\n{COUNTING}"
    )
    rig.wait(0.1)
    pulse(rig, "IN1")
    assert rig.out(1)
    pulse(rig, "IN2")
    assert rig.i(0) == 1
    rig.wait(1)
    assert rig.out(2)
    # The delay that was interrupted ends when it would have (WBC-19).
    assert not rig.out(3)
    rig.wait(2)
    assert rig.changes("OUT3") == [(3.003, 1.0)]


@pytest.mark.parametrize("statement_time", [0, MILLISECOND])
@pytest.mark.parametrize(
    ("main", "handler"),
    [
        ("WAIT 1 = 2\n", "JUMP SUB\nRETURN\nSUB:\n$I2 = $I0\nRETURN\n"),
        ("WHILE IN3 = OFF\nENDWHILE\n$I2 = $I0\nWAIT 1 = 2\n", "RETURN\n"),
    ],
)
def test_wbc_3_what_waits_is_served_before_the_next_line_when_a_handler_ends_or_jumps(
    main: str, handler: str, statement_time: int
) -> None:
    rig = programmed(
        f"CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\n{main}INT_IN1:\nDELAY 1\n{handler}INT_IN2:\n$I0 = 7\nRETURN\n",
        statement_time=statement_time,
    )
    rig.start()
    rig.wait(0.1)
    pulse(rig, "IN1")
    pulse(rig, "IN2")
    rig.pin("IN3", 1)
    rig.wait(0.1)
    assert rig.i(0) == 0
    rig.wait(2)
    assert (rig.i(0), rig.i(2)) == (7, 7)


def test_wbc_3_a_handler_may_leave_for_good() -> None:
    rig = started("CFGINT_IN1 = RIS\nMAIN:\nn = n + 1\n$I0 = n\nWAIT 1 = 2\nINT_IN1:\nIF IN2 = ON\nRETURN\nENDIF\nJUMP MAIN\n")
    rig.wait(0.1)
    for _ in range(40):
        pulse(rig, "IN1")
    assert (rig.i(0), rig.state) == (41, RUNNING)
    rig.pin("IN2", 1)
    pulse(rig, "IN1")
    assert rig.i(0) == 41


@pytest.mark.parametrize(
    "statement",
    ["WAIT IN3 = ON", "WHILE IN3 = OFF\nENDWHILE", "WHILE IN3 = OFF\nDELAY 0.03\nENDWHILE", "L:\nIF IN3 = OFF\nJUMP L\nENDIF"],
)
def test_wbc_19_what_was_interrupted_goes_on(statement: str) -> None:
    rig = started(f"CFGINT_IN1 = RIS\n{statement}\nOUT1 = ON\nWAIT 1 = 2\nINT_IN1:\nDELAY 0.2\n{COUNTING}")
    rig.wait(1)
    pulse(rig, "IN1")
    pulse(rig, "IN3", 0.05)
    # What it waited for came and went during the interrupt.
    rig.wait(1)
    assert (rig.i(0), rig.out(1)) == (1, False)
    pulse(rig, "IN3", 0.05)
    assert rig.out(1)


def test_wbc_19_a_delay_of_a_polling_loop_ends_when_it_would_have() -> None:
    ends = []
    for interrupted in (False, True):
        rig = started(f"CFGINT_IN2 = RIS\nWHILE IN1 = OFF\nDELAY 1\nENDWHILE\nOUT1 = ON\nWAIT 1 = 2\nINT_IN2:\n{COUNTING}")
        rig.wait(20.4)
        rig.pin("IN2", float(interrupted))
        rig.wait(0.1)
        rig.pin("IN1", 1)
        rig.wait(2)
        assert rig.i(0) == interrupted
        ends.append(rig.changes("OUT1"))
    assert ends[0] == ends[1]
    assert len(ends[0]) == 1


def test_wbc_19_a_motion_goes_on_during_an_interrupt_and_waitpos_looks_again() -> None:
    rig = started("CFGINT_IN1 = RIS\nM1 = ON\nPABS M1 1000\nWAITPOS\nOUT1 = ON\nWAIT 1 = 2\nINT_IN1:\nDELAY 5\nRETURN\n")
    rig.wait(0.5)
    pulse(rig, "IN1")
    rig.wait(3)
    assert (rig.position(1), rig.out(1)) == (1000, False)
    rig.wait(3)
    ((moment, _),) = rig.changes("OUT1")
    # DELAY, RETURN, WAITPOS, OUT1 follow each other.
    assert moment == pytest.approx(0.5 + FILTER + 0.001 + 5.0 + 0.001 + 0.001)


@pytest.mark.parametrize(
    ("statement", "ends"), [("DELAY 1", 1.003), ("WAIT TIMA1 > 100", 1.011), ("PABS M1 500\nWAITPOS", 1.417), ("x = 1", 0.0)]
)
def test_hardint_comes_when_the_statement_in_progress_has_ended(statement: str, ends: float) -> None:
    rig = started(f"M1 = ON\nCFGINT_IN1 = RIS\n{statement}\nx = 2\nWHILE 1 = 1\nENDWHILE\nHARDINT_IN1:\nOUT1 = ON\nRETURN\n")
    rig.wait(0.2)
    rig.pin("IN1", 1)
    rig.wait(3)
    ((moment, _),) = rig.changes("OUT1")
    assert moment == pytest.approx(max(ends, 0.2 + FILTER) + 0.002, abs=0.003)


def test_hardint_ends_the_rest_of_a_loop() -> None:
    rig = started(f"CFGINT_TICK1000 = HIGH\nWHILE IN1 = OFF\nENDWHILE\nHARDINT_TICK1000:\n{COUNTING}")
    rig.wait(10.5)
    assert rig.i(0) == 10


@pytest.mark.parametrize(("tick", "firmware", "period"), [("", "1.23", 0.01), ("100", "1.70", 0.1), ("1000", "1.70", 1.0)])
def test_wbc_20_ticks(tick: str, firmware: str, period: float) -> None:
    rig = started(f"CFGINT_TICK{tick} = HIGH\nWAIT 1 = 2\nINT_TICK{tick}:\n{COUNTING}", firmware=firmware)
    rig.wait(20.5 * period)
    assert rig.i(0) == 20


def test_ticks_stop_when_switched_off_and_while_paused() -> None:
    rig = started(f"CFGINT_TICK100 = HIGH\nWAIT IN1 = ON\nCFGINT_TICK100 = OFF\nWAIT 1 = 2\nINT_TICK100:\n{COUNTING}")
    rig.wait(1.05)
    rig.pause()
    rig.wait(10)
    assert rig.device.deadline() is None
    rig.start()
    rig.wait(1)
    assert rig.i(0) == 20
    rig.pin("IN1", 1)
    rig.wait(10)
    assert rig.i(0) == 20


def test_writes_of_a_master_to_user_registers() -> None:
    rig = started("CFGINT_MODBUS = INT_HIGH\nWAIT 1 = 2\nINT_MODBUS:\n$I1 = $I0 * 2\n$I2 = $I2 + 1\nRETURN\n")
    rig.wait(0.1)
    rig.i(0, 21)
    rig.wait(0.003)
    assert (rig.i(1), rig.i(2)) == (42, 1)
    rig.set("VMAX", 77.0)
    rig.word("PROG_BANK_SEL", 1)
    rig.wait(0.1)
    assert rig.i(2) == 1


def test_changes_of_a_drives_state() -> None:
    main = "CFGINT_M2 = INT_HIGH\nM1 = ON\nPABS M1 10\nM2 = ON\nDELAY 0.1\nPABS M2 50\nWAIT 1 = 2\n"
    rig = started(f"{main}INT_M2:\n{COUNTING}")
    rig.wait(0.05)
    assert rig.i(0) == 1
    rig.wait(5)
    assert (rig.i(0), rig.status(2)) == (3, 4)
    rig.word("M_DISABLE", 2)
    rig.wait(0.01)
    assert rig.i(0) == 4


def test_what_waits_is_forgotten_when_its_interrupt_is_switched_off() -> None:
    rig = started(
        f"CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nWAIT 1 = 2\nINT_IN1:\nDELAY 1\nCFGINT_IN2 = OFF\nRETURN\nINT_IN2:\n{COUNTING}"
    )
    rig.wait(0.1)
    pulse(rig, "IN1")
    pulse(rig, "IN2")
    rig.wait(3)
    assert rig.i(0) == 0


def test_an_event_during_a_pause_comes_when_the_program_goes_on() -> None:
    rig = started(f"CFGINT_IN1 = RIS\nWAIT 1 = 2\nINT_IN1:\n{COUNTING}")
    rig.wait(0.1)
    rig.pause()
    pulse(rig, "IN1")
    pulse(rig, "IN1")
    assert rig.i(0) == 0
    rig.start()
    rig.wait(0.1)
    assert rig.i(0) == 1


def test_an_interrupt_without_statement_time_is_served_at_its_moment() -> None:
    rig = programmed("CFGINT_IN1 = RIS\nWHILE 1 = 1\nn = n + 1\nENDWHILE\nINT_IN1:\nOUT1 = ON\nRETURN\n", statement_time=0)
    rig.start()
    rig.wait(0.0205)
    rig.pin("IN1", 1)
    rig.wait(0.1)
    assert rig.changes("OUT1") == [(0.0205 + FILTER, 1.0)]
