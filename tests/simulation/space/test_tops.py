from __future__ import annotations

import pytest

from steptwin.simulation.space.bodies import Body, Box, Cylinder
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint
from steptwin.simulation.space.pieces import standing
from steptwin.simulation.space.tops import Above, height_over, top_below


def turned(angle_q: float, axis: int = 2) -> Frame:
    return Frame("table", FLOOR, (0, 0, 0), Joint(standing(angle_q), Direction(axis, 1), turns=True))


@pytest.mark.parametrize(
    ("point", "radius", "expected"),
    [
        ((0, 0, 50), 0, 20),
        ((10, 20, 30), 0, 0),
        ((11, 0, 50), 0, None),
        ((0, 0, 25), 0, -5),
        ((6, 16, 40), 4, 10),
        ((7, 16, 40), 4, None),
        ((-6, -17, 40), 4, None),
    ],
)
def test_a_disc_lies_within_the_top_of_a_box_or_hangs_over(
    point: tuple[int, int, int], radius: int, expected: int | None
) -> None:
    assert height_over(Body("box", FLOOR, Box((10, 20, 30))), FLOOR, point, 0, radius) == expected


@pytest.mark.parametrize(("point", "expected"), [((3, 4, 9), 4), ((4, 4, 9), None)])
def test_a_disc_lies_within_the_top_of_a_cylinder(point: tuple[int, int, int], expected: int | None) -> None:
    """Of radius 7 in one of 12: 5 are left."""
    assert height_over(Body("can", FLOOR, Cylinder(12, 5)), FLOOR, point, 0, 7) == expected
    assert height_over(Body("can", FLOOR, Cylinder(6, 5)), FLOOR, (0, 0, 9), 0, 7) is None


def test_a_box_that_lies_at_an_angle_has_its_top_there() -> None:
    """Turned by 45°, its corner is at 141 and its side at 100 from the middle."""
    box = Body("box", turned(0.5), Box((100, 100, 10)))
    assert height_over(box, FLOOR, (140, 0, 10), 0) == 0
    assert height_over(box, FLOOR, (90, 90, 10), 0) is None


def test_a_face_that_is_tilted_holds_nothing() -> None:
    assert height_over(Body("box", turned(0.25, axis=0), Box((100, 100, 10))), FLOOR, (0, 0, 50), 0) is None
    assert height_over(Body("box", turned(4.0, axis=0), Box((100, 100, 10))), FLOOR, (0, 0, 50), 0) == 40


def test_the_highest_face_below_carries_and_the_first_name_of_equals() -> None:
    low, high = Body("low", FLOOR, Box((50, 50, 10))), Body("high", FLOOR, Box((10, 10, 20)))
    lid, same = Body("lid", FLOOR, Box((50, 50, 1)), (0, 0, 99)), Body("even", FLOOR, Box((10, 10, 20)))
    assert top_below([low, lid, high], FLOOR, (5, 5, 40), 0) == Above(20, high)
    assert top_below([low, lid, high], FLOOR, (20, 5, 40), 0) == Above(30, low)
    assert top_below([low, lid, high], FLOOR, (60, 5, 40), 0) is None
    assert top_below([high, same], FLOOR, (0, 0, 20), 0) == Above(0, same)
    face = Body("nest", FLOOR, Box((50, 50, 0)), (0, 0, 20))
    assert top_below([high, face, same], FLOOR, (0, 0, 20), 0) == Above(0, face)
