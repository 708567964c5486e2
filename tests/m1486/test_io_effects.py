"""User lines, functions, flags and uploads (manual chapters VII.1, VII.3, VII.6, VII.7)."""

from __future__ import annotations

from itertools import pairwise

import pytest
from m1486_rig import Bench

from steptwin.errors import Misuse
from steptwin.m1486.lines import DUAL_DAC, LINES, STEP_DIRECTION, TWO_DACS, Interface
from steptwin.m1486.pins import ALIASES


def outputs(bench: Bench) -> int:
    """Lines 1 to 21 as a number, line 1 = bit 0."""
    return sum(bench.level(f"B{line}") << line - 1 for line in LINES)


ALL_HIGH = (1 << 21) - 1


# ---------------------------------------------------------------------- lines


def test_clear_and_turn_on() -> None:
    bench = Bench()
    assert outputs(bench) == ALL_HIGH
    for line in LINES:
        bench.do(f"c{line}")
        assert outputs(bench) == ALL_HIGH ^ 1 << line - 1
        bench.do(f"T{line}")
        assert outputs(bench) == ALL_HIGH
    assert bench.wrong == []


def test_lines_are_open_drain() -> None:
    bench = Bench()
    bench.pin(B3=0)
    bench.do("c3")
    bench.pin(B3=1)
    assert bench.level("B3") == 0
    bench.pin(B3=0)
    bench.do("t3")
    assert bench.level("B3") == 0
    bench.pin(B3=1)
    assert bench.level("B3") == 1
    assert [(edge.pin, edge.value) for edge in bench.edges] == [("B3", 0.0), ("B3", 1.0)]


def test_edges_tell_the_moment() -> None:
    bench = Bench()
    bench.file("w100", "c2", "w50", "t2")
    bench.finish()
    assert [(edge.time / 1e6, edge.pin, edge.value) for edge in bench.edges] == [(100, "B2", 0.0), (151, "B2", 1.0)]


def test_a_chip_reads_what_it_puts_out() -> None:
    bench = Bench()
    assert bench.do("c2", "i2l1", "@1", "z2", "u20") == b"\x42"


def test_order_puts_the_variable_out() -> None:
    bench = Bench()
    bench.do(":10", "!184")
    assert [bench.level(f"B{line}") for line in (18, 19, 20, 21)] == [0, 1, 0, 1]
    bench.do(":1", "!13")
    assert [bench.level(f"B{line}") for line in (1, 2, 3, 4)] == [1, 0, 0, 1]
    bench.do("?184")
    assert bench.variable == 10


def test_function_59_puts_the_remainder_out() -> None:
    bench = Bench()
    bench.do(":1000", "/7", "!14")
    assert [bench.level(f"B{line}") for line in (1, 2, 3, 4)] == [142 >> bit & 1 for bit in range(4)]
    bench.do("t59", "!14")
    assert [bench.level(f"B{line}") for line in (1, 2, 3, 4)] == [6 >> bit & 1 for bit in range(4)]


@pytest.mark.parametrize("interface", [STEP_DIRECTION, DUAL_DAC, TWO_DACS], ids=lambda i: i.name)
def test_m_21_lines_of_the_driver_interface_are_not_there(interface: Interface) -> None:
    occupied = {STEP_DIRECTION: range(0), DUAL_DAC: range(10, 18), TWO_DACS: range(8, 18)}[interface]
    for command in ("c{}", "t{}", "!{}1", "o{}", "z{}", "){}", "({}"):
        for line in LINES:
            bench = Bench(interface=interface)
            bench.do(command.format(line))
            assert bool(bench.wrong) is (line in occupied), line
            assert not bench.wrong or f"B{line} belongs to the {interface.title} interface" in bench.wrong[0]
    # A group that touches one line of the interface changes none.
    bench = Bench(interface=interface)
    bench.do("!79")
    assert [bench.level(f"B{line}") for line in (7,)] == [1 if occupied else 0]


def test_m_21_a_line_of_the_driver_interface_reads_as_the_interface_drives_it() -> None:
    # At rest on a full step phase 1 is 0 and phase 2 is -127 (θ = 0): D2.0 to D2.6 high, PHASE2 high.
    bench = Bench(interface=TWO_DACS)
    bench.do("?89")
    assert bench.variable == 0b1_1111_1100
    assert bench.do("[", "i17h1", "u20", "@1", "i8l2", "u20", "@2", "u15", "]") == b"\x00"


def test_m_36_uploads_go_no_faster_than_the_line() -> None:
    # 300 bit/s: a character takes 33.3 ms, a pass of the loop 3 ms where nothing waits.
    bench = Bench(baud=300, is_timed=True)
    bench.file("@1", "+1", "u4", "j1")
    sent = bench.run(3.0)
    # The bytes follow each other without a gap, and each is read when its turn has come.
    uploads = bench.events("upload")
    assert {b.time - a.time for a, b in pairwise(uploads)} <= {33_333_333, 33_333_334}
    assert list(sent) == list(range(1, len(sent) + 1))
    assert (len(uploads), bench.variable) == (len(sent) + 1, len(sent) + 2)  # one is on its way, one waits


def test_a_wait_for_a_line_ends_with_the_line() -> None:
    bench = Bench()
    bench.file("o2", "z3", "u20")
    bench.pin(B2=0)
    bench.run(ms=5)
    bench.pin(B2=1)
    assert bench.run(ms=5) == b""
    bench.pin(B3=0)
    bench.pin(B3=1)
    assert bench.run(ms=5) == b"\x42"


# ---------------------------------------------------------------------- flags and functions


def test_flags_are_off_and_can_be_asked() -> None:
    bench = Bench()
    for flag in range(80, 87):
        assert bench.do(f"i{flag}h1", "u14", "@1") == b"\x00"
        assert bench.do(f"T{flag}", "u14", f"C{flag}") == bytes((1 << flag - 80,))
    assert bench.wrong == []


@pytest.mark.parametrize("letter", "TC")
def test_m_44_the_carry_is_not_for_t_and_c(letter: str) -> None:
    bench = Bench()
    bench.send(f"{letter}87")
    assert [text.partition(":")[2].partition(" is ")[0] for text in bench.wrong] == [f" {letter}87"]
    assert not bench.chip.unit.carry


def test_m_22_functions_are_told_lowest_number_first() -> None:
    bench = Bench()
    assert bench.do("u17", "u18", "u19") == b"\x00\xff\x00"
    bench.do("t40", "t47", "c48", "c52", "t59", "t63")
    assert bench.do("u17", "u18", "u19") == bytes((0b1000_0001, 0b1110_1110, 0b1000_1000))


def test_function_40_shows_the_motor_on_line_1() -> None:
    bench = Bench()
    bench.do("c1", "t40")
    assert bench.level("B1") == 1
    bench.do("f64")
    bench.send("r")
    bench.run(ms=3)
    assert bench.level("B1") == 0
    bench.do("t1")
    assert bench.level("B1") == 1
    bench.do("c1")
    assert bench.level("B1") == 1
    bench.do("c40")
    assert bench.level("B1") == 0


# ---------------------------------------------------------------------- uploads


def test_position_and_variable_are_sent_low_byte_first() -> None:
    bench = Bench()
    bench.do(f"={0x123440}", f":{0x56789A}")
    assert bench.do("u1", "U2", "u3", "u4", "u5", "u6") == bytes((0x40, 0x34, 0x12, 0x9A, 0x78, 0x56))


@pytest.mark.parametrize(("kind", "letter"), [("A", 0x41), ("B", 0x42), ("C", 0x43), ("E1", 0x45), ("E2", 0x46), ("E22x", 0x46)])
def test_m_15_type_letters(kind: str, letter: int) -> None:
    assert Bench(kind).do("u20") == bytes((letter,))


@pytest.mark.parametrize(("interface", "code"), [(TWO_DACS, 0), (DUAL_DAC, 1), (STEP_DIRECTION, 2)])
def test_m_15_driver_interface_and_series(interface: Interface, code: int) -> None:
    assert Bench(interface=interface).do("u15", "u16") == bytes((code, 1))


def test_m_32_reserved_bytes_are_0() -> None:
    bench = Bench()
    bench.do("=64000", ":16777215", "t80")
    assert bench.do(*(f"u{n}" for n in range(7, 14))) == bytes(7)


def test_an_upload_waits_its_turn() -> None:
    # Chapter II, Memory: it tells the host that the block before it has been done.
    bench = Bench()
    bench.file("f64000", "r", "u1", "u2")
    assert bench.run(0.5) == b""
    assert bench.finish() == bytes((64_000 & 0xFF, 64_000 >> 8))


# ---------------------------------------------------------------------- pins from outside


def test_pins_have_second_names() -> None:
    for other, name in ALIASES.items():
        bench = Bench()
        bench.chip.set_pin(other.lower(), 0, 0)
        assert bench.level(name) == 0


@pytest.mark.parametrize("pin", ["B0", "B22", "STEP", "BOOST", "X"])
def test_a_pin_that_is_no_input_is_refused(pin: str) -> None:
    with pytest.raises(Misuse, match=f"no input pin '{pin}': inputs are B1 to B21, JOG, LIMIT"):
        Bench().chip.set_pin(pin, 1, 0)


def test_a_level_that_is_none_is_refused() -> None:
    with pytest.raises(Misuse, match=r"B1 = 0\.5: a digital input is 0 or 1"):
        Bench().chip.set_pin("B1", 0.5, 0)
