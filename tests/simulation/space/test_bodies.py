from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.space.bodies import Body, Box, Cylinder
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint
from steptwin.simulation.space.pieces import standing

FAR = 10**10
"""10 m: where a double has about a millionth of a nm."""


def overlap(one: Body, other: Body) -> bool:
    assert Pair(other, one).overlap(0) is Pair(one, other).overlap(0)
    return Pair(one, other).overlap(0)


def turned(angle_q: float, axis: int = 2) -> Frame:
    return Frame("table", FLOOR, (0, 0, 0), Joint(standing(angle_q), Direction(axis, 1), turns=True))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("away", [0, FAR])
def test_faces_that_touch_do_not_overlap_and_a_nanometre_more_does(axis: int, away: int) -> None:
    one = Body("one", FLOOR, Box((10, 20, 30)), (away, away, away))
    for more, expected in ((0, False), (-1, True), (1, False)):
        for side in (1, -1):
            way = [3, 3, 3]
            way[axis] = side * ((10, 20, 30)[axis] + 5 + more)
            other = Body("other", FLOOR, Box((5, 5, 5)), (away + way[0], away + way[1], away + way[2]))
            assert overlap(one, other) is expected


@pytest.mark.parametrize(
    ("radius", "place", "expected"),
    [(5, (13, 14, 0), False), (6, (13, 14, 0), True), (5, (15, 5, 0), False), (5, (14, 5, 0), True), (6, (13, 14, 20), False)],
)
def test_a_cylinder_passes_the_corner_of_a_box(radius: int, place: tuple[int, int, int], expected: bool) -> None:
    """The corner is at (10, 10): 5 away from (13, 14)."""
    wall = Body("wall", FLOOR, Box((10, 10, 10)))
    assert overlap(wall, Body("post", FLOOR, Cylinder(radius, 10), place)) is expected


@pytest.mark.parametrize(("place", "expected"), [((6, 8, 0), False), ((6, 7, 0), True), ((0, 0, 20), False), ((0, 0, 19), True)])
def test_two_cylinders(place: tuple[int, int, int], expected: bool) -> None:
    one, other = Body("one", FLOOR, Cylinder(6, 10)), Body("other", FLOOR, Cylinder(4, 10), place)
    assert overlap(one, other) is expected


def test_a_box_that_is_turned_reaches_farther_with_its_corner() -> None:
    """By √2 at 45°: 1 414 213.6 nm."""
    diamond = Body("diamond", turned(0.5), Box((10**6, 10**6, 10**6)))
    for x, expected in ((1_414_213, True), (1_414_214, False)):
        assert overlap(diamond, Body("wall", FLOOR, Box((10, 10, 10)), (x + 10, 0, 0))) is expected


def test_a_beam_is_a_box_without_breadth() -> None:
    beam = Body("beam", FLOOR, Box((100, 0, 0)))
    for y, expected in ((4, True), (5, False)):
        assert overlap(beam, Body("part", FLOOR, Box((5, 5, 5)), (50, y, 0))) is expected
        assert overlap(beam, Body("can", FLOOR, Cylinder(5, 5), (50, y, 0))) is expected
        assert overlap(beam, Body("part", turned(1.0), Box((5, 5, 5)), (y, -50, 0))) is expected
    assert not overlap(beam, Body("part", FLOOR, Box((5, 5, 5)), (105, 0, 0)))
    assert overlap(beam, Body("part", FLOOR, Box((5, 5, 5)), (104, 0, 0)))


def test_a_cylinder_is_compared_only_while_it_stands_along_the_axis_of_all_turns() -> None:
    spindle = turned(0.2, axis=0)
    with pytest.raises(Misuse, match="can is a cylinder along z: what turns about x"):
        Pair(Body("part", spindle, Box((5, 5, 5))), Body("can", FLOOR, Cylinder(5, 5)))
