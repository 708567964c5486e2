"""Belts: where a drive is and when it comes to a place, and which workpiece covers one, against a walk pulse by pulse."""

from __future__ import annotations

from fractions import Fraction

import pytest

from steptwin.simulation.mechanics.belt import ConstantDrive, Load, Workpiece, next_change


def test_a_belt_with_its_own_drive() -> None:
    """2.5 mm/s are 5 places in 2 ns."""
    drive = ConstantDrive(Fraction(5, 2), 100)
    assert (drive.grid_position(200), drive.reaches(1, 100, 1)) == (0, None)
    first = drive.version()
    drive.run(True, 200)
    assert drive.version() != first
    assert [drive.grid_position(200 + n) for n in range(5)] == [0, 2, 5, 7, 10]
    second = drive.version()
    drive.run(True, 201)
    assert drive.version() == second, "it runs already"
    assert drive.grid_position(204) == 10
    drive.run(False, 203)
    assert drive.version() not in (first, second)
    assert [drive.grid_position(n) for n in (203, 204, 999)] == [7, 7, 7]
    drive.run(True, 300)
    assert [drive.grid_position(300 + n) for n in range(3)] == [7, 9, 12]


def test_when_a_belt_comes_to_a_place() -> None:
    """The first nanosecond in which it is there or beyond, and only forwards."""
    drive = ConstantDrive(Fraction(5, 2), 0)
    drive.run(True, 50)
    for place in range(1, 40):
        expected = next(now for now in range(50, 100) if drive.grid_position(now) >= place)
        assert drive.reaches(place, 50, 1) == expected
        assert drive.reaches(place, expected - 1, 1) == expected
        assert drive.reaches(place, expected, 1) == (None if place <= drive.grid_position(expected) else expected + 1)
        assert drive.reaches(place, 50, -1) is None
    assert drive.reaches(0, 50, 1) is None
    drive.run(False, 60)
    assert drive.reaches(1000, 60, 1) is None


ONE, OTHER = Workpiece("a.1", 100, 30), Workpiece("a.2", 140, 30)


def test_what_covers_a_place() -> None:
    """A workpiece reaches from its front backwards, both ends included; of two the first one put there counts."""
    load = Load()
    load.put(ONE)
    load.put(OTHER)
    at_50 = {belt: load.covering(50, belt) for belt in range(140, 240)}
    assert {belt for belt, piece in at_50.items() if piece == ONE} == set(range(150, 181))
    assert {belt for belt, piece in at_50.items() if piece == OTHER} == set(range(190, 221))
    load.put(Workpiece("b.1", 95, 30))
    assert load.covering(50, 160) == ONE
    assert load.covering(50, 145) == Workpiece("b.1", 95, 30)


def test_edges_are_all_places_where_that_changes() -> None:
    load = Load()
    load.put(ONE)
    load.put(OTHER)
    covered = {belt: load.covering(50, belt) for belt in range(100, 300)}
    for belt in range(101, 299):
        below, above = load.edges(50, belt)
        assert below is None or below < belt
        assert above is None or above > belt
        for other in range(belt + 1, 299 if above is None else above):
            assert covered[other] == covered[belt] or other == above
        for other in range(101 if below is None else below + 1, belt):
            assert covered[other] == covered[belt]
    assert load.edges(50, 100) == (None, 149)
    assert load.edges(50, 149) == (None, 150)
    assert load.edges(50, 150) == (149, 180)
    assert load.edges(50, 180) == (150, 181)
    assert load.edges(50, 185) == (181, 189)
    assert load.edges(50, 300) == (221, None)
    assert Load().edges(50, 5) == (None, None)


def test_every_change_of_a_load_is_another_version() -> None:
    load = Load()
    versions = [load.version()]
    for change in (lambda: load.put(ONE), lambda: load.put(OTHER), lambda: load.take(ONE)):
        change()
        versions.append(load.version())
    assert len(set(versions)) == 4
    assert load.workpieces == (OTHER,)


class Both:
    """A drive that comes to a place below after 7 ns and to one above after 5 ns, if that is 1."""

    def __init__(self, down: int | None, up: int | None) -> None:
        self.down, self.up = down, up

    def version(self) -> object:
        return None

    def grid_position(self, now: int) -> int:
        return 0

    def reaches(self, position: int, after: int, direction: int) -> int | None:
        assert (position, direction) in ((-1, -1), (1, 1))
        return self.down if direction < 0 else self.up


@pytest.mark.parametrize(
    ("drive", "below", "above", "due"),
    [
        (Both(7, 5), -1, 1, 5),
        (Both(5, 7), -1, 1, 5),
        (Both(5, None), -1, 1, 5),
        (Both(None, 7), -1, 1, 7),
        (Both(None, None), -1, 1, None),
        (Both(5, 7), None, 1, 7),
        (Both(5, 7), -1, None, 5),
        (Both(5, 7), None, None, None),
    ],
)
def test_the_next_of_two_places(drive: Both, below: int | None, above: int | None, due: int | None) -> None:
    assert next_change(drive, below, above, 0) == due
