"""The profile of a cam, against a walk from pulse to pulse."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from steptwin.simulation.mechanics.cam import Cam

TURNS = st.builds(Fraction, st.integers(40, 200), st.sampled_from([1, 1, 3, 7]))


@st.composite
def cams(draw: st.DrawFn) -> Cam:
    turn = draw(TURNS)
    places = draw(st.lists(st.integers(0, int(turn * 10) - 1), min_size=2, max_size=6, unique=True))
    return Cam([(Fraction(place, 10), Fraction(draw(st.integers(0, 30)))) for place in places], turn)


def test_the_lift_is_linear_between_points_and_through_the_end_of_a_revolution() -> None:
    cam = Cam([(Fraction(10), Fraction(0)), (Fraction(30), Fraction(8)), (Fraction(70), Fraction(8))], Fraction(100))
    assert [float(cam.lift(place)) for place in (10, 15, 30, 50, 70, 90, 100, 110, -90, 205)] == [0, 2, 8, 8, 8, 4, 2, 0, 0, 1]


@given(cam=cams(), level=st.integers(-1, 61), place=st.integers(-300, 300))
def test_the_next_place_is_the_first_that_a_walk_finds(cam: Cam, level: int, place: int) -> None:
    for direction in (1, -1):
        for heading in (1, -1):
            walk = range(place + heading, place + 2000 * heading, heading)
            expected = next((at for at in walk if (cam.lift(at) - Fraction(level, 2)) * direction >= 0), None)
            assert cam.next(Fraction(level, 2), place, direction, heading) == expected


@given(cam=cams(), place=st.integers(-300, 300), heading=st.sampled_from([1, -1]))
def test_between_corners_it_goes_one_way(cam: Cam, place: int, heading: int) -> None:
    before = place
    for corner in cam.corners(place, heading):
        if abs(corner - place) > 2 * cam.turn:
            break
        steps = [b - a for a, b in pairwise(cam.lift(at) for at in range(before, corner, heading))]
        assert not (any(step > 0 for step in steps) and any(step < 0 for step in steps))
        assert (corner - before) * heading > 0
        before = corner
    assert abs(before - place) > cam.turn / 2


@given(cam=cams(), place=st.integers(-300, 300), heading=st.sampled_from([1, -1]))
def test_corners_go_through_all_revolutions_that_differ(cam: Cam, place: int, heading: int) -> None:
    *_, last = cam.corners(place, heading)
    assert (last - place) * heading >= cam.turn * cam.turn.denominator
