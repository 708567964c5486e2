"""Programs that wait, and programs in pause."""

from __future__ import annotations

import pytest
from mic488_rig import PAUSED, RUNNING, STOPPED, programmed, run

from steptwin.controller import MILLISECOND, SECOND

# ---------------------------------------------------------------------- waits


def test_wait_looks_on_the_grid_of_statement_times() -> None:
    rig = programmed("WAIT IN1 = ON\nOUT1 = ON\nWAIT IN1 = OFF\n")
    rig.start()
    rig.wait(1.0003)
    rig.pin("IN1", 1)
    rig.wait(1)
    # Filtered 10 ms later; seen at the next whole millisecond, and OUT1 one statement after.
    assert rig.changes("OUT1") == [(1.012, 1.0)]


def test_wbc_18_what_is_true_between_two_looks_only_is_missed() -> None:
    rig = programmed("M1 = ON\nVABS M1 1000\nWAIT PosM1 = 501\nOUT1 = ON\n", statement_time=100 * MILLISECOND)
    rig.start()
    rig.wait(100)
    assert rig.changes("OUT1") == []


@pytest.mark.parametrize(
    ("wait", "seconds"),
    [
        ("PosM1 > 1234.5", 0.002 + 1.735),
        ("VactM1 >= 500", 0.502),
        ("TIMA1 >= 100", 1.0),
        ("TIMB1 = 2", 2.0),
        ("M1 = 0", None),
        ("ENC1 > 100", None),
        ("XENC1 > 800", None),
        ("$I0 = 5", None),
        ("1 = 2", None),
    ],
)
def test_a_wait_costs_nothing_while_it_lasts(wait: str, seconds: float | None) -> None:
    rig = programmed(f"M1 = ON\nVABS M1 1000\nWAIT {wait}\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.0035)
    looks = 0
    while (due := rig.device.deadline()) is not None and due < 100 * SECOND and not rig.out(1):
        rig.wait_ns(due - rig.now)
        looks += 1
    assert looks < 10
    if seconds is not None:
        assert rig.changes("OUT1")[0][0] == pytest.approx(seconds + 0.001, abs=0.0021)


def test_delay_lasts_as_long_as_it_says_and_wbc_7_at_least_ten_milliseconds() -> None:
    rig = run("OUT1 = ON\nDELAY 0.25\nOUT2 = ON\nDELAY 0.001\nOUT3 = ON\nx = -5\nDELAY x\nOUT4 = ON\nWAIT IN1 = ON\n")
    assert [rig.changes(f"OUT{n}") for n in range(1, 5)] == [[(at, 1.0)] for at in (0.001, 0.252, 0.263, 0.275)]


def test_wbc_23_delay_is_of_whole_milliseconds() -> None:
    rig = run("DELAY 0.0204\nOUT1 = ON\nDELAY 0.0206\nOUT2 = ON\nWAIT IN1 = ON\n")
    assert (rig.changes("OUT1"), rig.changes("OUT2")) == ([(0.021, 1.0)], [(0.043, 1.0)])


@pytest.mark.parametrize(
    "loop",
    [
        "WHILE IN1 = OFF\nENDWHILE\n",
        "WHILE IN1 = OFF\nDELAY 0.05\nENDWHILE\n",
        "L:\nIF IN1 = OFF\nJUMP L\nENDIF\n",
        "L:\nJUMP S\nIF IN1 = OFF\nJUMP L\nENDIF\nJUMP DONE\nS:\n$I0 = AIN1\nOUT2 = IN2\nRETURN\nDONE:\n",
        "L:\nIF IN2 = ON\nJUMP L\nENDIF\nIF IN1 = ON\nJUMP DONE\nENDIF\nx = 3 * PosM1\nJUMP L\nDONE:\n",
    ],
)
def test_a_polling_loop_costs_nothing_while_it_finds_nothing(loop: str) -> None:
    rig = programmed(f"{loop}OUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    for _ in range(600):
        due = rig.device.deadline()
        if due is None or due > SECOND:
            break
        rig.wait_ns(due - rig.now)
    due = rig.device.deadline()
    assert due is None or due > 3600 * SECOND
    rig.wait(3000.0)
    rig.pin("IN1", 1)
    rig.wait(0.2)
    assert rig.out(1)


def test_a_loop_that_computes_forgets_nothing() -> None:
    rig = run("WHILE n < 5000\nn = n + 1\nENDWHILE\n$R0 = n\nOUT1 = ON\nWAIT IN1 = ON\n", 16.0)
    assert rig.r(0) == 5000
    # 5000 rounds of three, the last look, $R0, OUT1.
    assert rig.changes("OUT1") == [(15.003, 1.0)]


def test_timers_count_up_and_stop_at_999999() -> None:
    rig = run("TIMB2 = 999998\nTIMA1 = 10\nDELAY 5\n$D0 = TIMB2\n$I2 = TIMA1\n$I3 = TIMA16\nWAIT IN1 = ON\n", 6)
    assert (rig.d(0), rig.i(2), rig.i(3)) == (999_999, 510, 500)


def test_pulse_inverts_an_output_later_and_does_not_wait() -> None:
    rig = run("OUT1 = ON\nPULSE(OUT1, 0.5)\nOUT2 = ON\nPULSE(OUT3, 0.1)\nWAIT IN1 = ON\n")
    assert rig.changes("OUT1") == [(0.001, 1.0), (0.502, 0.0)]
    assert rig.changes("OUT2") == [(0.003, 1.0)]
    assert rig.changes("OUT3") == [(0.104, 1.0)]


# ---------------------------------------------------------------------- pause


@pytest.mark.parametrize(
    ("statement", "before", "after"),
    [
        ("DELAY 1", 0.5, 0.6),
        ("WAIT TIMA1 >= 1000", 0.5, 10.0),
        ("WAITPOS", 0.5, 2.0),
        ("WAIT IN1 = ON", 0.5, 0.1),
        ("WHILE IN1 = OFF\nENDWHILE", 0.5, 0.1),
        ("WHILE TIMA1 < 300\nDELAY 0.1\nENDWHILE", 0.5, 3.2),
        ("WHILE n < 400\nn = n + 1\nENDWHILE", 0.5, 0.8),
    ],
)
def test_wbc_9_pause_in_every_kind_of_statement(statement: str, before: float, after: float) -> None:
    rig = programmed(f"M1 = ON\nPREL M1 300\n{statement}\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(before)
    rig.pause()
    assert rig.state == PAUSED
    if "IN1" in statement:
        rig.pin("IN1", 1)
    due = rig.device.deadline()
    assert due is None or due > rig.now + 1
    rig.wait(7.0)
    # The drive has finished its move.
    assert (rig.position(1), rig.status(1), rig.out(1)) == (300, 4, False)
    rig.start()
    assert rig.state == RUNNING
    rig.wait(after)
    assert rig.out(1)


def test_wbc_9_a_delay_is_as_much_later_as_the_pause_was_long() -> None:
    rig = programmed("DELAY 1\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.4)
    rig.pause()
    rig.wait(5)
    rig.pause()
    rig.start()
    rig.start()
    rig.wait(2)
    assert rig.changes("OUT1") == [(6.001, 1.0)]


def test_without_statement_time_a_wait_ends_at_the_moment_of_its_input() -> None:
    """Which a digital filter delays by 10 ms."""
    rig = programmed("WAIT IN1 = ON\nOUT1 = ON\nWAIT 1 = 2\n", statement_time=0)
    rig.start()
    rig.wait_ns(12_345_678)
    rig.pin("IN1", 1)
    rig.wait(1.0)
    assert rig.changes("OUT1") == [(0.022345678, 1.0)]


def test_a_paused_program_can_be_stopped_and_a_stopped_one_not_paused() -> None:
    rig = run("OUT1 = ON\nWAIT IN1 = ON\n", 0.1)
    rig.pause()
    rig.halt()
    assert (rig.state, rig.out(1)) == (STOPPED, False)
    rig.pause()
    assert (rig.state, rig.device.program.statement(rig.device.now)) == (STOPPED, None)


def test_where_a_program_stands_can_be_seen() -> None:
    rig = run("OUT1 = ON\nWAIT IN1 = ON\nWHILE IN1 = ON\nOUT2 = IN2\nENDWHILE\nDELAY 1\nEND\n", 0.1)
    source = rig.device.program.banks.programs[0].source

    def line() -> int:
        span = rig.device.program.statement(rig.device.now)
        assert span is not None
        return source.position(span.start)[0]

    assert line() == 2
    rig.pin("IN1", 1)
    rig.wait(60)
    # Resting in the loop, it is seen to go round.
    seen = []
    for _ in range(6):
        seen.append(line())
        rig.wait(0.001)
    assert seen == [*seen[:3]] * 2
    assert sorted(seen[:3]) == [3, 4, 5]
    rig.pin("IN1", 0)
    rig.wait(0.1)
    assert line() == 6
    rig.pause()
    rig.wait(10)
    assert line() == 6
