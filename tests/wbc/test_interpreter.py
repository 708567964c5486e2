"""Programs in execution: statements and when they are executed, calculation, program errors, pause."""

from __future__ import annotations

import struct
from math import cos, radians, sin, sqrt

import pytest
from mic488_rig import PAUSED, RUNNING, STOPPED, Rig, programmed

from steptwin.errors import Misuse
from steptwin.machine import MICROSECOND, MILLISECOND, SECOND
from steptwin.wbc.registers import REAL_MAX


def run(text: str, seconds: float = 1.0, **options: object) -> Rig:
    rig = programmed(text, **options)  # type: ignore[arg-type]
    rig.start()
    rig.wait(seconds)
    return rig


def single(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


# ---------------------------------------------------------------------- calculation


@pytest.mark.parametrize(
    ("expression", "result"),
    [
        ("7 + 0,5", 7.5),
        ("7 - 0.5", 6.5),
        ("7 * -2", -14.0),
        ("7 / 2", 3.5),
        ("7 % 4", 3.0),
        ("-7 % 4", -3.0),
        ("7.5 % 2", 1.5),
        ("6 & 3", 2.0),
        ("6 | 3", 7.0),
        ("2.4 && 3", 1.0),
        ("0.4 && 3", 0.0),
        ("0 || 0.6", 1.0),
        ("0 || 0", 0.0),
        ("3 << 4", 48.0),
        ("48 >> 4", 3.0),
        ("2.5 | 0", 2.0),
        ("min(3, -4)", -4.0),
        ("max(3, -4)", 3.0),
        ("sin(30)", sin(radians(30))),
        ("cos(-120)", cos(radians(120))),
        ("tg(45)", 1.0),
        ("ctg(45)", 1.0),
        ("asin(0.5)", 30.0),
        ("acos(-1)", 180.0),
        ("sqrt(2)", sqrt(2)),
    ],
)
def test_wbc_10_operations_and_functions(expression: str, result: float) -> None:
    rig = run(f"x = {expression}\n$R0 = x\n$R2 = {expression}\nEND\n")
    assert rig.r(0) == rig.r(2) == pytest.approx(result, rel=1e-7)


@pytest.mark.parametrize(
    ("expression", "result"),
    [("1 << 31", -(2**31)), ("1 << 32", 0), ("-1 << -33", -1), ("5 >> -1", 10), ("-8 >> 1", -4), ("1 >> 40", 0)],
)
def test_wbc_22_shifts_are_of_32_bit_integers_with_sign(expression: str, result: int) -> None:
    assert run(f"$D0 = {expression}\nEND\n").d(0) == result


def test_values_are_real_in_variables_registers_and_comparisons() -> None:
    rig = run(
        "x = 0.1\n$R0 = x\nIF $R0 = 0.1\n$I2 = 1\nENDIF\nVmaxM1 = 0.1\nIF VmaxM1 = x\n$I3 = 1\nENDIF\ny = x + 0.2\n$R4 = y\nEND\n"
    )
    assert rig.r(0) == single(0.1)
    assert (rig.i(2), rig.i(3)) == (1, 1)
    assert rig.r(4) == single(single(0.1) + single(0.2))


def test_wbc_21_a_result_beyond_real_is_the_largest_one() -> None:
    big = "1" + "0" * 30
    rig = run(f"x = {big}\nx = x * x\n$R0 = x\ny = -1 * x\ny = y * x\n$R2 = y\n$R4 = x * x\nEND\n")
    assert (rig.r(0), rig.r(2), rig.r(4)) == (REAL_MAX, -REAL_MAX, REAL_MAX)


def test_wbc_4_a_variable_is_0_before_it_is_set_and_again_at_every_start() -> None:
    text = "x = x + 1\n$R0 = x\nIF $R0 > 5\nx = 9\nENDIF\nEND\n"
    rig = run(text)
    rig.start()
    rig.wait(1)
    assert rig.r(0) == 1.0


def test_wbc_14_user_registers_and_outputs_round_and_saturate() -> None:
    rig = run("$I0 = 2.5\n$I1 = 3.5\n$I2 = 40000\n$D4 = -3000000000\nx = 70000\nOUTPUTS = x\nWAIT IN1 = ON\n")
    assert (rig.i(0), rig.i(1), rig.i(2), rig.d(4)) == (2, 4, 32767, -(2**31))
    assert [rig.out(n) for n in range(1, 9)] == [True] * 8


def test_not_a_number_from_a_master_reads_0() -> None:
    rig = programmed("WAIT IN1 = ON\n$R2 = $R0\n$R4 = $R6\nWAIT IN1 = OFF\n")
    rig.start()
    rig.write_words(0, 0, 0x7FC0)
    rig.write_words(6, 0, 0xFF80)
    rig.r(2, 5.0)
    rig.pin("IN1", 1)
    rig.wait(1)
    assert (rig.r(2), rig.r(4)) == (0.0, -REAL_MAX)


# ---------------------------------------------------------------------- order and time


def test_wbc_6_a_statement_takes_a_millisecond() -> None:
    rig = run("OUT1 = ON\nx = 1\nOUT2 = ON\n\n// nothing\nL:\nOUT3 = x\nWAIT IN1 = ON\n")
    assert [(edge.time, edge.pin) for edge in rig.edges] == [
        (1 * MILLISECOND, "OUT1"),
        (3 * MILLISECOND, "OUT2"),
        (4 * MILLISECOND, "OUT3"),
    ]


@pytest.mark.parametrize("time", [MICROSECOND, 250 * MICROSECOND, SECOND])
def test_wbc_6_the_statement_time_is_configurable(time: int) -> None:
    rig = run("x = 1\nOUT1 = ON\nWAIT IN1 = ON\n", 3.0, statement_time=time)
    assert rig.edges[0].time == 2 * time


@pytest.mark.parametrize("time", [-1, 999, SECOND + 1])
def test_wbc_6_other_statement_times_are_refused(time: int) -> None:
    with pytest.raises(Misuse, match=r"statement time = .* ms: permitted are 0 and 0\.001 to 1000 ms"):
        programmed("END\n", statement_time=time)


def test_wbc_24_without_statement_time_a_thousand_statements_take_a_millisecond() -> None:
    rig = programmed("WHILE 1 = 1\nx = x + 1\n$R0 = x\nENDWHILE\n", statement_time=0)
    rig.start()
    rig.wait_ns(1)
    assert rig.r(0) == 250
    rig.wait(0.1)
    assert rig.r(0) == 250 * 101


def test_wbc_24_what_acts_counts_as_twenty() -> None:
    rig = programmed("L:\nOUT1 = ON\nOUT1 = OFF\nJUMP L\n", statement_time=0)
    rig.start()
    rig.wait_ns(MILLISECOND - 1)
    # Two actions and a jump are 41 statements: 24 rounds are 984, and one more action begins before the thousandth.
    assert len(rig.edges) == 2 * 24 + 1
    assert {edge.time for edge in rig.edges} == {0}


def test_wbc_24_without_statement_time_a_long_calculation_goes_on_where_it_was() -> None:
    """5000 rounds of three statements, the look that ends them, and $R0 as the second of the next thousand: 15 ms."""
    rig = programmed("WHILE n < 5000\nn = n + 1\nENDWHILE\n$R0 = n\nOUT1 = ON\nWAIT 1 = 2\n", statement_time=0)
    rig.start()
    rig.wait(0.1)
    assert (rig.r(0), rig.changes("OUT1")) == (5000, [(0.015, 1.0)])


def test_without_statement_time_too_a_program_error_names_its_line() -> None:
    rig = programmed("x = 1\nz = 0\ny = 1 / z\nEND\n", statement_time=0)
    rig.start()
    rig.wait(0.1)
    (event,) = rig.events("program-error")
    assert event.text.startswith("line 3: ")
    assert rig.state == STOPPED


def test_branches() -> None:
    rig = run(
        """
        a = 3
        IF a > 2
            IF a > 5
                $I0 = 1
            ELSE
                $I0 = 2
            ENDIF
        ELSE
            $I0 = 3
        ENDIF
        IF a <= 2
            $I1 = 1
        ELSE
            $I1 = 2
        ENDIF
        WHILE a >= 1
            b = 0
            WHILE b < a
                b = b + 1
                n = n + 1
            ENDWHILE
            a = a - 1
        ENDWHILE
        $I2 = n
        END
        """
    )
    assert (rig.i(0), rig.i(1), rig.i(2), rig.state) == (2, 2, 6, STOPPED)


def test_jump_and_return_nest() -> None:
    inner = "A:\nn = n * 10\nn = n + 1\nJUMP B\nn = n * 10\nn = n + 3\nRETURN\nB:\nn = n * 10\nn = n + 2\nRETURN\n"
    rig = run("JUMP A\n$I0 = n\nEND\n" + inner)
    assert rig.i(0) == 123


@pytest.mark.parametrize("between", ["", "DELAY 0.05", "WAIT TIMA1 >= n", "WHILE TIMA1 < n\nENDWHILE"])
def test_wbc_1_the_stack_keeps_sixteen_and_forgets_the_oldest(between: str) -> None:
    # Twenty JUMPs deep, only the sixteen innermost can return; then the stack is empty.
    # Neither what is waited for in between nor a pause makes it longer.
    rig = programmed(f"L:\nn = n + 1\n{between}\nIF n < 21\nJUMP L\nENDIF\n$I0 = m\nm = m + 1\nRETURN\n")
    rig.start()
    rig.wait(0.0205)
    rig.pause()
    rig.wait(0.1)
    rig.start()
    rig.wait(3)
    assert rig.i(0) == 16
    assert rig.device.program.fault is not None
    assert rig.device.program.fault.text == (
        "RETURN without a JUMP: more than 16 JUMPs without RETURN, so the oldest were forgotten"
    )


def test_wbc_1_a_stack_that_was_full_once_and_empty_since_has_forgotten_nothing() -> None:
    # Seventeen deep, back to the first of the sixteen, left for good by a last RETURN that finds its place, then one too many.
    rig = run("JUMP SUB\nRETURN\nSUB:\nRETURN\n")
    assert rig.device.program.fault is not None
    assert rig.device.program.fault.text == "RETURN without a JUMP"


@pytest.mark.parametrize("depth", [15, 16])
def test_wbc_1_sixteen_places_are_enough_for_sixteen_jumps(depth: int) -> None:
    rig = run(f"L:\nn = n + 1\nIF n <= {depth}\nJUMP L\nENDIF\n$I0 = m\nm = m + 1\nRETURN\n")
    assert rig.i(0) == depth
    assert rig.device.program.fault is not None
    assert rig.device.program.fault.text == "RETURN without a JUMP"


def test_a_jump_to_itself_rests_for_ever() -> None:
    rig = run("OUT1 = ON\nL:\nJUMP L\n", 0.1)
    assert (rig.state, rig.out(1)) == (RUNNING, True)
    assert rig.device.program.deadline() is None, "nothing can end this loop but an event, so nothing is due"


def test_wbc_1_looping_by_jump_goes_on_for_ever() -> None:
    rig = run("M:\nn = n + 1\n$R0 = n\nJUMP M\n", 10.0)
    assert rig.r(0) == 3333
    assert rig.state == RUNNING


def test_the_program_ends_at_end_and_behind_its_last_line() -> None:
    for text in ("M1 = ON\nOUT1 = ON\nEND\nOUT2 = ON\n", "M1 = ON\nOUT1 = ON\n"):
        rig = run(text)
        # Drives and outputs go off.
        assert [(edge.time // MILLISECOND, edge.pin, edge.value) for edge in rig.edges] == [
            (1, "M1_EN", 1.0),
            (2, "OUT1", 1.0),
            (3, "M1_EN", 0.0),
            (3, "OUT1", 0.0),
        ]
        assert (rig.state, rig.m_status, rig.device.deadline()) == (STOPPED, 0, None)
        interpreter = rig.device.program.interpreter
        assert (interpreter.running, interpreter.due) == (False, None)


def test_progreset_starts_again_with_drives_off() -> None:
    rig = run(
        "IF IN1 = ON\nOUT2 = ON\nWAIT IN2 = ON\nENDIF\nM1 = ON\nOUT1 = ON\nx = x + 1\n$I0 = x\nWAIT IN1 = ON\nPROGRESET\n", 0.1
    )
    rig.pin("IN1", 1)
    rig.wait(1)
    assert (rig.status(1), rig.out(1), rig.out(2), rig.i(0), rig.state) == (0, True, True, 1, RUNNING)


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


# ---------------------------------------------------------------------- program errors


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("x = 1 / y", "division by zero"),
        ("x = 1 % y", "remainder of a division by zero"),
        ("y = 2\nx = asin(y)", r"asin\(2\) does not exist"),
        ("y = -1.5\nx = acos(y)", r"acos\(-1.5\) does not exist"),
        ("y = -4\nx = sqrt(y)", r"sqrt\(-4\) does not exist"),
        ("y = 90\nx = tg(y)", r"tg\(90\) does not exist"),
        ("x = ctg(y)", r"ctg\(0\) does not exist"),
        ("AccM1 = y", "AccM1 = 0: permitted are numbers greater than 0"),
        ("y = -1\nTIMA1 = y", "TIMA1 = -1: permitted are numbers 0…999999"),
        ("y = 2\nCFGINT_MODBUS = y", "CFGINT_MODBUS = 2: permitted are numbers 0 or 4"),
        ("PULSE(OUT1, y)", "PULSE"),
        ("y = 3000000000\nPABS M1 y", "PABS M1 = 3000000000 imp: permitted are -2147483648…2147483647 imp"),
        ("RETURN", "RETURN without a JUMP"),
    ],
)
def test_wbc_5_a_program_error_stops_the_program_and_ramps_drives_down(line: str, text: str) -> None:
    rig = programmed(f"y = 0\nM1 = ON\nVABS M1 500\nOUT1 = ON\nDELAY 2\n{line}\nOUT2 = ON\n")
    rig.start()
    rig.wait(2.05)
    control = rig.device.program
    assert (rig.state, rig.m_status, rig.pins()["ERR"]) == (STOPPED, 2, 1.0)
    number = 5 + line.count("\n") + 1
    (event,) = rig.events("program-error")
    assert event.text.startswith(f"line {number}: ")
    assert control.fault is not None
    source = control.banks.programs[0].source
    assert source.position(control.fault.span.start) == (number, 1)
    with pytest.raises(AssertionError, match=text):
        raise AssertionError(control.fault.text)
    # The drive ramps down and stays on, outputs stay.
    assert 0 < rig.velocity(1) < 500
    rig.wait(1)
    assert (rig.velocity(1), rig.status(1), rig.out(1), rig.out(2)) == (0, 1, True, False)
    rig.halt()
    # MIC-31: nothing runs any more, so a stop only clears the error.
    assert (rig.m_status, rig.pins()["ERR"], rig.out(1), rig.status(1)) == (0, 0.0, True, 1)


def test_mic_26_the_next_start_clears_a_program_error() -> None:
    rig = run("IF IN1 = OFF\nx = 1 / x\nENDIF\nWAIT IN2 = ON\n")
    assert rig.m_status == 2
    rig.pin("IN1", 1)
    rig.wait(1)
    rig.start()
    rig.wait(1)
    assert (rig.state, rig.m_status, rig.device.program.fault) == (RUNNING, 0, None)


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
