"""What a world reads of a chip without a command, against what the chip itself would send (chapters VII.1 Upload and VII.7)."""

from __future__ import annotations

from itertools import islice

import pytest
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.points import POINTS, live_point
from steptwin.points import LivePoint


def point(bench: Bench, name: str) -> LivePoint:
    found = live_point(bench.chip, name)
    assert found is not None
    return found


def value(bench: Bench, name: str) -> float:
    read = point(bench, name).read
    assert read is not None
    return read(bench.now)


def turning_points(bench: Bench, name: str, most: int) -> list[int]:
    """The next moments at which the value may turn."""
    found = point(bench, name).turning_points
    assert found is not None
    return list(islice(found(bench.now), most))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("position", 70_400),
        ("Velocity", 0),
        ("counter", 70_400),
        ("moving", 0),
        ("room", 1),
        ("variable", 0x0A0B0C // 8),
        ("register3", 513),
        ("register4", 0),
        ("register9", 70_400),
        ("register10", 0x0A0B0C % 8),
        # 70 400 is 01 13 00H; the variable is 01 41 61H.
        ("U1", 0x00),
        ("u2", 0x13),
        ("U3", 0x01),
        ("U4", 0x61),
        ("U5", 0x41),
        ("U6", 0x01),
        ("U14", 0b10_0001),
        ("U15", 2),
        ("U16", 1),
        ("U17", 0b1000),
        ("U18", 0xFF),
        ("U19", 0b10),
        ("U20", 0x42),
    ],
)
def test_values_after_a_program(name: str, expected: int) -> None:
    """Functions 48 to 55 are ON at power-on, lowest number = lowest bit (M-22)."""
    bench = Bench("B")
    bench.do("t80", "t85", "t43", "t57", ":513", ">3", ":658188", "/8", "f70400", "r")
    assert value(bench, name) == expected


def test_every_point_is_found_in_either_case_and_no_other() -> None:
    chip = M1486Chip(Bench("B").chip.variant)
    assert all(live_point(chip, path) is not None for path in POINTS)
    assert live_point(chip, "register11") is live_point(chip, "U7") is live_point(chip, "") is None


def test_values_on_the_way() -> None:
    """A move of 40 full steps at 80 full steps a second, with no ramp at V not above S (M-8); the counter has its end (M-16)."""
    bench = Bench("B")
    bench.do("=64", "s200", "v80", "f2560")
    before = point(bench, "position").version
    assert before is not None
    at_rest = before()
    bench.send("r")
    bench.run(ms=100)
    assert value(bench, "moving") == 1
    assert value(bench, "velocity") == 80 * 64
    assert 0 < value(bench, "position") < 2560
    assert before() != at_rest
    begin = bench.trains[-1][1].profile.start
    for name in ("position", "velocity"):
        assert turning_points(bench, name, 5) == [begin + SECOND // 2]


@pytest.mark.parametrize(
    ("name", "start", "way", "ends"),
    [
        ("U1", 2**8 - 64, "g+", (0xFF, 0)),
        ("U2", 2**16 - 64, "g+", (0xFF, 0)),
        # = takes no more than 16 000 000: downwards it is nearer.
        ("U3", 64, "g-", (0, 0xFF)),
        ("counter", 64, "g-", (0, 2**24 - 1)),
        ("register9", 64, "g-", (0, 2**24 - 1)),
    ],
)
def test_a_count_turns_where_it_begins_anew(name: str, start: int, way: str, ends: tuple[int, int]) -> None:
    bench = Bench("B")
    bench.do(f"={start}", "m64", "s200", "v80", way)
    bench.send("r")
    bench.run(ms=5)
    before, after = turning_points(bench, name, 2)
    for moment, expected in ((before, ends[0]), (after, ends[1])):
        bench.run((moment - bench.now) / SECOND)
        assert bench.now == moment
        assert value(bench, name) == expected


def test_what_stands_still_between_events_has_no_turns() -> None:
    bench = Bench("B")
    following = [path for path in POINTS if point(bench, path).turning_points is not None]
    assert following == ["POSITION", "VELOCITY", "COUNTER", "REGISTER9", "U1", "U2", "U3"]


def test_there_is_room_unless_lines_wait_or_the_eeprom_is_written() -> None:
    bench = Bench("B")
    bench.do("f640000")
    bench.send("r")
    bench.run(ms=50)
    assert value(bench, "room") == 1
    bench.send("u20")
    assert value(bench, "room") == 0
    bench.send("k")
    bench.finish()
    assert value(bench, "room") == 1
    stored = Bench("E1", address=1)
    stored.send("f64")
    assert value(stored, "room") == 0
    stored.run(0.5)
    assert value(stored, "room") == 1
    stored.send("f64", "x2")
    assert value(stored, "room") == 1, "it does not listen"
