"""The numeric unit (manual chapter VII.7): internal variable, carry, registers, where operands come from."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.m1486.commands import DIVIDEND_LIMIT, FREE_DIVISORS

words = st.integers(0, 2**24 - 1) | st.sampled_from([0, 1, 254, 255, 256, 65_000, 65_001, 2**24 - 255, 2**24 - 1])


def reckon(variable: int, operator: str, operand: int) -> tuple[int, bool | None, int | None]:
    """Variable, carry and remainder as the manual words them; None: as they were."""
    if operator == "+":
        return (variable + operand) % 2**24, variable + operand >= 2**24, None
    if operator == "-":
        return (variable - operand) % 2**24, operand > variable, None
    if operator == "*":
        return variable * operand % 2**24, None, None
    return variable // operand, None, variable % operand


@given(words, st.sampled_from("+-*/"), st.integers(1, 255) | st.sampled_from(sorted(FREE_DIVISORS)))
def test_m_13_arithmetic(variable: int, operator: str, operand: int) -> None:
    bench = Bench(statement_ns=0)
    bench.do(f":{variable}", f"{operator}{operand}")
    if operator == "/" and variable > DIVIDEND_LIMIT and operand not in FREE_DIVISORS:
        assert "at most 65000 can be divided" in bench.wrong[0]
        assert bench.variable == variable
        return
    result, carry, remainder = reckon(variable, operator, operand)
    assert bench.variable == result
    assert bench.chip.unit.carry is (carry or False)
    assert bench.do("<10", "u4", "u14") == bytes((remainder or 0, 0x80 if carry else 0))


def test_multiplication_and_division_leave_the_carry_alone() -> None:
    bench = Bench()
    bench.do("-1", "*2", "/2")
    assert bench.chip.unit.carry
    bench.do("+1")
    assert not bench.chip.unit.carry


def test_the_manuals_compare() -> None:
    # Chapter VII.6, Carry flag: R is only executed if lines 1 to 4 read 10 or more.
    for value in (9, 10, 15):
        bench = Bench()
        bench.pin(**{f"B{line}": value >> line - 1 & 1 for line in range(1, 5)})
        bench.file("@5", "?14", "-10", "i87H5", "r")
        bench.run(ms=100)
        assert bool(bench.events("moves")) is (value >= 10)


# ---------------------------------------------------------------------- registers


def test_the_carry_is_set_from_2_to_the_24_on() -> None:
    bench = Bench()
    bench.do(":16777214", "+1")
    assert (bench.variable, bench.chip.unit.carry) == (2**24 - 1, False)
    bench.do("+1")
    assert (bench.variable, bench.chip.unit.carry) == (0, True)
    bench.do(":5", "-5")
    assert (bench.variable, bench.chip.unit.carry) == (0, False)


@pytest.mark.parametrize("kind", ["A", "B", "C", "E1"])
def test_registers_1_to_8_keep_16_bits(kind: str) -> None:
    bench = Bench(kind)
    for register in range(1, 9):
        bench.do(f":{0x12300 + register}", f">{register}")
    for register in range(1, 9):
        bench.do(f"<{register}")
        assert bench.variable == 0x2300 + register


def test_register_9_is_the_position_counter_and_register_10_the_remainder() -> None:
    bench = Bench()
    bench.do(":66", ">9", "f64", "r")
    assert bench.counter == 130
    bench.do("<9")
    assert bench.variable == 130
    bench.do(":1000", "/7", "<10")
    assert bench.variable == 6
    bench.do(":513", ">10", ":0", "<10")
    assert bench.variable == 1


def test_function_58_takes_the_operand_from_a_register() -> None:
    # The manual's example, and 16 bits for + and -, the low byte for * and /.
    bench = Bench()
    bench.do(":5000", ">5", ":100", "T58", "+5", "C58", "*2")
    assert bench.variable == 10_200
    for command, result in (("+3", 1000 + 0x0207), ("-3", 1000 - 0x0207), ("*3", 7000), ("/3", 142)):
        bench.do("c58", f":{0x0207}", ">3", ":1000", "t58", command)
        assert bench.variable == result


@pytest.mark.parametrize("command", ["+9", "-10", "*9", "/10", "+200"])
def test_registers_9_and_10_are_no_operands(command: str) -> None:
    bench = Bench()
    bench.do(":7", "t58", command)
    assert "operand register, and function 58 is ON" in bench.wrong[0]
    assert bench.variable == 7


def test_a_register_of_0_divides_nothing() -> None:
    bench = Bench()
    bench.do(":7", "t58", "/1")
    assert "division by 0" in bench.wrong[0]
    assert bench.variable == 7


# ---------------------------------------------------------------------- operands from lines


def test_function_46_reads_the_operand_from_lines() -> None:
    # Chapter VII.7, example 2 of Divide: two BCD digits, 74.
    bench = Bench(address=0)
    bench.pin(B1=1, B2=1, B3=1, B4=0, B18=0, B19=0, B20=1, B21=0)
    bench.file("?14", "*10", "t46", "+184", "a")
    bench.finish()
    assert bench.variable == 74
    assert bench.chip.drive.acceleration == 74
    assert bench.wrong == []


def test_function_46_with_a_number_that_names_no_lines_is_wrong_data() -> None:
    bench = Bench()
    bench.do(":7", "t46", "+5")
    assert "5 names no lines" in bench.wrong[0]


def test_nine_lines_divide_and_the_remainder_keeps_eight_bits() -> None:
    bench = Bench()
    bench.do(":64000", "t46", "/19")
    assert (bench.variable, bench.chip.unit.remainder) == (64_000 // 511, 64_000 % 511 & 0xFF)


def test_m_14_lines_go_before_registers() -> None:
    bench = Bench()
    bench.do(":5", ">12", ":1", ">1", "t46", "t58", ":0", "+12")
    assert bench.variable == 3
    bench.do("c46")
    bench.do(":0", "+1")
    assert bench.variable == 1


def test_function_47_inverts_what_is_read() -> None:
    bench = Bench()
    bench.pin(B1=0, B3=0)
    bench.do("?14")
    assert bench.variable == 0b1010
    bench.do("t47", "?14")
    assert bench.variable == 0b0101
    bench.do(":0", "t46", "+14")
    assert bench.variable == 0b0101
    # Conditions and waits look at the lines themselves.
    assert bench.do("i1h9", "o2", "z1", "u20") == b"\x42"


def test_the_variable_is_the_number_of_a_command_without_one() -> None:
    # Chapter VII.7, example 1 of Multiply.
    bench = Bench()
    bench.do(":32", "*200", "F", "r")
    assert bench.counter == 6400
