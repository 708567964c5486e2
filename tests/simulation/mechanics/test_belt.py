"""Belts: where a drive is and when it comes to a place, and which workpiece covers one, against a walk pulse by pulse."""

from __future__ import annotations

from fractions import Fraction

import pytest

from steptwin.simulation.mechanics.belt import Belt, ConstantDrive, Near, Placed, Workpiece, nanometres, next_change


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


FAR = 10**15


class Walking:
    """A drive that makes a step each ns."""

    def version(self) -> object:
        return None

    def grid_position(self, now: int) -> int:
        return now

    def reaches(self, position: int, after: int, direction: int) -> int | None:
        return position if direction > 0 and position > after else None


def belt(name: str = "a", length: float = 200.0, per_mm: int = 1) -> Belt:
    return Belt(name, length, Walking(), Fraction(per_mm))


def placed(name: str, origin: int, length: int = 30, came_from: str = "") -> Placed:
    return Placed(Workpiece(name, length * 10**6), origin, length, came_from=came_from)


ONE, OTHER = placed("a.1", 100), placed("a.2", 140)


def over(one: Belt, place: int, now: int) -> str:
    """The name of the workpiece over a place."""
    found = one.occupant(place, place, now)
    return "" if found is None else found[1].workpiece.name


def test_what_is_over_a_place() -> None:
    """A workpiece reaches from its front backwards, both ends included; of two the first one put there counts."""
    there = belt()
    there.put(ONE)
    there.put(OTHER)
    at_50 = {now: over(there, 50, now) for now in range(140, 240)}
    assert {now for now, name in at_50.items() if name == "a.1"} == set(range(150, 181))
    assert {now for now, name in at_50.items() if name == "a.2"} == set(range(190, 221))
    there.put(placed("b.1", 95))
    assert over(there, 50, 160) == "a.1"
    assert over(there, 50, 145) == "b.1"


def test_what_is_over_a_stretch() -> None:
    """Any place of it, both ends included."""
    there = belt()
    there.put(ONE)
    for low in range(120):
        for high in range(low, 120):
            found = there.occupant(low, high, 190)
            assert (found is not None) is any(60 <= place <= 90 for place in range(low, high + 1))
    assert there.occupant(-40, -1, 110) is None, "what is before a belt is on another one"
    assert there.occupant(-40, 0, 100) == (there, ONE)


def test_edges_are_all_places_where_that_changes() -> None:
    there = belt()
    there.put(ONE)
    there.put(OTHER)
    covered = {now: over(there, 50, now) for now in range(100, 300)}
    for now in range(101, 299):
        below, above = there.edges(50, now)
        assert below is None or below < now
        assert above is None or above > now
        for other in range(now + 1, 299 if above is None else above):
            assert covered[other] == covered[now] or other == above
        for other in range(101 if below is None else below + 1, now):
            assert covered[other] == covered[now]
    assert there.edges(50, 100) == (None, 149)
    assert there.edges(50, 149) == (None, 150)
    assert there.edges(50, 150) == (149, 180)
    assert there.edges(50, 180) == (150, 181)
    assert there.edges(50, 185) == (181, 189)
    assert there.edges(50, 300) == (221, None)
    assert belt().edges(50, 5) == (None, None)


def test_every_change_of_the_workpieces_is_another_version() -> None:
    there = belt()
    versions = [there.version()]
    for change in (lambda: there.put(ONE), lambda: there.put(OTHER), lambda: there.take(ONE)):
        change()
        versions.append(there.version())
    assert len(set(versions)) == 4
    assert there.workpieces == (OTHER,)


def test_a_workpiece_keeps_its_size_on_any_grid() -> None:
    """33.3 mm on grids of 1 pm, 0.3 mm and 1 mm, one after the other."""
    workpiece = Workpiece("a.1", nanometres(33.3), marks=((nanometres(1.6), nanometres(3.1)),))
    found = []
    for per_mm in (Fraction(10**9), Fraction(10, 3), Fraction(1), Fraction(10**9)):
        one = Belt("a", 100.0, Walking(), per_mm).place(workpiece, 5, 0)
        assert (one.workpiece, one.front(0)) == (workpiece, 5)
        found.append((one.length, one.marks))
    assert found == [
        (33_300_000_000, ((1_600_000_000, 3_100_000_000),)),
        (111, ((5, 10),)),
        (33, ((2, 3),)),
        (33_300_000_000, ((1_600_000_000, 3_100_000_000),)),
    ]


@pytest.mark.parametrize("per_mm", [Fraction(10**9), Fraction(3200, 7), Fraction(1, 2)])
def test_lengths_are_rounded_to_the_nearest(per_mm: Fraction) -> None:
    there = Belt("a", 1000.0, Walking(), per_mm)
    for nm in range(-3_000_000, 3_000_001, 123_457):
        assert abs(there.from_nm(nm) - Fraction(nm, 10**6) * per_mm) <= Fraction(1, 2)
    for steps in range(-40, 41, 3):
        assert abs(there.to_nm(steps) - steps / per_mm * 10**6) <= Fraction(1, 2)


def test_a_workpiece_is_over_every_belt_below_it() -> None:
    """Three belts of 200, 100 and 200 mm on grids of 1, 0.5 and 0.25 mm; the middle one begins at 200 mm of the first."""
    first, middle, last = belt("a"), belt("b", 100.0, 2), belt("c", 200.0, 4)
    mm = 10**6
    first.near = Near(middle, 200 * mm, -FAR, FAR, 200 * mm, "a"), Near(last, 300 * mm, -FAR, FAR, 300 * mm, "b")
    middle.near = Near(first, -200 * mm, -FAR, FAR), Near(last, 100 * mm, -FAR, FAR, 100 * mm, "b")
    last.near = Near(middle, -100 * mm, -FAR, FAR), Near(first, -300 * mm, -FAR, FAR)
    # A front at 40 mm of the last one, 160 mm long: 180 to 340 mm from the beginning of the first one.
    last.put(placed("a.1", -160, 640, came_from="b"))
    for one, low, high in ((first, 180, 200), (middle, 0, 200), (last, 0, 160)):
        places = [place for place in range(one.length + 1) if over(one, place, 0)]
        assert places == list(range(low, high + 1))
        assert one.occupant(low, low, 0) == (last, last.workpieces[0])
    # Its rear is at 190 mm of the first one after 40 steps of a quarter of a millimetre, and never at 170 mm.
    assert first.next_change(190, 0) == 40
    assert first.next_change(190, 40) == 41
    assert first.next_change(170, 0) is None
    last.take(last.workpieces[0])
    # What has its centre on the first one reaches to 240 mm.
    first.put(placed("a.2", -240, 90))
    assert [place for place in range(middle.length + 1) if over(middle, place, 0)] == list(range(81))


def test_belts_concern_only_the_places_that_their_workpieces_reach() -> None:
    one, other = belt("a"), belt("b")
    one.near = (Near(other, 200 * 10**6, 150 * 10**6, FAR, 200 * 10**6, "a"),)
    versions = {place: one.version_at(place) for place in (149, 150)}
    other.put(placed("a.1", -10, 100, came_from="a"))
    assert [one.version_at(place) != versions[place] for place in (149, 150)] == [False, True]
    assert [over(one, place, 0) for place in (149, 150)] == ["", "a.1"]


def test_a_workpiece_is_on_the_way_that_it_came() -> None:
    """Two belts join a third one: the rear of what one has brought is not over the other."""
    one, other, third = belt("a"), belt("b"), belt("c")
    mm = 10**6
    one.near = Near(third, 200 * mm, -FAR, FAR, 200 * mm, "a"), Near(other, 0, -FAR, FAR, 200 * mm)
    third.put(placed("a.1", -10, 30, came_from="a"))
    assert [place for place in range(201) if over(one, place, 0)] == list(range(180, 201))
    third.take(third.workpieces[0])
    third.put(placed("b.1", -10, 30, came_from="b"))
    assert [place for place in range(150, 220) if over(one, place, 0)] == list(range(200, 211))
    third.take(third.workpieces[0])
    other.put(placed("b.2", -210, 30))
    assert [place for place in range(150, 220) if over(one, place, 0)] == list(range(200, 211))
    other.take(other.workpieces[0])
    third.put(placed("c.1", -10, 30))
    assert [place for place in range(150, 220) if over(one, place, 0)] == list(range(180, 211)), (
        "where it was put nothing is known"
    )


def test_a_belt_at_a_constant_speed_is_a_line() -> None:
    drive = ConstantDrive(Fraction(5, 2), 0)
    assert drive.line(5) == (0, 0)
    drive.run(True, 8)
    line = drive.line(8)
    assert line is not None
    assert line[1] == Fraction(5, 2)
    assert [drive.grid_position(now) for now in range(8, 20)] == [int(line[0] + line[1] * now) for now in range(8, 20)]
    drive.run(False, 11)
    assert drive.line(11) == (7, 0)
    assert drive.lead_over(drive) is None


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
