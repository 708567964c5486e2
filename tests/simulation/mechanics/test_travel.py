"""Travel between two ends at two speeds: places and moments against arithmetic with whole numbers."""

from __future__ import annotations

import pytest

from steptwin.simulation.mechanics.travel import Travel


def test_forth_and_back() -> None:
    """From end to end 10 ns forth and 4 ns back: 20 places, 2 and 5 for each nanosecond."""
    travel = Travel(10, 4, is_forth=False, now=100)
    assert travel.full % 10 == travel.full % 4 == 0
    forth, back = travel.full // 10, travel.full // 4
    assert (travel.grid_position(100), travel.direction, list(travel.turning_points(100))) == (0, 0, [])
    before = travel.version()
    travel.send(1, 100)
    assert travel.version() != before
    assert list(travel.turning_points(100)) == [101, 110]
    assert [travel.grid_position(100 + n) for n in (0, 1, 9, 10, 11)] == [0, forth, 9 * forth, travel.full, travel.full]
    assert list(travel.turning_points(105)) == [110]
    assert list(travel.turning_points(110)) == []
    version = travel.version()
    travel.send(1, 104)
    assert travel.version() == version, "it goes there already"
    travel.send(-1, 106)
    assert travel.version() != version
    assert travel.direction == -1
    assert [travel.grid_position(106 + n) for n in (0, 1, 2)] == [6 * forth, 6 * forth - back, 6 * forth - 2 * back]
    assert list(travel.turning_points(106)) == [109]
    travel.send(0, 107)
    assert (travel.grid_position(150), list(travel.turning_points(150))) == (6 * forth - back, [])


def test_it_may_begin_at_the_upper_end() -> None:
    travel = Travel(10, 4, is_forth=True, now=0)
    assert travel.grid_position(5) == travel.full
    travel.send(-1, 5)
    assert list(travel.turning_points(5)) == [6, 9]
    assert travel.grid_position(9) == 0


@pytest.mark.parametrize(
    ("share", "after", "direction", "due"),
    [
        (0, 100, 1, None),  # it is there
        (1, 100, 1, 101),
        (5, 100, 1, 105),
        (5, 104, 1, 105),
        (5, 105, 1, None),
        (10, 100, 1, 110),
        (11, 100, 1, None),
        (-1, 100, 1, None),
        (5, 100, -1, None),
    ],
)
def test_when_it_reaches_a_place(share: int, after: int, direction: int, due: int | None) -> None:
    """In tenths of the whole, which it goes in 10 ns."""
    travel = Travel(10, 4, is_forth=False, now=100)
    travel.send(1, 100)
    assert travel.reaches(share * travel.full // 10, after, direction) == due


def test_a_place_between_two_nanoseconds_is_reached_with_the_second() -> None:
    travel = Travel(10, 4, is_forth=False, now=100)
    travel.send(1, 100)
    forth = travel.full // 10
    assert [travel.reaches(3 * forth + n, 100, 1) for n in (-1, 0, 1)] == [103, 103, 104]
    travel.send(-1, 110)
    assert travel.reaches(0, 110, -1) == 114
    assert travel.reaches(travel.full, 110, -1) is None
