"""Where workpieces of two belts touch, against a walk nanosecond by nanosecond."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.simulation.mechanics.belt import Belt, ConstantDrive, Near, Placed, Workpiece
from steptwin.simulation.mechanics.beltline import ahead_of, limit, next_look, pushed_against

FAR = 10**15
NM = 1000
"""Steps of a belt with a drive of its own."""


class Wandering:
    """A drive on a grid of 1/4 nm that goes to and fro: the positions at each ns."""

    def __init__(self, positions: list[int]) -> None:
        self.positions = positions

    def version(self) -> object:
        return None

    def grid_position(self, now: int) -> int:
        return self.positions[min(now, len(self.positions) - 1)]

    def reaches(self, position: int, after: int, direction: int) -> int | None:
        if (position - self.grid_position(after)) * direction <= 0:
            return None
        later = range(after + 1, len(self.positions))
        return next((now for now in later if (self.positions[now] - position) * direction >= 0), None)


def own(name: str, speed: Fraction, length_nm: int) -> Belt:
    drive = ConstantDrive(speed, 0)
    drive.run(True, 0)
    return Belt(name, length_nm / 10**6, drive, Fraction(10**9))


def line(length_nm: int, drive: object, per_mm: Fraction, other: object, its_per_mm: Fraction) -> tuple[Belt, Belt]:
    """A belt and the following one."""
    one, two = Belt("a", length_nm / 10**6, drive, per_mm), Belt("b", 0.001, other, its_per_mm)  # type: ignore[arg-type]
    one.following = two
    one.near = (Near(two, length_nm, -FAR, FAR, length_nm, "a"),)
    two.near = (Near(one, -length_nm, -FAR, FAR),)
    return one, two


def lying(name: str, front: int, length: int, came_from: str = "", held: int | None = None) -> Placed:
    return Placed(Workpiece(name, 0), -front, length, held=held, came_from=came_from)


SPEEDS = st.fractions(Fraction(1, 2), Fraction(9000), max_denominator=7)


@settings(max_examples=60, deadline=None)
@given(SPEEDS, SPEEDS, st.integers(0, 30), st.integers(1, 40), st.integers(1, 40))
def test_two_constant_speeds_touch_where_a_walk_has_it(fast: Fraction, slow: Fraction, gap: int, long: int, short: int) -> None:
    """Places in nm, for 300 ns."""
    one, two = own("a", fast, 100), own("b", slow, 100)
    one.following, one.near = two, (Near(two, 100, -FAR, FAR, 100, "a"),)
    two.put(lying("a.1", long * NM // 2, long * NM, "a"))
    one.put(lying("a.2", (100 - long) * NM + long * NM // 2 - gap * NM, short * NM))
    first = next(iter(one.firsts(0)), None)
    assert first is not None
    found, end = limit(one, first, 0), one.exit(first)

    def distance(now: int) -> Fraction:
        rear = 100 * NM + two.workpieces[0].front(two.position(now)) - long * NM
        return Fraction(rear - first.front(one.position(now)), NM)

    moment = next((now for now in range(300) if first.front(one.position(now)) >= end), None)
    rounding = 3 + (fast + slow) / NM
    if found is None:
        assert moment is None or distance(moment) >= -rounding
        return
    touches = next(now for now in range(10**6) if first.front(one.position(now)) >= found)
    assert abs(distance(touches)) <= rounding
    assert all(distance(now) >= -rounding for now in range(0, touches, max(1, touches // 50)))


def walked(one: Belt, two: Belt, end: int) -> list[tuple[int, int]]:
    """Each ns at which the limit is not that of before, as one who looks each ns sees it: whether the first one touches."""
    found = []
    for now in range(end):
        first = next(iter(one.firsts(now)), None)
        assert first is not None
        place = limit(one, first, now)
        if place is not None and first.front(one.position(now)) >= place:
            found.append((now, place))
            break
    return found


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(-3, 4), min_size=40, max_size=80),
    st.lists(st.integers(-2, 3), min_size=40, max_size=80),
    st.integers(2, 40),
)
def test_whoever_looks_when_it_is_due_sees_what_one_sees_who_always_looks(ways: list[int], its: list[int], gap: int) -> None:
    """Two drives that go to and fro."""

    def positions(steps: list[int]) -> list[int]:
        found = [0]
        for step in steps:
            found.append(found[-1] + step)
        return found

    one, two = line(100, Wandering(positions(ways)), Fraction(4 * 10**6), Wandering(positions(its)), Fraction(4 * 10**6))
    two.put(lying("a.1", 40, 80, "a"))
    one.put(lying("a.2", 360 - gap, 60))
    end = min(len(ways), len(its))
    expected = walked(one, two, end)
    now, found = 0, []
    while now < end:
        first = next(iter(one.firsts(now)), None)
        assert first is not None
        place, front = limit(one, first, now), first.front(one.position(now))
        if place is not None and front >= place:
            found.append((now, place))
            break
        look, due = next_look(one, first, now)
        ends = [one.exit(first), *(at for at in (place, look) if at is not None)]
        moments = [due, one.drive.reaches(first.origin + min(ends), now, 1)]
        now = min((moment for moment in moments if moment is not None), default=end)
    assert found == expected


def test_one_that_stands_goes_on_with_room_for_half_of_it() -> None:
    one, two = own("a", Fraction(4), 100), own("b", Fraction(1), 100)
    one.following, one.near = two, (Near(two, 100, -FAR, FAR, 100, "a"),)
    two.put(lying("a.1", 10 * NM, 40 * NM, "a"))
    one.put(lying("a.2", 0, 30 * NM, held=69 * NM))
    first = one.workpieces[0]
    moved = [(now, limit(one, first, now)) for now in range(0, 60_000, 10)]
    goes_on = next(now for now, place in moved if place is None or place > 69 * NM)
    # Its front is 1 nm behind the rear at 70 nm. There is room for 15 nm after 14 nm, at a step in each ns, to the nearest nm.
    assert 14_500 <= goes_on <= 14_510
    _, due = next_look(one, first, 0)
    assert due is not None
    assert goes_on - 10 <= due <= goes_on
    # As quick: at once.
    quick = own("b", Fraction(4), 100)
    quick.put(two.workpieces[0])
    one.near = (Near(quick, 100, -FAR, FAR, 100, "a"),)
    assert limit(one, first, 0) is None


def test_one_that_is_pushed_back_against_another() -> None:
    one, two = line(100, Wandering([0]), Fraction(4 * 10**6), Wandering([0, -20, -60]), Fraction(4 * 10**6))
    two.put(lying("a.1", 40, 80, "a"))
    one.put(lying("a.2", 340, 60))
    first = one.workpieces[0]
    assert [pushed_against(one, first, now) is not None for now in range(3)] == [False, False, True]


@pytest.mark.parametrize(("its", "mine", "waits"), [(0, 0, True), (3, 0, True), (3, 3, True), (2, 3, False), (-1, 0, False)])
def test_of_two_ways_the_one_goes_on_that_is_further(its: int, mine: int, waits: bool) -> None:
    """Steps beyond the place where they join."""
    one, third = own("a", Fraction(1), 100), own("c", Fraction(1), 100)
    other = own("b", Fraction(1), 100)
    one.following = other.following = third
    one.near = Near(third, 100, -FAR, FAR, 100, "a"), Near(other, 0, -FAR, FAR, 100)
    other.put(lying("b.1", (100 + its) * NM, 20 * NM))
    one.put(lying("a.1", (100 + mine) * NM, 20 * NM))
    first = one.workpieces[0]
    found = [ahead.rear for ahead in ahead_of(one, first, 0)]
    assert found == ([100 * NM] if waits else [])
    other.hold(other.workpieces[0], (100 + its) * NM)
    assert bool(list(ahead_of(one, first, 0))) is (waits and its > 0)
