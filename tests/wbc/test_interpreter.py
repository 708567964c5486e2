"""Programs in execution: statements and when they are executed, calculation, program errors, pause."""

from __future__ import annotations

import struct
from math import cos, radians, sin, sqrt

import pytest
from mic488_rig import RUNNING, STOPPED, programmed, run

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.wbc.registers import REAL_MAX


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


def test_a_record_of_unknown_meaning_ends_the_program() -> None:
    rig = run(f"OUT1 = ON\n//!record FF{'00' * 15}\nOUT2 = ON\n")
    fault = rig.device.program.fault
    assert fault is not None
    assert "unknown instruction" in fault.text
    assert not rig.out(2)


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


def test_wbc_1_before_the_first_jump_nothing_has_been_forgotten() -> None:
    rig = run("RETURN\n")
    assert rig.device.program.fault is not None
    assert rig.device.program.fault.text == "RETURN without a JUMP"


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
        ("y = 35\nM1 = y", "M1 = 35: permitted are numbers 0 or 1; PABS M1 and PREL M1 move it"),
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
