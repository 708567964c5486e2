"""Functions, registers, lines and microsteps against the manual (chapters VI, VII.2, VII.4, VII.6, VII.7)."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.m1486 import functions, lines, microsteps, registers
from steptwin.m1486.lines import SHARED_PINS
from steptwin.m1486.pins import ALIASES


def test_functions_have_the_names_and_defaults_of_the_manual() -> None:
    named = {f.number: f.name for f in functions.TABLE if f.name}
    assert named == {
        40: "Runsign", 41: "Return", 42: "Limitoff", 43: "Edge", 44: "Continue", 45: "Outputs", 46: "Input", 47: "Complement",
        50: "Fullstep", 51: "Recover", 52: "Fullstepss", 57: "Report", 58: "Register", 59: "Remainder",
    }  # fmt: skip
    assert [f.number for f in functions.TABLE] == list(range(40, 64))
    assert [f.number for f in functions.TABLE if f.default] == list(range(48, 56))
    assert [n for n in range(40, 64) if functions.is_reserved(n)] == [48, 49, 53, 54, 55, 56, 60, 61, 62, 63]


def test_registers_9_and_10_are_no_operands() -> None:
    assert [(r.number, r.bits, r.is_operand) for r in registers.REGISTERS] == [
        *((n, 16, True) for n in range(1, 9)), (9, 24, False), (10, 8, False),
    ]  # fmt: skip


def test_bytes_with_a_meaning() -> None:
    assert sorted(registers.UPLOADS) == [1, 2, 3, 4, 5, 6, 14, 15, 16, 17, 18, 19, 20]


def test_driver_interfaces_take_lines() -> None:
    occupied = {i.name: list(i.occupied) for i in lines.INTERFACES}
    assert occupied == {"sd": [], "dual": list(range(10, 18)), "two": list(range(8, 18))}
    assert {i.name: i.microstep for i in lines.INTERFACES} == {"sd": 1, "dual": 4, "two": 4}


def test_m_15_code_of_the_driver_interface() -> None:
    assert {i.name: i.code for i in lines.INTERFACES} == {"two": 0, "dual": 1, "sd": 2}


def test_an_unknown_interface_is_refused_with_the_known_ones() -> None:
    assert lines.interface("Dual") is lines.DUAL_DAC
    with pytest.raises(Misuse, match="'dac'; there are sd, dual, two"):
        lines.interface("dac")


def test_lines_that_end_a_seek_low_and_high() -> None:
    high = [line for line in lines.LINES if line not in lines.SEEK_ENDS_LOW]
    assert high == [4, 5, 6, 7, 12, 13, 14, 15, 20, 21]


def test_pairs_of_microsteps() -> None:
    assert microsteps.PAIRS == {1: (1,), 2: (2,), 4: (1, 4), 8: (1, 2), 16: (4,), 32: (1, 2, 4), 64: (1, 2, 4)}


@pytest.mark.parametrize(("microstep", "size", "limit"), [(1, 64, 12_000), (4, 16, 3_000), (64, 1, 187.5)])
def test_size_and_speed_limit_of_a_microstep(microstep: int, size: int, limit: float) -> None:
    assert microsteps.microstep_size(microstep) == size
    assert microsteps.low_range_limit(microstep) == limit


def test_pins_of_lines_that_are_something_else_besides() -> None:
    """Chapter VI: BR0, BR1 and ADDR0 to ADDR3 are read when RST goes high, JOG DIRECTION whenever JOG does."""
    assert {line: text.partition(",")[0] for line, text in SHARED_PINS.items()} == {
        5: "BR0",
        6: "BR1",
        7: "JOG DIRECTION",
        18: "ADDR0",
        19: "ADDR1",
        20: "ADDR2",
        21: "ADDR3",
    }
    assert {ALIASES[text.partition(",")[0]] for text in SHARED_PINS.values()} == {f"B{line}" for line in SHARED_PINS}
