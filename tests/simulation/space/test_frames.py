from __future__ import annotations

from math import cos, pi, sin

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.space.frames import (
    FLOOR,
    Direction,
    Frame,
    Joint,
    Pose,
    in_plane,
    out_of_plane,
    path,
    pose,
)
from steptwin.simulation.space.pieces import standing

UP_X, UP_Y, UP_Z, DOWN_Z = Direction(0, 1), Direction(1, 1), Direction(2, 1), Direction(2, -1)


def slide(position: float, along: Direction = UP_X) -> Joint:
    return Joint(standing(position), along)


def turn(angle_q: float, about: Direction = UP_Z) -> Joint:
    return Joint(standing(angle_q), about, turns=True)


@pytest.mark.parametrize("axis", range(3))
def test_the_plane_across_an_axis_is_right_handed_and_its_opposite_gives_the_values_back(axis: int) -> None:
    units = [tuple(float(n == one) for n in range(3)) for one in range(3)]
    u, v, w = (out_of_plane(unit, axis) for unit in units)
    assert w == units[axis]
    assert tuple(u[(n + 1) % 3] * v[(n + 2) % 3] - u[(n + 2) % 3] * v[(n + 1) % 3] for n in range(3)) == w
    assert out_of_plane(in_plane((1, 2, 3), axis), axis) == (1, 2, 3)


def test_a_quarter_turn_is_exact_and_a_frame_goes_with_what_it_is_on() -> None:
    table = Frame("table", FLOOR, (100, 200, 300), turn(1.0))
    nest = Frame("nest", table, (50, 10, 7))
    assert pose(nest, FLOOR, 0) == Pose((90, 250, 307), 2, 1.0)
    assert pose(FLOOR, nest, 0) == Pose((-250, 90, -307), 2, -1.0)


@pytest.mark.parametrize(("about", "there"), [(UP_X, (1, -3, 2)), (UP_Y, (3, 2, -1)), (UP_Z, (-2, 1, 3)), (DOWN_Z, (2, -1, 3))])
def test_turns_go_from_the_next_axis_to_the_one_after_it(about: Direction, there: tuple[int, int, int]) -> None:
    arm = Frame("arm", FLOOR, (0, 0, 0), turn(1.0, about))
    assert pose(Frame("hand", arm, (1, 2, 3)), FLOOR, 0).at == there


def test_an_arm_of_two_links_is_where_trigonometry_has_it() -> None:
    upper = Frame("upper", FLOOR, (0, 0, 0), turn(0.3))
    lower = Frame("lower", upper, (200_000_000, 0, 0), turn(0.9, DOWN_Z))
    hand = Frame("hand", lower, (150_000_000, 0, 0))
    first, second = 0.3 * pi / 2, -0.6 * pi / 2
    x = round(200_000_000 * cos(first) + 150_000_000 * cos(second))
    y = round(200_000_000 * sin(first) + 150_000_000 * sin(second))
    assert pose(hand, FLOOR, 0).at == (x, y, 0)
    assert pose(hand, FLOOR, 0).angle_q == pytest.approx(-0.6)


def test_what_two_frames_are_both_on_is_not_calculated() -> None:
    """A third of a nm and turns about another axis would be there otherwise."""
    base = Frame("base", FLOOR, (0, 0, 0), turn(0.123, UP_X))
    gantry = Frame("gantry", base, (5, 5, 5), slide(1 / 3))
    one, other = Frame("one", gantry, (10, 0, 0), slide(4.0, UP_Y)), Frame("other", gantry, (0, 0, 1), turn(2.0))
    assert [step.frame.name for step in path(one, other)] == ["one", "other"]
    assert pose(one, other, 0) == Pose((-10, -4, -1), 2, -2.0)


def test_a_chain_is_rounded_once() -> None:
    half = Frame("half", FLOOR, (0, 0, 0), slide(0.5))
    assert pose(Frame("whole", half, (0, 0, 0), slide(0.5)), FLOOR, 0).at == (1, 0, 0)
    assert pose(half, Frame("back", FLOOR, (0, 0, 0), slide(-0.25)), 0).at == (1, 0, 0)


def test_turns_about_two_directions_are_refused_by_name() -> None:
    table = Frame("table", FLOOR, (0, 0, 0), turn(0.5))
    spindle = Frame("spindle", table, (0, 0, 0), turn(0.5, UP_X))
    with pytest.raises(Misuse, match="table turns about z and spindle about x"):
        pose(spindle, FLOOR, 0)
    assert pose(spindle, table, 0).about == 0
